"""What forbids a row of a path: a limit, a singularity, a speed. Every refusal names time, row and joint."""

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse.branch import LIMIT_SLACK, margins
from workbench.arm.inverse.damped_newton import Task
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.arm.inverse.solutions import task_jacobian
from workbench.arm.robot import JointKind, Robot
from workbench.base.errors import DataError

SINGULAR = 1e-3
"""Dimensionless singular value below which an arm is at a singularity."""
TOGETHER = 0.3
"""Joints that move by this share of the one that moves most take part in a singularity."""

Times = Float[np.ndarray, " rows"] | None


def named(row: int, time: Times) -> str:
    """A row for people: `row 7 of the trajectory (at 0.350 s)`; without the time where there is none."""
    return f"row {row} of the trajectory" + ("" if time is None else f" (at {time[row]:.3f} s)")


def refuse_beyond(robot: Robot, q: Float[np.ndarray, "rows n"], time: Times = None) -> None:
    """Refuse rows outside a robot's limits.

    Raises:
        DataError: names the first row and its joint.
    """
    beyond = margins(q.reshape(-1, robot.dof), robot.known_limits).reshape(q.shape) < -LIMIT_SLACK
    if beyond.any():
        row, joint = (int(i) for i in np.argwhere(beyond)[0])
        low, high = robot.known_limits[joint]
        raise DataError(
            f"{named(row, time)} asks for {q[row, joint]:.4f} of joint {joint + 1}, whose limits are "
            f"{low:.4f} and {high:.4f} (rad or m); change the path"
        )


def refuse_singular(robot: Robot, q: Float[np.ndarray, "rows n"], task: Task, time: Times = None) -> None:
    """Refuse rows at which some joints move without moving the tool.

    Raises:
        DataError: names the first row and these joints.
    """
    arm = compile_arm(robot)
    _, s, vt = np.linalg.svd(task_jacobian(arm, q[:, arm.columns], task), full_matrices=False)
    if (singular := s[:, -1] < SINGULAR).any():
        row = int(np.argmax(singular))
        free = np.abs(vt[row, -1][arm.places])
        joints = [str(j + 1) for j in np.flatnonzero(free > TOGETHER * free.max())]
        raise DataError(
            f"{named(row, time)} is at a singularity, where joints {' and '.join(joints)} move without "
            f"moving the tool (smallest singular value {s[row, -1]:.1e}); lead the path around it"
        )


def refuse_fast(
    robot: Robot, speed: Float[np.ndarray, "rows n"], most: float | None, time: Float[np.ndarray, " rows"]
) -> None:
    """Refuse rows at which a joint moves faster than `most` [rad/s or m/s]; none if None.

    Raises:
        DataError: names the first row and its joint.
    """
    if most is not None and (np.abs(speed) > most).any():
        row, joint = (int(i) for i in np.argwhere(np.abs(speed) > most)[0])
        unit = "m/s" if robot.moving[joint].kind is JointKind.PRISMATIC else "rad/s"
        raise DataError(
            f"{named(row, time)}: joint {joint + 1} would move at {abs(speed[row, joint]):.3g} {unit}, more "
            f"than {most:g}; go slower there"
        )
