"""Arms that bend: laws of effects, statics and poses of their own, in plain numpy on the generator's arms.

The laws are written anew from the words of the catalogue. A joint turns by a small rotation vector right
before its drive, in the axes there; lengths may grow, and the measuring frame may creep. Moments are those
that hold the links at rest, taken on the arm as it is deflected: the deflected arm is found by rounds.

Of a sliding joint the third number of such a vector is a shift along its axis, and the third of its moments
the force along it. Effects that the catalogue does not hold have names of their own: `dent`, `kinked gear`,
`dragging hose` (all of one joint's position), `wind-up` (of where it came from), `hardening drive`, `belt
stretch` (of the moment about its axis) and `wobbling mount` (of the moment at the mount).
"""

from dataclasses import dataclass, fields, replace

import numpy as np
from generator import VirtualArm, four, rotation

ROUNDS = 10
"""Most rounds of the deflected arm; each brings three digits, half of one where moments flip play."""
SAME = 1e-15
"""Change of every angle [rad] at which further rounds change nothing."""
WARM = 20.0
"""Temperature at which lengths are as given [degC]."""
TURN = 2.0 * np.pi
LEAD = 1.0
"""Way of a slide that counts as a turn, where a law speaks of turns [m]."""
SLIP = 1.0
"""How far a joint goes until it is wound up, per standard deviation of its positions."""


@dataclass(frozen=True, eq=False)
class State:
    """What drives effects, one row a pose: q, direction (rows, n), others (rows,) [rad, s, degC, kg]."""

    q: np.ndarray
    direction: np.ndarray
    time: np.ndarray
    temperature: np.ndarray
    payload: np.ndarray
    wrench: np.ndarray | None = None
    """[f; τ] that pulls at the tool's origin, (rows, 6), in the axes of the arm's first frame [N, N m]."""
    wound: np.ndarray | None = None
    """How far each joint is wound up by the way that it came, (rows, n), from −1 to 1."""

    def take(self, rows):
        """The chosen rows."""
        known = {f.name: getattr(self, f.name) for f in fields(self)}
        return replace(self, **{name: v[rows] for name, v in known.items() if v is not None})


@dataclass(frozen=True)
class Effect:
    """One effect on one arm.

    Args:
        name: Its name in the catalogue, or a name of its own where the catalogue has none.
        joints: Counted from 0; empty for the whole arm; (moved, by) for a coupling.
        size: Coefficients, SI, in the catalogue's order and units where it is named there.
        detail: Order of a harmonic; `moment` or `motion` for backlash.
        shape: Constants of a nameless law.
    """

    name: str
    joints: tuple[int, ...] = ()
    size: tuple[float, ...] = (1.0,)
    detail: int | str | None = None
    shape: tuple[float, ...] = ()

    def scaled(self, factor):
        """The same effect, larger or smaller."""
        return replace(self, size=tuple(float(factor * c) for c in self.size))


def _about(effect, state, angle):
    """Rotation vectors of one joint about its own axis, by angles (rows,) or (rows, 1)."""
    out = np.zeros((*state.q.shape, 3))
    out[:, effect.joints[0], 2] = effect.size[0] * angle
    return out


def _across(effect, state, tilt):
    """Rotation vectors of one joint about the two axes across its own, by tilts (rows, 2)."""
    out = np.zeros((*state.q.shape, 3))
    out[:, effect.joints[0], :2] = tilt
    return out


def _angle(effect, state):
    return state.q[:, effect.joints[0]]


def turned(arm, joint, q):
    """Positions of a joint as angles of its gear [rad]."""
    return q[:, joint] * (TURN / LEAD if arm.sliding[joint] else 1.0)


def wound(q):
    """How far joints are wound up (rows − 1, n), after poses (rows, n) that were reached one after the other.

    A spring drags a block that slips (one element of Maxwell and Jenkin): the error depends on the whole way.
    """
    steps = np.diff(q, axis=0) / np.maximum(SLIP * q.std(axis=0), 1e-12)
    out, now = np.zeros_like(steps), np.zeros(q.shape[1])
    for row, step in enumerate(steps):
        now = np.clip(now + step, -1.0, 1.0)
        out[row] = now
    return out


