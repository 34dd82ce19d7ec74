"""Kinematics as the package's root offers it: whatever a notebook has at hand is taken for joint positions.

`at` is a list or array of n joint positions [rad or m], of any number type, or rows of them. Nothing is then
known of the load, temperature or direction that may drive the arm's effects; a `Motion` says it, row by row.
One pose in gives one answer out, without the axis of rows.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from workbench.arm.joint_units import implausible_joint
from workbench.arm.kinematics import forward
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.errors import DataError, OptionError, ShapeError


def tool_poses(robot: Robot, at: ArrayLike | Motion) -> np.ndarray:
    """Pose of the tool in the measuring frame, T_b^0 T_0^n(q) T_n^e (ARIA eq. 6).

    Args:
        robot: Geometry with base and tool.
        at: Joint positions of one pose or of several [rad or m], or a `Motion`.

    Returns:
        (4, 4) at one pose, (rows, 4, 4) at several.

    Raises:
        ShapeError: another number of joint positions than the robot has joints.
        OptionError: joint positions that are not numbers.
        DataError: an effect of the robot lacks what drives it, such as a temperature; or positions three
            times beyond a joint's limits (six turns where no joint has any), which are of another unit.
    """
    motion, one = _state(robot, at)
    poses = forward.tool_poses(robot, motion)
    return poses[0] if one else poses


def link_frames(robot: Robot, at: ArrayLike | Motion) -> np.ndarray:
    """Poses of the arm's first frame, of every joint entry's link frame, and of the tool.

    Args and errors as of `tool_poses`.

    Returns:
        (frames, 4, 4) at one pose, (rows, frames, 4, 4) at several, in the measuring frame.
    """
    motion, one = _state(robot, at)
    frames = forward.link_frames(robot, motion)
    return frames[0] if one else frames


def sensitivity(
    robot: Robot, at: ArrayLike | Motion, names: tuple[str, ...] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Tool poses and the identification Jacobian: the tool's twist per constant.

    Args:
        robot: Geometry with base and tool.
        at: Joint positions of one pose or of several [rad or m], or a `Motion`.
        names: Constants and coefficients to differentiate by; the robot's default free constants if None.

    Returns:
        Poses, (4, 4) or (rows, 4, 4), and twists [v; w] at the tool's origin in base axes, (6, p) or
        (rows, 6, p) (ARIA eqs. 11–13).
    """
    motion, one = _state(robot, at)
    poses, twists = forward.sensitivity(robot, motion, names)
    return (poses[0], twists[0]) if one else (poses, twists)


def sensitivity_blocks(
    robot: Robot, at: ArrayLike | Motion, names: tuple[str, ...], *, block: int = forward.BLOCK
) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
    """`sensitivity` block by block, in memory that does not grow with the rows; one pose is one row.

    Yields:
        The rows, their poses (b, 4, 4) and their twists (b, 6, p). The arrays are written anew by the next
        block: copy what you keep.
    """
    yield from forward.sensitivity_blocks(robot, _state(robot, at)[0], names, block=block)


def _state(robot: Robot, at: ArrayLike | Motion) -> tuple[Motion, bool]:
    """Rows of motion, and whether they stand for one pose that came without an axis of rows."""
    if isinstance(at, Motion):
        robot.check_joints(at.q)
        return at, False
    try:
        q = np.asarray(at, float)
    except (TypeError, ValueError) as error:
        raise OptionError(f"joint positions must be numbers [rad or m]: {error}") from error
    if q.ndim not in (1, 2) or q.shape[-1] != robot.dof:
        found = q.shape[-1] if q.ndim else 1
        rows = "" if q.ndim < 2 else " per row" if q.ndim == 2 else f" in an array of {q.ndim} axes"
        raise ShapeError(
            f"robot '{robot.name}' has {robot.dof} joints, got {found} joint positions{rows}",
            expected=robot.dof,
            found=found,
        )
    one, q = q.ndim == 1, np.atleast_2d(q)
    if (found := implausible_joint(q, robot.limits)) is not None:
        joint, unit, bound = found
        looks = f": these look like {unit}; give {'m' if unit == 'mm' else 'radians'}" if unit else ""
        largest = np.nanmax(np.abs(q[:, joint]))
        raise DataError(
            f"joint {joint + 1} of robot '{robot.name}' would be at {largest:.4g}, where its limit is "
            f"{bound:.4g}{looks}"
        )
    return Motion(q), one
