"""Hidden arms that follow a circle and a line: calibrated from measured poses, then corrected.

What an arm really does is computed by `tests/diagnosis/laws.py` and `tests/generator.py`, plain numpy that
shares nothing with the package: errors of manufacture in every constant, clearance and backlash that tip and
turn with the load, compliance of every loaded joint. The package gets the nominal arm and noisy poses.

    found = followed("katana", seed=3, planned=paths("katana"))
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import arms as drawn
import generator
import numpy as np
from draws import FEEBLE
from laws import WARM, Effect, State, straight_moments
from laws import poses as deflected_poses

from workbench.arm.effects import EFFECTS
from workbench.arm.inverse.damped_newton import Task
from workbench.arm.robot import Robot
from workbench.arm.robot_toml import read_toml
from workbench.data.dataset import Dataset
from workbench.extras.trajectories.correction import correct
from workbench.extras.trajectories.curves import circle_through, line
from workbench.extras.trajectories.path import command_joints
from workbench.extras.trajectories.planning import Planned, plan
from workbench.identification.identify import identify

ROWS, SIGMA = 150, (5e-5, float(np.deg2rad(0.01)))
"""Measured poses, and their noise [m, rad]."""
SIZES = {"clearance-tilt": (1e-4, 4e-4), "backlash": (2e-4, 6e-4), "joint-compliance": (1e-4, 5e-4)}
"""Least and greatest coefficients, SI."""
CURVES = {
    "katana": (
        [[0.1, -0.3, 0.139], [0, -0.371, 0.21], [-0.1, -0.3, 0.139]],
        [[0.1, -0.3, 0.1], [-0.1, -0.28, 0.1]],
    ),
    "aria": (
        [[0.45, 0.3, 0.25], [0.37, 0.38, 0.27], [0.29, 0.3, 0.25]],
        [[0.45, 0.25, 0.2], [0.3, 0.45, 0.3]],
    ),
}
"""Points of a circle, and ends of a line, in the robot's base [m]."""


@dataclass(frozen=True, eq=False)
class Followed:
    """Distances of one arm from a path [m]: as it comes, corrected in one step, iterated."""

    before: np.ndarray
    one_step: np.ndarray
    iterated: np.ndarray


def nominal(kind: str) -> Robot:
    """The arm as the package knows it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "nominal.toml"
        path.write_text(drawn.ARMS[kind]().toml(kind))
        return read_toml(path)


def paths(kind: str) -> tuple[Planned, Planned]:
    """The circle and the line as the nominal arm plans them."""
    circle, ends = CURVES[kind]
    robot = nominal(kind)
    curves = circle_through(np.array(circle)), line(*np.array(ends))
    return tuple(plan(robot, curve, duration=20.0, rows=120) for curve in curves)


def followed(kind: str, seed: int, planned: tuple[Planned, Planned]) -> tuple[Followed, Followed]:
    """One hidden arm on both paths."""
    rng = np.random.default_rng([seed, len(kind)])
    robot = nominal(kind)
    actual = drawn.ARMS[kind]().perturbed(rng, drawn.LENGTH, drawn.ANGLE)
    hidden = hide(actual, rng)
    calibrated = calibrate(robot, actual, hidden, rng)
    return tuple(_follow(calibrated, robot, actual, hidden, path) for path in planned)


def hide(actual, rng: np.random.Generator) -> tuple[Effect, ...]:
    """Tilting and compliance of every joint that carries a load; others have no flank to lie on."""
    held = np.abs(straight_moments(actual, state_of(actual.random(rng, ROWS))))
    loads = np.median(held[:, :, 2], axis=0), np.median(np.linalg.norm(held[:, :, :2], axis=2), axis=0)
    effects = []
    for name, (low, high) in SIZES.items():
        for joint in np.flatnonzero(loads[name == "clearance-tilt"] > FEEBLE).tolist():
            detail = "moment" if name == "backlash" else None
            effects.append(Effect(name, (joint,), (float(rng.uniform(low, high)),), detail))
    return tuple(effects)


def calibrate(robot: Robot, actual, hidden, rng: np.random.Generator) -> Robot:
    """Geometry and the sizes of the effects from noisy poses; the effects' names are known, nothing else."""
    q = drawn.useful(actual, actual.random(rng, 8 * ROWS))[:ROWS]
    seen = deflected_poses(actual, hidden, state_of(q))
    turned = generator.rotation(SIGMA[1] * rng.standard_normal((ROWS, 3))) @ seen[:, :3, :3]
    rows = Dataset(
        q=q,
        row=np.arange(ROWS),
        position=seen[:, :3, 3] + SIGMA[0] * rng.standard_normal((ROWS, 3)),
        rotation=turned,
    )
    model = robot.with_effects(
        *(EFFECTS[n](tuple(sorted({j for e in hidden if e.name == n for j in e.joints}))) for n in SIZES)
    )
    found = identify(model, rows, algorithms=("ols",), held_out=0.0, effects=tuple(model.coefficients))
    return found.best.calibrated


def state_of(q: np.ndarray) -> State:
    """Joints at rest in a warm hall with an empty tool."""
    still = np.zeros(len(q))
    return State(q=q, direction=np.ones(q.shape), time=still, temperature=still + WARM, payload=still)


def _follow(calibrated: Robot, robot: Robot, actual, hidden, path: Planned) -> Followed:
    wanted = (robot.base.pose @ path.poses)[:, :3, 3]
    command = command_joints(calibrated, robot, path.q, positions_only=path.task is Task.POSITION)

    def missed(q: np.ndarray) -> np.ndarray:
        return np.linalg.norm(deflected_poses(actual, hidden, state_of(q))[:, :3, 3] - wanted, axis=1)

    return Followed(missed(path.q), *(missed(correct(command, method=m).q) for m in ("one-step", "iterated")))
