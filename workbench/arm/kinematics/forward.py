"""Forward kinematics: poses of the tool and the links, deflected by the robot's effects if it has any.

`at` is a `Motion`, or in a notebook n joint positions [rad or m] or rows of them, without drivers of effects.
For one pose the result has no axis of rows.

An instrument on a link observes that link's frame relative to a level one under the arm. Between the two are
the elements of the arm up to the link, without base and tool: gravity is given in the frame after the base,
so that the base rotates both.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from workbench.arm import chain as chains
from workbench.arm.chain import WHOLE
from workbench.arm.gravity import GRAVITY, level_axes
from workbench.arm.joint_units import implausible_joint
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import effect_columns, no_equilibrium, shift_of
from workbench.base import se3
from workbench.base.array_checks import numbers
from workbench.base.errors import DataError


@dataclass(frozen=True, eq=False)
class Watched:
    """Elements between two frames, and the orientation of the first of them.

    Args:
        part: Elements of the full chain.
        level: Rotation from the arm's first frame to one whose z axis points upwards; None for no rotation.
    """

    part: slice = field(default_factory=lambda: WHOLE)
    level: Float[np.ndarray, "3 3"] | None = None

    def turned(self, poses: np.ndarray, *twists: np.ndarray) -> tuple[np.ndarray, ...]:
        """Poses (rows, 4, 4) and twists (rows, 6, p) in the level axes."""
        if self.level is None:
            return poses, *twists
        both = np.kron(np.eye(2), self.level)
        return se3.pose(self.level, np.zeros(3)) @ poses, *(both @ each for each in twists)


TOOL = Watched()
"""The tool in the measuring frame, by the whole chain."""


def watched(robot: Robot, link: int | None) -> Watched:
    """The observed part for a moving link, counted from 1; for the base with 0, for the tool with None."""
    if link is None:
        return TOOL
    moving = [i for i, joint in enumerate(robot.joints) if joint.kind != "fixed"]
    if not 0 <= link <= len(moving):
        raise DataError(
            f"the data have tilts of link {link}, and robot '{robot.name}' has links 1 to {len(moving)}, and "
            "0 for its base; correct the number in the columns tilt_x, tilt_y",
            column=f"tilt_x{link}",
        )
    end = robot.chain_ends[moving[link - 1]] if link else robot.base_size - 1
    return Watched(slice(robot.base_size, end + 1), level_axes(robot.gravity))


def watched_poses(robot: Robot, motion: Motion, link: int | None) -> Float[np.ndarray, "rows 4 4"]:
    """Poses of the observed frame of a link of the deflected arm; of the tool in the measuring frame for
    None."""
    robot.check_joints(motion.q)
    view = watched(robot, link)
    poses = chains.poses(robot.chain, motion.q, shift=shift_of(robot, motion), part=view.part)
    return view.turned(poses)[0]


def tool_poses(robot: Robot, at: ArrayLike | Motion) -> Float[np.ndarray, "*rows 4 4"]:
    """Poses of the tool in the measuring frame, T_b^0 T_0^n(q) T_n^e (ARIA eq. 6).

    Raises:
        ShapeError: another number of joint positions than the robot has joints.
        OptionError: joint positions that are not numbers.
        DataError: an effect of the robot lacks its driver, such as temperature; or positions far beyond a
            joint's limits, which indicate another unit.
    """
    motion, one = _rows(robot, at)
    poses = chains.poses(robot.chain, motion.q, shift=shift_of(robot, motion))
    return poses[0] if one else poses


def link_frames(robot: Robot, at: ArrayLike | Motion) -> Float[np.ndarray, "*rows frames 4 4"]:
    """Poses of the arm's first frame, of each joint entry's link frame, and of the tool; measuring frame."""
    motion, one = _rows(robot, at)
    ends = np.array([robot.base_size - 1, *robot.chain_ends, len(robot.chain.elements) - 1])
    frames = chains.frames(robot.chain, motion.q, ends, shift=shift_of(robot, motion))
    return frames[0] if one else frames


def identification_jacobian(
    robot: Robot, at: ArrayLike | Motion, names: tuple[str, ...] | None = None
) -> tuple[Float[np.ndarray, "*rows 4 4"], Float[np.ndarray, "*rows 6 p"]]:
    """Tool poses and the identification Jacobian: the tool's twist per constant.

    Of many rows ask for a thousand at a time (`Motion.take`): their Jacobian stays in the processor's cache.

    Args:
        names: Constants to differentiate by, of an arm with effects also coefficients, masses (`inertia`) and
            angles of `GRAVITY`; the robot's default free constants if None.

    Returns:
        Poses, and twists [v; w] at the tool's origin in base axes (ARIA eqs. 11–13).
    """
    motion, one = _rows(robot, at)
    names = robot.default_free if names is None else names
    if robot.effects:
        poses, twists = _deflected_jacobian(robot, motion, names)
    else:
        poses, twists = chains.twists(robot.chain, motion.q, robot.chain.indices(names))
    return (poses[0], twists[0]) if one else (poses, twists)


def geometric_jacobian(robot: Robot, q: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "rows 6 n"]:
    """Twist of the tool per joint coordinate, base axes at the tool's origin, from the geometry alone."""
    robot.check_joints(q)
    return chains.joint_twists(robot.chain, q)[1]


def _deflected_jacobian(
    robot: Robot, motion: Motion, names: tuple[str, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Poses and twists of an arm with effects, columns in the order of the names."""
    loads, coefficients = [*robot.inertia, *GRAVITY], [n for n in names if n in robot.coefficients]
    heavy = [n for n in names if n in loads]
    elements = [n for n in names if n not in {*coefficients, *heavy}]
    columns, varying = robot.chain.indices(elements), np.array([loads.index(n) for n in heavy], np.int64)
    poses, twists = effect_columns(robot, motion, columns, coefficients, varying=varying)
    if np.isnan(poses).any():
        raise no_equilibrium(robot, poses)
    place = {n: i for i, n in enumerate(names)}
    out = np.zeros((len(motion), 6, len(names)))
    own, more = (np.array([place[n] for n in group], np.int64) for group in (elements + heavy, coefficients))
    twists.add_derivatives(np.tile(np.eye(6), (len(motion), 1, 1)), out.reshape(-1, len(names)), own, more)
    return poses, out


def _rows(robot: Robot, at: ArrayLike | Motion) -> tuple[Motion, bool]:
    """Rows of motion, and whether they were a single pose without an axis of rows."""
    if isinstance(at, Motion):
        robot.check_joints(at.q)
        return at, False
    q = numbers(at, "joint positions [rad or m]")
    one, q = q.ndim < 2, np.atleast_2d(q)
    robot.check_joints(q)
    if (found := implausible_joint(q, robot.limits)) is not None:
        joint, unit, bound = found
        looks = f": these look like {unit}; give {'m' if unit == 'mm' else 'radians'}" if unit else ""
        largest = np.nanmax(np.abs(q[:, joint]))
        raise DataError(
            f"joint {joint + 1} of robot '{robot.name}' would be at {largest:.4g}, where its limit is "
            f"{bound:.4g}{looks}",
            joint=joint,
            found=largest,
        )
    return Motion(q), one
