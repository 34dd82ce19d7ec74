"""A tool led along a curve: poses, joints in one branch, velocities and accelerations.

The tool's orientation is constant. Arms of six joints and more hold all of it. Arms of five hold the
direction of the tool's z axis, while the rotation about it is free: position and axis are five conditions. If
the arm can't hold it all the way, `LIMIT_MARGIN` from its limits and from singularities, only positions are
met and the axis stays as near as possible (`tool_direction`), with a note.

Joints between the rows follow a quintic spline that starts and ends at rest; its derivatives are the
velocities and accelerations.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.frame import Frame
from workbench.arm.inverse.branch import margins
from workbench.arm.inverse.damped_newton import Task
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.arm.inverse.solutions import task_jacobian
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.base.types import JointRows, Poses, Rotations, Vector3, frozen
from workbench.extras.trajectories.curves import Circle, Curve, smooth_shares
from workbench.extras.trajectories.path import Commanded, command_joints, command_poses
from workbench.extras.trajectories.tool_direction import follow_near_direction

DOWN = np.array([0.0, 0.0, -1.0])
"""Default tool direction for a line, and sense of a plane's normal."""
UPRIGHT = 1e-6
"""Vertical component of a normal above which it decides on which side of its plane the tool is."""
LIMIT_MARGIN = float(np.deg2rad(1.0))
"""Margin from limits reserved for corrections [rad or m]."""
MIN_SINGULAR = 0.02
"""Minimum dimensionless singular value of a path."""
MIN_CURVE_ROWS = 8
"""Minimum number of rows of a trajectory."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Planned:
    """A trajectory as an arm's controller would run it.

    Args:
        robot: The arm that it was planned for, in its own base frame.
        time: Of every row, from 0 [s].
        poses: Of the tool in the robot's base frame, as the arm takes them.
        motion: Joint positions with their time, velocities and accelerations.
    """

    robot: Robot
    time: Float[np.ndarray, " rows"]
    poses: Poses
    motion: Motion
    notes: tuple[str, ...]

    @property
    def q(self) -> JointRows:
        """Joint positions [rad or m]."""
        return self.motion.q


def plan(
    robot: Robot, curve: Curve, *, duration: float, rows: int = 200, axis: Vector3 | None = None
) -> Planned:
    """Move a tool along a curve, from rest to rest.

    Args:
        robot: The arm as its controller computes it; effects and base are ignored.
        curve: In the robot's base frame.
        duration: Time from beginning to end [s].
        rows: Number of samples, evenly in time.
        axis: Direction of the tool's z axis; into the curve's plane from above if None.
    """
    if axis is not None and not np.linalg.norm(axis) > 0.0:
        raise OptionError("the tool's axis has zero length; give a direction", option="axis")
    if not (duration > 0.0 and np.isfinite(duration)) or rows < MIN_CURVE_ROWS:
        text = f"duration must be above 0 s and rows at least {MIN_CURVE_ROWS}, got {duration:g} s and {rows}"
        raise OptionError(text, option="duration", found=duration)
    from scipy.interpolate import make_interp_spline  # not needed when the app starts

    time = np.linspace(0.0, duration, rows)
    wanted = _above(curve) if axis is None else axis / np.linalg.norm(axis)
    command = _commanded(robot, curve, wanted, time)
    poses = frozen(tool_poses(command.arms.nominal, Motion(command.q)))
    off = np.rad2deg(np.arccos(np.clip(poses[:, :3, 2] @ wanted, -1.0, 1.0)).max())
    at_rest = [(1, np.zeros(robot.dof)), (2, np.zeros(robot.dof))]
    spline = make_interp_spline(time, command.q, k=5, bc_type=(at_rest, at_rest))
    velocity, acceleration = (frozen(spline(time, order)) for order in (1, 2))
    return Planned(
        robot=command.arms.nominal,
        time=frozen(time),
        poses=poses,
        motion=Motion(command.q, time=time, velocity=velocity, acceleration=acceleration),
        notes=(*command.notes, f"the tool's z axis stays within {off:.1f}° of the requested direction"),
    )


def _commanded(robot: Robot, curve: Curve, wanted: Vector3, time: np.ndarray) -> Commanded:
    """The path with the tool's axis held, or as near as possible."""
    shares = smooth_shares(time)
    points, free = curve.points(shares), robot.with_effects().with_frames(base=Frame())
    poses = se3.pose(_orientations(curve, wanted, len(points)), points)
    try:
        exact = command_poses(free, free, poses, time=time)
        if _clear(exact):
            return exact
        raise DataError(
            f"robot '{robot.name}' comes too near to a limit or a singularity on this path; move the path"
        )
    except DataError as error:
        refused = error
    q = follow_near_direction(free, curve, shares, wanted) if robot.dof > Task.POSITION else None
    if q is None:
        command_poses(free, free, poses, positions_only=True, time=time)  # says which point is out of reach
        raise refused
    return command_joints(free, free, q, positions_only=True, time=time)


def _orientations(curve: Curve, axis: Vector3, rows: int) -> Rotations:
    """Rotations with this z axis and x near the curve's direction."""
    y = np.cross(axis, curve.along)
    if np.linalg.norm(y) < 0.1:
        y = np.linalg.svd(axis[None])[2][1]
    y = y / np.linalg.norm(y)
    return np.tile(np.column_stack([np.cross(y, axis), y, axis]), (rows, 1, 1))


def _clear(command: Commanded) -> bool:
    """Whether a path leaves margin for its correction."""
    jacobian = task_jacobian(compile_arm(command.arms.nominal), command.q, command.arms.task)
    singular = np.linalg.svd(jacobian, compute_uv=False)[:, -1]
    margin = margins(command.q, command.arms.nominal.limits).min()
    return bool(margin > LIMIT_MARGIN and singular.min() > MIN_SINGULAR)


def _above(curve: Curve) -> Vector3:
    """Straight down, or the plane's normal: downwards, or away from the base if the plane is vertical."""
    if not isinstance(curve, Circle):
        return DOWN
    normal, down = curve.normal, float(curve.normal @ DOWN)
    return normal * (-1.0 if (down if abs(down) > UPRIGHT else normal @ curve.centre) < 0.0 else 1.0)
