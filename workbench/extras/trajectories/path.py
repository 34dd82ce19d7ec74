"""Commanded trajectories: poses for the tool, and the joints that a controller would send.

The controller computes with the nominal geometry. Taught joints mean the poses that they have there; poses
are reached through its inverse kinematics, in one branch from beginning to end. Both arms are compared in the
robot's base frame and with the calibrated tool: a path is independent of the measuring instrument. Every
refusal gives time, row and joint.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.arm.calibrated_region import region_text
from workbench.arm.calibration_record import Expected
from workbench.arm.inverse import solve as inverse
from workbench.arm.inverse.branch import LIMIT_SLACK, margins, quality
from workbench.arm.inverse.damped_newton import Task, refine
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.arm.inverse.solutions import task_jacobian
from workbench.arm.joint_units import sliding
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.errors import DataError
from workbench.base.types import JointRows, Poses, frozen
from workbench.identification.errors.comparable_arms import ComparedArms, comparable

SINGULAR = 1e-3
"""Dimensionless singular value below which an arm is at a singularity."""
TOGETHER = 0.3
"""Minimum motion of a joint, relative to the largest one, to be part of a singularity."""
JUMP = 0.5
"""Change of a joint between two rows above which it is a jump to another branch [rad or m]."""

MET = {
    Task.POSITION_AXIS: (
        "five joints: position and direction of the tool's z axis are met, rotation about it is free"
    ),
    Task.POSITION: "only positions are met, orientations are free",
}
"""What of a pose is met, where it is not all of it."""

Times = Float[np.ndarray, " rows"] | None


@dataclass(frozen=True, eq=False, kw_only=True)
class Commanded:
    """A commanded path.

    Args:
        calibrated: Usable part of the calibrated arm, in its own base frame.
        nominal: The arm as the controller computes it, likewise.
        poses: Commanded poses of the tool, robot's base frame.
        q: Joint positions that the controller sends without correction [rad or m].
        task: Part of the poses that the number of joints can meet.
        expected: Error of the arm used, where it was measured; None if unknown.
        time: Time of every row [s], for messages; None if there is none.
    """

    calibrated: Robot
    nominal: Robot
    poses: Float[np.ndarray, "rows 4 4"]
    q: Float[np.ndarray, "rows n"]
    task: Task
    notes: tuple[str, ...]
    expected: Expected | None = None
    time: Float[np.ndarray, " rows"] | None = None


def command_joints(
    calibrated: Robot,
    nominal: Robot,
    q: Float[np.ndarray, "rows n"],
    *,
    positions_only: bool | None = None,
    time: Times = None,
) -> Commanded:
    """A path from joint positions that were planned with the nominal arm.

    Args:
        calibrated: The arm that moves.
        nominal: The arm as the controller computes it.
        q: Joint positions [rad or m].
        positions_only: Whether to ignore orientations. By default they are met as far as the calibration
            observed them, otherwise by the arm used (`usable_arm`), near nominal.
        time: Time of every row [s], for messages.
    """
    arms = comparable(calibrated, nominal, positions_only=positions_only)
    arms.nominal.check_joints(q, "trajectory")
    refuse_beyond(arms.nominal, q, time)
    return _commanded(arms, tool_poses(arms.nominal, Motion(q)), q, time, *region_text(calibrated, q))


def command_poses(
    calibrated: Robot,
    nominal: Robot,
    poses: Float[np.ndarray, "rows 4 4"],
    *,
    positions_only: bool | None = None,
    near: Float[np.ndarray, " n"] | None = None,
    time: Times = None,
) -> Commanded:
    """A path from poses in the robot's base frame.

    Args:
        calibrated: The arm that moves.
        nominal: The arm as the controller computes it.
        poses: Poses of the tool [m].
        positions_only: Whether to ignore orientations. By default they are met as far as the calibration
            observed them, otherwise by the arm used (`usable_arm`), near nominal.
        near: Joint positions near the start of the path [rad or m]; the best branch if None.
        time: Time of every row [s], for messages.
    """
    arms = comparable(calibrated, nominal, positions_only=positions_only)
    planned, task = arms.nominal, arms.task
    first = inverse.solve(planned, poses[0], task=task)
    if not first.reachable:
        raise DataError(f"{named(0, time)}: {first.reason}", row=0)
    starts = sorted(first.within_limits, key=quality, reverse=True)
    if near is not None:
        chosen = inverse.choose(first, near=near)
        starts = [] if chosen is None else [chosen]
    furthest, longest = 0, None
    for start in starts:
        q, reached = _followed(planned, poses, start.q, task)
        if reached == len(poses):
            branch = f"the path is followed in the branch '{start.name}'"
            return _commanded(arms, poses, q, time, *region_text(calibrated, q), branch)
        if reached >= furthest:
            furthest, longest = reached, q[max(reached - 1, 0)]
    why = inverse.solve(planned, poses[furthest], task=task).reason
    tight = "" if longest is None else f" ({_tightest(planned, longest)})"
    raise DataError(
        f"{named(furthest, time)} can't be reached along the path{tight}: "
        f"{why or 'the branch ends there, at a limit or a singularity'}; change the path or its start",
        row=furthest,
    )


def _commanded(arms: ComparedArms, poses: Poses, q: JointRows, time: Times, *notes: str) -> Commanded:
    met = [MET[arms.task]] if arms.task in MET else []
    return Commanded(
        calibrated=arms.calibrated,
        nominal=arms.nominal,
        poses=frozen(poses),
        q=frozen(q),
        task=arms.task,
        notes=(*arms.away, *arms.notes, *notes, *met),
        expected=arms.expected,
        time=time,
    )


def _followed(robot: Robot, poses: np.ndarray, start: np.ndarray, task: Task) -> tuple[np.ndarray, int]:
    """Joint positions row by row, and how many rows were reached."""
    arm = compile_arm(robot)
    limits = robot.limits[arm.columns]
    q, x = np.empty((len(poses), robot.dof)), start[None, arm.columns]
    for row, pose in enumerate(poses):
        step = refine(arm, pose[None], x, task=task, limits=limits)
        if not step.converged[0] or np.abs(step.x - x).max() > JUMP:
            return q, row
        x = step.x
        q[row] = x[0, arm.places]
    return q, len(poses)


def _tightest(robot: Robot, q: np.ndarray) -> str:
    gaps = margins(q[None], robot.limits)[0]
    joint = int(np.argmin(gaps))
    return f"joint {joint + 1} is {gaps[joint]:.3f} from its limit"


def named(row: int, time: Times) -> str:
    """A row for people: `row 7 of the trajectory (at 0.350 s)`; without the time if there is none."""
    return f"row {row} of the trajectory" + ("" if time is None else f" (at {time[row]:.3f} s)")


def refuse_beyond(robot: Robot, q: Float[np.ndarray, "rows n"], time: Times = None) -> None:
    """Refuse rows outside a robot's limits."""
    beyond = margins(q.reshape(-1, robot.dof), robot.limits).reshape(q.shape) < -LIMIT_SLACK
    if beyond.any():
        row, joint = (int(i) for i in np.argwhere(beyond)[0])
        low, high = robot.limits[joint]
        raise DataError(
            f"{named(row, time)} needs joint {joint + 1} at {q[row, joint]:.4f}, but its limits are "
            f"{low:.4f} and {high:.4f} (rad or m); change the path",
            row=row,
            joint=joint,
        )


