"""Which of many poses an arm reaches within its limits, fast enough to be shown live.

Each target starts damped Newton runs from the nearest entries of a table of random configurations within the
limits.
"""

from weakref import WeakKeyDictionary

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import cKDTree

from workbench.arm.inverse.damped_newton import ROTATION_WEIGHT, Task, refine
from workbench.arm.inverse.reduced_arm import ReducedArm, compile_arm
from workbench.arm.inverse.solutions import random_starts
from workbench.arm.inverse.solve import check_poses
from workbench.arm.robot import Robot

TABLE_SIZE = 20_000
"""Number of configurations in the table, per robot and task."""
NEIGHBOUR_PASSES = ((0, 1), (1, 4), (4, 12))
"""Number of neighbours from which unsolved targets are tried, in successive passes."""
NEWTON_STEPS = 25
"""Newton steps per try; after these the next neighbour is tried."""

_TABLES: WeakKeyDictionary[Robot, dict[Task, tuple[np.ndarray, cKDTree]]] = WeakKeyDictionary()


def reachable(
    robot: Robot, poses: Float[np.ndarray, "rows 4 4"], *, task: Task | None = None
) -> tuple[Bool[np.ndarray, " rows"], Float[np.ndarray, "rows n"]]:
    """Whether each pose is reached within the limits, and one way to reach it.

    Args:
        poses: Tool poses in the measuring frame [m].
        task: Which part of them must be met; by default as much as the number of joints allows.

    Returns:
        A mask, which misses a few reachable poses in a thousand, and joint coordinates [rad or m], NaN where
        not reached.
    """
    arm, task = compile_arm(robot), task or Task.default(robot.dof)
    targets = check_poses(poses)
    x = np.full((len(targets), arm.dof), np.nan)
    table, tree = _table(robot, arm, task)
    _, near = tree.query(_features(targets, arm, task), k=NEIGHBOUR_PASSES[-1][1])
    for first, last in NEIGHBOUR_PASSES:
        _try(arm, targets, x, table[near[:, first:last]], task)
    return ~np.isnan(x[:, 0]), x


def _table(robot: Robot, arm: ReducedArm, task: Task) -> tuple[np.ndarray, cKDTree]:
    tables = _TABLES.setdefault(robot, {})
    if task not in tables:
        x = random_starts(arm, (TABLE_SIZE,), np.random.default_rng(0), limits=arm.limits)
        tables[task] = x, cKDTree(_features(arm.geometry(x)[0], arm, task))
    return tables[task]


def _features(poses: np.ndarray, arm: ReducedArm, task: Task) -> np.ndarray:
    """Features whose distance measures how far apart two poses are."""
    scale = ROTATION_WEIGHT * arm.length
    parts = [poses[:, :3, 3]]
    if task is not Task.POSITION:
        parts.append(scale * poses[:, :3, 2])
    if task is Task.POSE:
        parts.append(scale * poses[:, :3, 0])
    return np.concatenate(parts, 1)


def _try(arm: ReducedArm, targets: np.ndarray, x: np.ndarray, starts: np.ndarray, task: Task) -> None:
    """Run the starts (rows, k, n) of the unsolved targets within the limits, and keep those that converge."""
    rows = np.flatnonzero(np.isnan(x[:, 0]))
    k = starts.shape[1]
    r = refine(
        arm,
        targets,
        starts[rows].reshape(-1, arm.dof),
        task=task,
        target_of=np.repeat(rows, k),
        limits=arm.limits,
        iterations=NEWTON_STEPS,
    )
    good = r.converged.reshape(-1, k)
    hit = good.any(1)
    x[rows[hit]] = r.q.reshape(-1, k, arm.dof)[hit, good[hit].argmax(1)]
