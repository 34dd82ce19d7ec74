"""Forward kinematics: where the tool and the links are, deflected by the robot's effects if it has any."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from workbench.arm import chain as chains
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import effect_columns, shift_of

BLOCK = 4096
"""Rows per block of a long computation: its Jacobian stays in the processor's cache."""


def tool_poses(robot: Robot, motion: Motion) -> Float[np.ndarray, "rows 4 4"]:
    """Poses of the tool in the measuring frame, T_b^0 T_0^n(q) T_n^e (ARIA eq. 6).

    Raises:
        ShapeError: the rows have another number of joints than the robot.
        DataError: an effect lacks what drives it, such as a temperature.
    """
    robot.check_joints(motion.q)
    return chains.poses(robot.chain, motion.q, shift=shift_of(robot, motion))


def link_frames(robot: Robot, motion: Motion) -> Float[np.ndarray, "rows frames 4 4"]:
    """Poses of the arm's first frame, of every joint entry's link frame, and of the tool.

    Args:
        robot: Geometry with L joint entries.

    Returns:
        L + 2 poses a row in the measuring frame.
    """
    robot.check_joints(motion.q)
    ends = np.array([robot.base_size - 1, *robot.chain_ends, len(robot.chain.elements) - 1])
    return chains.frames(robot.chain, motion.q, ends, shift=shift_of(robot, motion))


def sensitivity_blocks(
    robot: Robot, motion: Motion, names: tuple[str, ...], *, block: int = BLOCK
) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
    """Poses and identification Jacobians block by block, in memory that does not grow with the rows.

    Args:
        names: Constants to differentiate by, P of them.
        block: Rows per block.

    Yields:
        The rows, their poses (b, 4, 4) and their twists [v; w] per constant (b, 6, P). The arrays are
        written anew by the next block: copy what you keep.
    """
    robot.check_joints(motion.q)
    size = len(motion)
    if robot.effects:
        for start in range(0, size, block):
            rows = slice(start, min(start + block, size))
            yield (rows, *_deflected_sensitivity(robot, motion.take(rows), names))
        return
    columns = robot.chain.indices(names)
    block = min(block, max(size, 1))
    poses, twists = np.empty((block, 4, 4)), np.empty((block, 6, len(columns)))
    for start in range(0, size, block):
        rows = slice(start, min(start + block, size))
        length = rows.stop - rows.start
        out = (poses[:length], twists[:length])
        yield (rows, *chains.twists(robot.chain, motion.q[rows], columns, out=out))


def sensitivity(
    robot: Robot, motion: Motion, names: tuple[str, ...] | None = None
) -> tuple[Float[np.ndarray, "rows 4 4"], Float[np.ndarray, "rows 6 p"]]:
    """Tool poses and the identification Jacobian: the tool's twist per constant.

    Args:
        names: Constants and coefficients to differentiate by; the robot's default free constants if None.

    Returns:
        Poses, and twists [v; w] at the tool's origin in base axes (ARIA eqs. 11–13).
    """
    robot.check_joints(motion.q)
    names = robot.default_free if names is None else names
    if robot.effects:
        return _deflected_sensitivity(robot, motion, names)
    return chains.twists(robot.chain, motion.q, robot.chain.indices(names))


def geometric_jacobian(robot: Robot, q: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "rows 6 n"]:
    """Twist of the tool per joint coordinate, base axes at the tool's origin, of the geometry alone."""
    robot.check_joints(q)
    return chains.joint_twists(robot.chain, q)[1]


def _deflected_sensitivity(
    robot: Robot, motion: Motion, names: tuple[str, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Poses and twists of an arm with effects, columns in the order of the names."""
    elements = [n for n in names if n not in robot.coefficients]
    coefficients = [n for n in names if n in robot.coefficients]
    poses, twists = effect_columns(robot, motion, robot.chain.indices(elements), coefficients)
    place = {n: i for i, n in enumerate([*elements, *coefficients])}
    return poses, twists[:, :, [place[n] for n in names]]


def joint_elements(robot: Robot) -> np.ndarray:
    """Element of the full chain that each joint coordinate drives, in the order of q."""
    drivers = robot.chain.drivers
    return np.array([int(np.flatnonzero(drivers == j)[0]) for j in range(robot.dof)], np.int64)