def refuse_singular(robot: Robot, q: Float[np.ndarray, "rows n"], task: Task, time: Times = None) -> None:
    """Refuse singular rows, where some joints move without moving the tool."""
    arm = compile_arm(robot)
    _, s, vt = np.linalg.svd(task_jacobian(arm, q[:, arm.columns], task), full_matrices=False)
    if (singular := s[:, -1] < SINGULAR).any():
        row = int(np.argmax(singular))
        free = np.abs(vt[row, -1][arm.places])
        joints = [str(j + 1) for j in np.flatnonzero(free > TOGETHER * free.max())]
        raise DataError(
            f"{named(row, time)} is singular (smallest singular value {s[row, -1]:.1e}): joints "
            f"{' and '.join(joints)} move without moving the tool; lead the path around it",
            row=row,
        )


def refuse_fast(
    robot: Robot, speed: Float[np.ndarray, "rows n"], maximum: float | None, time: Float[np.ndarray, " rows"]
) -> None:
    """Refuse rows at which a joint moves faster than `maximum` [rad/s or m/s]; none if None."""
    if maximum is not None and (np.abs(speed) > maximum).any():
        row, joint = (int(i) for i in np.argwhere(np.abs(speed) > maximum)[0])
        unit = "m/s" if sliding(robot)[joint] else "rad/s"
        raise DataError(
            f"{named(row, time)}: joint {joint + 1} would move at {abs(speed[row, joint]):.3g} {unit}, more "
            f"than {maximum:g}; slow down there",
            row=row,
            joint=joint,
            found=float(abs(speed[row, joint])),
        )
