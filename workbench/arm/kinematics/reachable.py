"""Which of many poses an arm reaches within its limits, fast enough to be shown live."""

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.inverse.damped_newton import Task, refine
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.arm.inverse.solutions import nearby_starts
from workbench.arm.inverse.solve import check_poses
from workbench.arm.robot import Robot

NEIGHBOUR_PASSES = ((0, 1), (1, 4), (4, 12))
"""Numbers of neighbours in the table from which unsolved targets are tried, in successive passes."""
NEWTON_STEPS = 25
"""Newton steps per try; after these the next neighbour is tried."""


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
    near = nearby_starts(arm, targets, task, NEIGHBOUR_PASSES[-1][1], is_limited=True)
    for first, last in NEIGHBOUR_PASSES:
        rows, k = np.flatnonzero(np.isnan(x[:, 0])), last - first
        found = refine(
            arm,
            targets,
            near[rows, first:last].reshape(-1, arm.dof),
            task=task,
            target_of=np.repeat(rows, k),
            limits=arm.limits,
            iterations=NEWTON_STEPS,
        )
        good = found.converged.reshape(-1, k)
        hit = good.any(1)
        x[rows[hit]] = found.q.reshape(-1, k, arm.dof)[hit, good[hit].argmax(1)]
    return ~np.isnan(x[:, 0]), x