def _compliance(effect, arm, state, held):
    return _about(effect, state, -held[:, effect.joints[0], 2])


def _backlash(effect, arm, state, held):
    cause = held[:, :, 2] if effect.detail == "moment" else state.direction
    return _about(effect, state, -np.sign(cause[:, effect.joints[0]]))


def _clearance(effect, arm, state, held):
    across = held[:, effect.joints[0], :2]
    return _across(effect, state, -effect.size[0] * across / np.linalg.norm(across, axis=1, keepdims=True))


def _bearing(effect, arm, state, held):
    return _across(effect, state, -effect.size[0] * held[:, effect.joints[0], :2])


def _flexure(effect, arm, state, held):
    """The link bends at its root, about axes that turn with it."""
    joint = effect.joints[0]
    angle = np.where(arm.sliding[joint], 0.0, _angle(effect, state) + arm.table[joint, 0])
    c, s = np.cos(angle), np.sin(angle)
    x, y = held[:, joint, 0], held[:, joint, 1]
    bend_x, bend_y = -effect.size[0] * (c * x + s * y), -effect.size[1] * (c * y - s * x)
    return _across(effect, state, np.stack([c * bend_x - s * bend_y, s * bend_x + c * bend_y], 1))


def _harmonic(effect, arm, state, held):
    phase = effect.detail * _angle(effect, state)
    c, s = effect.size
    out = np.zeros((*state.q.shape, 3))
    out[:, effect.joints[0], 2] = c * np.cos(phase) + s * np.sin(phase)
    return out


def _scale(effect, arm, state, held):
    return _about(effect, state, _angle(effect, state))


def _coupling(effect, arm, state, held):
    return _about(effect, state, state.q[:, effect.joints[1]])


def _dent(effect, arm, state, held):
    """A cosine bump of a gear's angle, once a turn; shape = its middle and half its width [rad]."""
    middle, width = effect.shape
    away = np.abs((turned(arm, effect.joints[0], state.q) - middle + np.pi) % TURN - np.pi)
    return _about(effect, state, np.where(away < width, 0.5 + 0.5 * np.cos(np.pi * away / width), 0.0))


def _kinked(effect, arm, state, held):
    """Straight pieces between evenly spaced teeth of a turn; shape = the first one's place, then heights."""
    first, *heights = effect.shape
    places = np.arange(len(heights) + 1) * TURN / len(heights)
    angle = (turned(arm, effect.joints[0], state.q) - first) % TURN
    return _about(effect, state, np.interp(angle, places, [*heights, heights[0]]))


def _hose(effect, arm, state, held):
    """Hoses that wind about a joint pull it: slack between two angles, taut at once beyond; shape = these."""
    low, high = effect.shape
    q = turned(arm, effect.joints[0], state.q)
    pull = np.where(q > high, 1.0 - np.exp(high - q), 0.0) - np.where(q < low, 1.0 - np.exp(q - low), 0.0)
    return _about(effect, state, -pull)


def _mount(effect, arm, state, held):
    """The mount sticks until the moment that tips it exceeds shape[0] [N m], then gives way to the rest."""
    across = held[:, 0, :2]
    moment = np.linalg.norm(across, axis=1, keepdims=True)
    return _across(effect, state, -effect.size[0] * across * np.maximum(1.0 - effect.shape[0] / moment, 0.0))


def _hardening(effect, arm, state, held):
    """A drive that gets stiffer the more it gives way; shape[0] halves its compliance [N m or N]."""
    load = held[:, effect.joints[0], 2]
    return _about(effect, state, -load / (1.0 + np.abs(load) / effect.shape[0]))


def _belt(effect, arm, state, held):
    """A belt between two pulleys, soft where both free lengths are long; shape = the pulleys' places."""
    low, high = effect.shape
    place = (_angle(effect, state) - low) / (high - low)
    return _about(effect, state, -4.0 * place * (1.0 - place) * held[:, effect.joints[0], 2])


