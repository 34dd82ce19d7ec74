"""Arms that bend: laws of effects, statics and poses of their own, in plain numpy on the generator's arms.

The laws are written anew from the words of the catalogue. A joint turns by a small rotation vector right
before its drive, in the axes there; lengths may grow, and the measuring frame may creep. Moments are those
that hold the links at rest, taken on the arm as it is bent: the bent arm is found by rounds.

Effects that the catalogue does not hold have names of their own: `dent`, `kinked gear`, `dragging hose`
(all of one joint's angle) and `wobbling mount` (of the moment at the mount).
"""

from dataclasses import dataclass, fields, replace

import numpy as np
from generator import VirtualArm, four, rotation

ROUNDS = 10
"""Most rounds of the bent arm; each brings three digits, half of one where moments flip play."""
SAME = 1e-15
"""Change of every angle [rad] at which further rounds change nothing."""
WARM = 20.0
"""Temperature at which lengths are as given [degC]."""
TURN = 2.0 * np.pi


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
    turned = _angle(effect, state) + arm.table[joint, 0]
    c, s = np.cos(turned), np.sin(turned)
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
    away = np.abs((_angle(effect, state) - middle + np.pi) % TURN - np.pi)
    return _about(effect, state, np.where(away < width, 0.5 + 0.5 * np.cos(np.pi * away / width), 0.0))


def _kinked(effect, arm, state, held):
    """Straight pieces between evenly spaced teeth of a turn; shape = the first one's place, then heights."""
    first, *heights = effect.shape
    places = np.arange(len(heights) + 1) * TURN / len(heights)
    turned = (_angle(effect, state) - first) % TURN
    return _about(effect, state, np.interp(turned, places, [*heights, heights[0]]))


def _hose(effect, arm, state, held):
    """Hoses that wind about a joint pull it: slack between two angles, taut at once beyond; shape = these."""
    low, high = effect.shape
    q = _angle(effect, state)
    pull = np.where(q > high, 1.0 - np.exp(high - q), 0.0) - np.where(q < low, 1.0 - np.exp(q - low), 0.0)
    return _about(effect, state, -pull)


def _mount(effect, arm, state, held):
    """The mount sticks until the moment that tips it exceeds shape[0] [N m], then gives way to the rest."""
    across = held[:, 0, :2]
    moment = np.linalg.norm(across, axis=1, keepdims=True)
    return _across(effect, state, -effect.size[0] * across * np.maximum(1.0 - effect.shape[0] / moment, 0.0))


BY_MOMENT = {
    "joint-compliance": _compliance,
    "backlash": _backlash,
    "clearance-tilt": _clearance,
    "bearing-compliance": _bearing,
    "link-flexure": _flexure,
    "wobbling mount": _mount,
}
BY_STATE = {
    "joint-harmonic": _harmonic,
    "encoder-scale": _scale,
    "joint-coupling": _coupling,
    "dent": _dent,
    "kinked gear": _kinked,
    "dragging hose": _hose,
}
WHOLE = ("thermal-growth", "base-drift")
NAMELESS = ("dent", "kinked gear", "dragging hose", "wobbling mount")


def pieces(arm: VirtualArm, q, growth):
    """Per joint: transforms before, of, and after its drive at angles q, with lengths by growth (rows,)."""
    return [[_grown(part, growth) for part in parts] for parts in arm.parts(q)]


def frames(joints, bend):
    """Transforms (joints, rows, 4, 4) to right before each drive, and to each link, in the arm's first frame.

    Args:
        joints: The arm's `pieces`, with revolute joints.
        bend: Rotation vectors (rows, n, 3) right before each drive.
    """
    here = np.broadcast_to(np.eye(4), (len(bend), 4, 4))
    tilts = four(rotation(bend))
    before, links = [], []
    for i, (fixed, driven, after) in enumerate(joints):
        here = here @ fixed
        before.append(here)
        here = here @ tilts[:, i] @ driven @ after
        links.append(here)
    return np.array(before), np.array(links)


def holding(arm: VirtualArm, before, links, state):
    """Moments (rows, n, 3) that hold the later links against weight, about each drive, in the axes there.

    Every link's weight acts at its centre of mass, payload and wrench at the tool; all in the first frame.
    """
    payload = state.payload
    outside = np.zeros((len(payload), 6)) if state.wrench is None else state.wrench
    places = np.einsum("jrab,jb->jra", links[:, :, :3, :3], arm.coms) + links[:, :, :3, 3]
    tool = links[-1, :, :3, :3] @ arm.tool[:3, 3] + links[-1, :, :3, 3]
    pull = arm.masses[:, None, None] * arm.gravity * np.ones_like(places)
    pull, places = (
        np.concatenate([pull, (payload[:, None] * arm.gravity + outside[:, :3])[None]]),
        np.concatenate([places, tool[None]]),
    )
    turning = np.cross(places, pull)
    out = []
    for i, frame in enumerate(before):
        weight, moment = pull[i:].sum(0), turning[i:].sum(0)
        load = moment + outside[:, 3:] - np.cross(frame[:, :3, 3], weight)
        out.append(-np.einsum("rba,rb->ra", frame[:, :3, :3], load))
    return np.stack(out, 1)


def straight(arm: VirtualArm, state: State):
    """Transforms as `frames` of the arm that nothing bends."""
    return frames(pieces(arm, state.q, np.ones(len(state.q))), np.zeros((*state.q.shape, 3)))


def straight_moments(arm: VirtualArm, state: State):
    """Moments as `holding` of the arm that nothing bends."""
    return holding(arm, *straight(arm, state), state)


def bent_links(arm: VirtualArm, effects, state: State):
    """Transforms (joints, rows, 4, 4) to each link of the bent arm in its first frame, and growth (rows,)."""
    growth = 1.0 + sum(e.size[0] * (state.temperature - WARM) for e in effects if e.name == "thermal-growth")
    growth = growth * np.ones(len(state.q))
    joints, bend = pieces(arm, state.q, growth), np.zeros((*state.q.shape, 3))
    by_moment = any(e.name in BY_MOMENT for e in effects)
    for _ in range(ROUNDS if by_moment else 1):
        held, last = holding(arm, *frames(joints, bend), state) if by_moment else None, bend
        bend = sum((turns(arm, e, state, held) for e in effects), np.zeros_like(bend))
        if np.abs(bend - last).max(initial=0.0) < SAME:
            break
    return frames(joints, bend)[1], growth


def poses(arm: VirtualArm, effects, state: State):
    """Poses (rows, 4, 4) of the tool in the measuring frame."""
    links, growth = bent_links(arm, effects, state)
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
