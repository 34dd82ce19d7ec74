"""Checks that our tests and those of outsiders share: poses and derivatives, each against another way.

    check_forward(robot, q)                                  poses against pinocchio
    check_jacobian(function, jacobian, x)                    a Jacobian against central differences
    check_jacobian(poses, twists, x, difference=pose_change) the same where the values are poses

Each returns the largest deviation that it saw, and raises AssertionError with the place when it is too large.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.metadata import distribution
from pathlib import Path

import numpy as np
import pytest
from generator import NAMES
from jaxtyping import Float
from rigid_body import rigid_body

from workbench import Motion, Robot, tool_poses
from workbench.arm.chain import NO_SHIFT
from workbench.arm.robot_toml import read_toml
from workbench.arm.statics.wrenches import TrialArm, motion_wrenches, own_axis
from workbench.base import se3
from workbench.base.types import Freedom, JointRows

DESCRIPTIONS = Path(str(distribution("example-robot-data").locate_file("cmeel.prefix/share")))
DESCRIPTIONS = DESCRIPTIONS.resolve() / "example-robot-data" / "robots"
"""URDF files of real arms."""
STEP = 6e-6
"""Step of a central difference, about the cube root of the machine precision, in units of the argument."""


def check_forward(robot: Robot, q: JointRows, *, tolerance: float = 1e-12) -> float:
    """Compare the chain's tool poses with pinocchio's.

    Args:
        robot: Geometry with base and tool; masses are not needed.
        q: Joint positions [rad or m].
        tolerance: Greatest deviation of an entry of a pose [m or 1].
    """
    worst = np.abs(tool_poses(robot, Motion(q)) - rigid_body(robot, massless=True).poses(q)).max(axis=(1, 2))
    row = int(np.argmax(worst))
    if not worst[row] <= tolerance:
        error = f"pose differs from pinocchio's by {worst[row]:.3g}, more than {tolerance:g}"
        raise AssertionError(f"robot '{robot.name}', row {row}: {error}")
    return float(worst[row])


def robot_of(arm, folder: Path, **options) -> Robot:
    """The package's robot for the generator's arm, through a file; options are those of `VirtualArm.toml`."""
    (folder / "arm.toml").write_text(arm.toml(**options))
    return read_toml(folder / "arm.toml")


def dh_table(robot: Robot) -> np.ndarray:
    """Rows theta, d, a, alpha, beta of an arm of such constants."""
    table = np.zeros((robot.dof, 5))
    for element in robot.elements:
        joint, part = element.name.split(".")
        table[int(joint[5:]) - 1, NAMES.index(part)] = element.value
    return table


def freed(robot: Robot, freedom: Freedom) -> Robot:
    """The arm whose base and tool are as free as that."""
    return robot.with_frames(base=replace(robot.base, free=freedom), tool=replace(robot.tool, free=freedom))


def any_joints(robot: Robot, rows: int, seed: int = 0) -> JointRows:
    """Joint positions anywhere within the limits [rad or m]."""
    return np.random.default_rng(seed).uniform(*robot.search_limits.T, (rows, robot.dof))


def with_errors(robot: Robot, errors: np.ndarray, names: tuple[str, ...] = ()) -> Robot:
    """The arm whose free constants, or these, are off by so much."""
    return with_numbers(robot, names := names or robot.default_free, robot.values(names) + errors)


def with_numbers(robot: Robot, names: Sequence[str], values: np.ndarray) -> Robot:
    """The arm with these values of constants and coefficients."""
    return robot.with_values(dict(zip(names, np.asarray(values).tolist(), strict=True)))


pose_change = se3.pose_error
"""Difference of poses on the tangent space: [Δp; rotation vector], base axes, as twists are."""


def check_jacobian(
    function: Callable[[np.ndarray], np.ndarray],
    jacobian: np.ndarray,
    x: Float[np.ndarray, " p"],
    *,
    difference: Callable[[np.ndarray, np.ndarray], np.ndarray] = np.subtract,
    step: float = STEP,
    tolerance: float = 1e-7,
) -> float:
    """Compare a Jacobian with central differences, column by column.

    Args:
        function: Values of any shape at x.
        jacobian: Its derivative at x, the last axis counting the entries of x.
        x: Where to differentiate.
        difference: How two values are subtracted; `pose_change` for poses.
        step: Half of the distance between the two values.
        tolerance: Greatest deviation of an entry, relative to the largest one of its column (or to a
            thousandth of the largest of all, for columns that vanish).
    """
    columns = []
    for shift in step * np.eye(len(x)):
        ahead, behind = x + shift, x - shift
        columns.append(difference(function(ahead), function(behind)) / np.sum(ahead - behind))
    numerical = np.stack(columns, -1)
    if numerical.shape != np.shape(jacobian):
        raise AssertionError(f"the Jacobian's shape is {np.shape(jacobian)}, not {numerical.shape}")
    rows = tuple(range(numerical.ndim - 1))
    largest = np.abs(numerical).max(axis=rows)
    scale = np.maximum(largest, 1e-3 * largest.max(initial=0.0))
    error = np.abs(jacobian - numerical).max(axis=rows) / np.where(scale > 0.0, scale, 1.0)
    column = int(np.argmax(error))
    if not np.all(error <= tolerance):
        raise AssertionError(
            f"column {column} of the Jacobian is off by {error[column]:.3g} of its size > {tolerance:g}"
        )
    return float(error[column])


def joint_wrenches(robot: Robot, q: JointRows, *, values=None, shift=NO_SHIFT, **rows):
    """`motion_wrenches` of joint positions; further rows, such as payload or wrench, as `Motion` has them."""
    chain = robot.chain if values is None else robot.chain.with_values(values)
    arm = TrialArm(robot, chain, robot.effects)
    return motion_wrenches(arm, Motion(q, **rows), shift=shift)


def holding(wrenches, robot):
    """Torque or force of every drive [N m or N], (rows, n), from the wrenches (rows, n, 6)."""
    return wrenches[:, np.arange(robot.dof), own_axis(robot)]


def check_problem(problem, rng):
    """Every column of a problem's Jacobian against central differences, and the gradient of its cost."""
    x = problem.start + rng.normal(0.0, 1e-2, len(problem.start))
    residual, jacobian = problem.evaluate(x)
    check_jacobian(lambda x: -problem.residual(x), jacobian, x, step=1e-5)
    cost, gradient = problem.cost_and_gradient(x)
    assert cost == pytest.approx(0.5 * residual @ residual, rel=1e-12)
    np.testing.assert_allclose(gradient, -jacobian.T @ residual, rtol=0, atol=1e-12 * np.abs(gradient).max())
