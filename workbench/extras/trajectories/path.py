"""Commanded trajectories: poses for the tool, and the joints that a controller would send.

The controller computes with the nominal geometry. Taught joints mean the poses that they have there; poses
are reached through its inverse kinematics, in one branch from beginning to end. Both arms are compared in the
robot's base frame and with the calibrated tool: a path is independent of the measuring instrument. Every
refusal gives time, row and joint.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from jaxtyping import Float

from workbench.arm.calibrated_region import region_text
from workbench.arm.calibration_record import Expected
from workbench.arm.frame import Frame
from workbench.arm.inverse import solve as inverse
from workbench.arm.inverse.branch import LIMIT_SLACK, quality
from workbench.arm.inverse.damped_newton import Task, refine
from workbench.arm.inverse.reduced_arm import ReducedArm, compile_arm
from workbench.arm.joint_units import shown_joints, shown_units
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.usable_arm import away_text, expected_error, usable_arm
from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.base.types import JointRows, Poses, frozen
from workbench.identification.checks.arm_match import require_same_arm

JUMP = 0.5
"""Change of a joint between two rows above which it is a jump to another branch [rad or m]."""
MAX_POSES = 1000
"""Poses of a path with those between its rows, by which rows that are far apart are reached."""

MET = {
    Task.POSITION_AXIS: (
        "five joints: position and direction of the tool's z axis are met, rotation about it is free"
    ),
    Task.POSITION: "only positions are met, orientations are free",
}
NEAR = "positions are met, orientations as nearly as the other joints can"
"""What of a pose is met, where it is not all of it."""

Times = Float[np.ndarray, " rows"] | None


@dataclass(frozen=True, eq=False, kw_only=True)
class Commanded:
    """A commanded path.

    Args:
        calibrated: Usable part of the calibrated arm, without the instrument's drift.
        nominal: The arm as the controller computes it, with the calibrated tool; both in the robot's base.
        task: Part of a pose that the number of joints can meet and the calibration observed.
        expected: Error of the calibrated arm where it was measured; None if unknown.
        is_turned: Whether orientations are met as nearly as positions leave them to the arm.
        poses: Commanded poses of the tool, robot's base frame.
        q: Joint positions that the controller sends without correction [rad or m].
        time: Time of every row [s], for messages; None if there is none.
    """

    calibrated: Robot
    nominal: Robot
    task: Task
    expected: Expected | None
    is_turned: bool
    poses: Float[np.ndarray, "rows 4 4"]
    q: Float[np.ndarray, "rows n"]
    notes: tuple[str, ...]
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
    begun = _compared(calibrated, nominal, positions_only)
    begun.nominal.check_joints(q, "trajectory")
    refuse_beyond(begun.nominal, q, time)
    return _along(begun, tool_poses(begun.nominal, Motion(q)), q, time, *region_text(calibrated, q))


def command_poses(
    calibrated: Robot,
    nominal: Robot,
    poses: Float[np.ndarray, "rows 4 4"],
    *,
    positions_only: bool | None = None,
    time: Times = None,
) -> Commanded:
    """A path from poses of the tool [m] in the robot's base frame, in the best branch that goes all the way;
    arguments as `command_joints`."""
    begun = _compared(calibrated, nominal, positions_only)
    q, branch = _in_best_branch(begun.nominal, poses, begun.task)
    place = ", ".join(f"{1e3 * value:.4g}" for value in calibrated.tool.xyz)
    tool = f"the poses are those of the calibrated robot's [tool], at {place} mm in its flange"
    if (row := len(q)) == len(poses):
        followed_in = f"the path is followed in the branch '{branch}'"
        return _along(begun, poses, q, time, *region_text(calibrated, q), followed_in, tool)
    why = inverse.solve(begun.nominal, poses[row], task=begun.task).reason
    if row and why is None:
        why = f"no branch leads there, '{branch}' comes nearest, which ends at a limit or a singularity"
    own = nominal.with_frames(base=Frame())
    if len(_in_best_branch(own, poses, begun.task)[0]) == len(poses):
        why = "it can with the nominal robot's own [tool]; if planned so, give the calibrated robot that one"
    raise DataError(f"{named(row, time)} can't be reached along the path: {why}; {tool}", row=row)


def _in_best_branch(robot: Robot, poses: Poses, task: Task) -> tuple[JointRows, str]:
    """Joints along poses in the best branch that goes farthest, as far as it does, and its name."""
    best, name = np.zeros((0, robot.dof)), ""
    starts = sorted(inverse.solve(robot, poses[0], task=task).within_limits, key=quality, reverse=True)
    arm, limits = compile_arm(robot), robot.limits
    for times, start in product(dict.fromkeys((1, max(1, MAX_POSES // len(poses)))), starts):
        path = poses if times == 1 else _denser(poses, times)
        q = followed(arm, path, start.q, task=task, limits=limits, jump=JUMP)[::times]
        if len(q) > len(best):
            best, name = q, start.name
        if len(q) == len(poses):
            break
    return best, name


def _compared(calibrated: Robot, nominal: Robot, positions_only: bool | None) -> Commanded:
    """Both arms, and no path yet."""
    usable, place = usable_arm(calibrated), bool(positions_only)
    require_same_arm(usable.robot, nominal)
    if positions_only is False and not usable.sees_rotation:
        why = f"orientations of '{calibrated.name}' can't be corrected ({'; '.join(usable.notes)})"
        remedies = "measure orientations too, or correct positions alone"
        raise OptionError(f"{why}; {remedies}", option="positions_only")
    notes = [*away_text("arm used", calibrated, usable.left, len(usable.q)), *usable.notes]
    ignored = "is ignored: it moves the measuring frame, not the arm"
    notes += [f"{e.name} {ignored}" for e in calibrated.effects if not e.moves_arm]
    if not place and not usable.sees_rotation:
        why = "no measured orientation confirms it"
        notes.append(f"orientations of the path are met by the model only: {why}")
    arm = usable.robot.with_effects(*(e for e in calibrated.effects if e.moves_arm))
    return Commanded(
        calibrated=arm.with_frames(base=Frame()),
        nominal=nominal.with_frames(base=Frame(), tool=arm.tool),
        task=Task.POSITION if place else Task.default(nominal.dof),
        expected=expected_error(calibrated, usable.left),
        is_turned=not place and Task.default(nominal.dof) is Task.POSITION,
        poses=np.zeros((0, 4, 4)),
        q=np.zeros((0, nominal.dof)),
        notes=tuple(notes),
    )


def _along(begun: Commanded, poses: Poses, q: JointRows, time: Times, *notes: str) -> Commanded:
    met = NEAR if begun.is_turned else MET.get(begun.task)
    notes = (*begun.notes, *notes, *([met] if met else ()))
    if begun.task is Task.POSITION and not begun.is_turned:  # the rest is as the controller has it
        poses = se3.pose(tool_poses(begun.nominal, Motion(q))[:, :3, :3], poses[:, :3, 3])
    return replace(begun, poses=frozen(poses), q=frozen(q), notes=notes, time=time)


def followed(
    arm: ReducedArm,
    poses: Poses,
    start: Float[np.ndarray, " m"],
    *,
    task: Task,
    limits: Float[np.ndarray, "m 2"],
    jump: float = np.inf,
) -> Float[np.ndarray, "rows m"]:
    """Joints of a reduced arm row by row, each from the one before, as far as the rows are reached.

    Args:
        jump: Change of a joint above which a row counts as not reached [rad or m].
    """
    rows, x = [], start[None]
    for pose in poses:
        step = refine(arm, pose[None], x, task=task, limits=limits)
        if not step.converged[0] or np.abs(step.q - x).max() > jump:
            break
        x = step.q
        rows.append(x[0])
    return np.array(rows).reshape(-1, len(start))


def _denser(poses: Poses, times: int) -> Poses:
    """So many poses for each one, those between two on the straight way from one to the other."""
    turn = se3.matrix_to_rotvec(poses[1:, :3, :3] @ np.swapaxes(poses[:-1, :3, :3], 1, 2))
    share, way = np.arange(times)[:, None] / times, np.diff(poses[:, :3, 3], axis=0)
    turned = se3.rotvec_to_matrix(share * turn[:, None]) @ poses[:-1, None, :3, :3]
    between = se3.pose(turned, poses[:-1, None, :3, 3] + share * way[:, None])
    return np.concatenate([between.reshape(-1, 4, 4), poses[-1:]])


def named(row: int, time: Times) -> str:
    """A row for people: `row 7 of the trajectory (at 0.350 s)`; without the time if there is none."""
    return f"row {row} of the trajectory" + ("" if time is None else f" (at {time[row]:.3f} s)")


def refuse(wrong: np.ndarray, time: Times, why: Callable[..., str]) -> None:
    """Refuse a path with wrong rows, or joints of rows, by the first of them.

    Args:
        wrong: Which rows are, or which joints of which rows.
        time: Time of every row [s], for the message.
        why: The end of the message, for a row, or a row and a joint.
    """
    if wrong.any():
        row, *joint = (int(i) for i in np.argwhere(wrong)[0])
        raise DataError(f"{named(row, time)}{why(row, *joint)}", row=row, joint=joint[0] if joint else None)


def refuse_beyond(robot: Robot, q: Float[np.ndarray, "rows n"], time: Times = None) -> None:
    """Refuse rows outside a robot's limits."""
    (low, high), shown, unit = shown_joints(robot, robot.limits.T), shown_joints(robot, q), shown_units(robot)
    refuse(
        (q < robot.limits[:, 0] - LIMIT_SLACK) | (q > robot.limits[:, 1] + LIMIT_SLACK),
        time,
        lambda row, joint: (
            f" needs joint {joint + 1} at {shown[row, joint]:.5g}{unit[joint]}, but its limits are "
            f"{low[joint]:.5g} and {high[joint]:.5g}{unit[joint]}; change the path"
        ),
    )
