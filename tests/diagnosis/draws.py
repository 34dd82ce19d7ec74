"""What hides in an arm, drawn at random: effects of given names, in joints and of sizes that are drawn.

The size of an effect is its greatest displacement of the tool over the measured poses, drawn evenly from
`PEAKS`, as long as no joint has to turn by more than `LARGEST` for it nor to be softer than `SOFTEST`: worn
but real arms, with errors of ten times the noise and more. Thermal growth is that of steel to plastics; the
measuring frame creeps as on a tripod that somebody brushed against and that settles.
"""

import laws
import numpy as np
from laws import TURN, TURNING, WHOLE, Effect, change, poses, straight_moments, turned, turns

USUAL = 0.5, 2.0
PEAKS = dict.fromkeys(laws.NAMELESS, (0.6, 2.0)) | dict.fromkeys(("backlash", "clearance-tilt"), (0.4, 1.2))
PEAKS["joint-harmonic"] = 0.4, 1.5
"""Least and greatest size [mm], where it is not the usual one."""
LARGEST = 4e-3
"""Greatest angle by which an effect turns a joint [rad]."""
SOFTEST = 2e-3
"""Greatest compliance of a joint, a bearing, a link or a mount [rad/(N m)]."""
FEEBLE = 0.05
"""Moment that friction holds [N m]: a joint or bearing whose moments are not mostly greater has no flanks."""
GROWTH = (15e-6, 60e-6)
"""Thermal growth [1/K]."""
CREEP, TWIST = (0.3e-3, 0.8e-3), (0.1e-3, 0.4e-3)
"""How far the measuring frame creeps in an hour [m], and turns [rad]."""
HOUR = 3600.0
TEETH = 6
"""Corners of a kinked gear error a turn."""
PROPORTIONAL = {*laws.BY_MOMENT} - {"backlash", "clearance-tilt"}
RIPPLE = 13, 20
"""Least and greatest order of a gear's ripple."""


def draw(name, arm, state, rng, *, detail=None, joint=None):
    """An effect of this name; None where the joint that was drawn can't show one."""
    if name in WHOLE:
        return _whole(name, rng)
    joint = int(rng.integers(arm.dof)) if joint is None else joint
    if name in TURNING and arm.sliding[joint]:
        return None
    detail = int(rng.integers(RIPPLE[0], RIPPLE[1] + 1)) if detail == "ripple" else detail
    template = SHAPES.get(name, _plain)(name, joint, arm, state, rng)
    return sized(Effect(**({"name": name, "joints": (joint,), "detail": detail} | template)), arm, state, rng)


def sized(effect, arm, state, rng):
    """The effect at a size drawn from `PEAKS`; None if nothing drives it."""
    peak = 1e-3 * rng.uniform(*PEAKS.get(effect.name, USUAL))
    held = straight_moments(arm, state)
    largest = np.abs(turns(arm, effect, state, held)).max()
    if largest < 1e-12 or _feeble(effect, held):
        return None
    trial = effect.scaled(1e-5 / largest)
    moved = change(poses(arm, [trial], state), poses(arm, [], state))
    factor = min(peak / np.linalg.norm(moved[:, :3], axis=1).max(), LARGEST / 1e-5)
    if effect.name in PROPORTIONAL:
        factor = min(factor, SOFTEST / max(np.abs(trial.size)))
    return trial.scaled(factor)


def steady(arm, effects, state):
    """Rows (rows,) in which no play hangs between its flanks, where friction would decide."""
    held, out = straight_moments(arm, state), np.ones(len(state.q), bool)
    for effect in effects:
        deciding = _deciding(effect, held)
        out &= True if deciding is None else deciding >= FEEBLE
    return out


def _feeble(effect, held):
    """Whether the moments that decide on a flank are mostly too small to do so."""
    deciding = _deciding(effect, held)
    return deciding is not None and bool(np.median(deciding) < FEEBLE)


def _deciding(effect, held):
    """Size (rows,) of the moment that decides on a flank; None where none does."""
    if effect.name == "clearance-tilt":
        return np.linalg.norm(held[:, effect.joints[0], :2], axis=1)
    if effect.name == "backlash" and effect.detail == "moment":
        return np.abs(held[:, effect.joints[0], 2])
    return None


def _whole(name, rng):
    if name == "thermal-growth":
        return Effect(name, (), (float(rng.uniform(*GROWTH)),))
    parts = [rng.uniform(*size) * direction(rng) for size in (CREEP, TWIST)]
    return Effect(name, (), tuple((np.concatenate(parts) / HOUR).tolist()))


def direction(rng):
    """A unit vector."""
    v = rng.standard_normal(3)
    return v / np.linalg.norm(v)


def _plain(name, joint, arm, state, rng):
    return {}


def _signed(name, joint, arm, state, rng):
    return {"size": (float(rng.choice([-1.0, 1.0])),)}


def _coupled(name, joint, arm, state, rng):
    neighbour = int(rng.choice([j for j in (joint - 1, joint + 1) if 0 <= j < arm.dof]))
    return {"joints": (joint, neighbour)} | _signed(name, joint, arm, state, rng)


def _phased(name, joint, arm, state, rng):
    phase = rng.uniform(0.0, TURN)
    return {"size": (float(np.cos(phase)), float(np.sin(phase)))}


def _flexible(name, joint, arm, state, rng):
    return {"size": tuple(rng.uniform(0.3, 1.0, 2).tolist())}


def _dent(name, joint, arm, state, rng):
    low, high = np.quantile(turned(arm, joint, state.q), [0.2, 0.8])
    shape = (float(rng.uniform(low, high)), float(rng.uniform(0.5, 1.0)))
    return {"shape": shape} | _signed(name, joint, arm, state, rng)


def _kinked(name, joint, arm, state, rng):
    heights = rng.uniform(-1.0, 1.0, TEETH)
    return {"shape": (float(rng.uniform(0.0, TURN)), *(heights - heights.mean()).tolist())}


def _hose(name, joint, arm, state, rng):
    """Slack over the middle third of the joint's range or so."""
    q = turned(arm, joint, state.q)
    low, high = np.quantile(q, [rng.uniform(0.2, 0.45), rng.uniform(0.55, 0.8)])
    return {"shape": (float(low), float(high))}


def _mount(name, joint, arm, state, rng):
    """Stuck in a third of the poses or so; always beneath the first joint."""
    moment = np.linalg.norm(straight_moments(arm, state)[:, 0, :2], axis=1)
    return {"joints": (0,), "shape": (float(np.quantile(moment, rng.uniform(0.3, 0.5))),)}


def _hardening(name, joint, arm, state, rng):
    """Half as soft at a fifth of the greatest load or so; never where nothing loads it."""
    load = np.abs(straight_moments(arm, state)[:, joint, 2]).max()
    return {"shape": (float(max(load, FEEBLE) * rng.uniform(0.1, 0.3)),)}


def _belt(name, joint, arm, state, rng):
    low, high = state.q[:, joint].min(), state.q[:, joint].max()
    return {"shape": (float(low - 0.05 * (high - low)), float(high + 0.05 * (high - low)))}


SHAPES = {
    "encoder-scale": _signed,
    "joint-coupling": _coupled,
    "joint-harmonic": _phased,
    "link-flexure": _flexible,
    "dent": _dent,
    "kinked gear": _kinked,
    "dragging hose": _hose,
    "wobbling mount": _mount,
    "hardening drive": _hardening,
    "belt stretch": _belt,
    "wind-up": _signed,
}