def _wind_up(effect, arm, state, held):
    return _about(effect, state, state.wound[:, effect.joints[0]])


BY_MOMENT = {
    "joint-compliance": _compliance,
    "backlash": _backlash,
    "clearance-tilt": _clearance,
    "bearing-compliance": _bearing,
    "link-flexure": _flexure,
    "wobbling mount": _mount,
    "hardening drive": _hardening,
    "belt stretch": _belt,
}
BY_STATE = {
    "joint-harmonic": _harmonic,
    "encoder-scale": _scale,
    "joint-coupling": _coupling,
    "dent": _dent,
    "kinked gear": _kinked,
    "dragging hose": _hose,
    "wind-up": _wind_up,
}
WHOLE = ("thermal-growth", "base-drift")
TURNING = ("joint-harmonic", "link-flexure")
"""What only a joint that turns has."""
LOCAL = ("dent", "kinked gear", "dragging hose")
NAMELESS = (*LOCAL, "wobbling mount", "hardening drive", "belt stretch", "wind-up")


def pieces(arm: VirtualArm, q, growth):
    """Per joint: transforms before, of, and after its drive at angles q, with lengths by growth (rows,)."""
    return [[_grown(part, growth) for part in parts] for parts in arm.parts(q)]


def straight_moments(arm: VirtualArm, state: State):
    """Moments as `holding` of the arm that nothing bends."""
    return arm.moments(state.q, state.payload, state.wrench)


def deflected_links(arm: VirtualArm, effects, state: State):
    """Transforms (joints, rows, 4, 4) to each link of the deflected arm in its first frame, and growth."""
    growth = 1.0 + sum(e.size[0] * (state.temperature - WARM) for e in effects if e.name == "thermal-growth")
    growth = growth * np.ones(len(state.q))
    joints, bend = pieces(arm, state.q, growth), np.zeros((*state.q.shape, 3))
    by_moment = any(e.name in BY_MOMENT for e in effects)
    for _ in range(ROUNDS if by_moment else 1):
        now, last = arm.bent(joints, bend), bend
        held = arm.holding(*now, state.payload, state.wrench) if by_moment else None
        bend = sum((turns(arm, e, state, held) for e in effects), np.zeros_like(bend))
        if np.abs(bend - last).max(initial=0.0) < SAME:
            break
    return arm.bent(joints, bend)[1], growth


def poses(arm: VirtualArm, effects, state: State):
    """Poses (rows, 4, 4) of the tool in the measuring frame."""
    links, growth = deflected_links(arm, effects, state)
    return _base(arm, effects, state) @ links[-1] @ _grown(arm.tool, growth)


def turns(arm, effect, state, held):
    """Rotation vectors (rows, n, 3) that one effect adds right before the drives."""
    if effect.name in WHOLE:
        return np.zeros((*state.q.shape, 3))
    return (BY_MOMENT | BY_STATE)[effect.name](effect, arm, state, held)


def _base(arm, effects, state):
    """The arm's first frame in the measuring frame, which creeps."""
    base = np.tile(arm.base, (len(state.q), 1, 1))
    for effect in effects:
        if effect.name == "base-drift":
            crept = state.time[:, None] * np.array(effect.size)
            base[:, :3, 3] += crept[:, :3]
            base = base @ four(rotation(crept[:, 3:]))
    return base


def _grown(transform, growth):
    """Transforms with longer lengths."""
    out = np.tile(transform, (len(growth), 1, 1)) if transform.ndim == 2 else transform.copy()
    out[:, :3, 3] *= growth[:, None]
    return out


def change(seen, from_poses):
    """Small twists (rows, 6) from poses to others [m, rad], in the axes of the measuring frame."""
    turn = seen[:, :3, :3] @ np.swapaxes(from_poses[:, :3, :3], 1, 2)
    skew = 0.5 * (turn - np.swapaxes(turn, 1, 2))
    angles = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], 1)
    return np.hstack([seen[:, :3, 3] - from_poses[:, :3, 3], angles])
