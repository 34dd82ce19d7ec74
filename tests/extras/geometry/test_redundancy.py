"""Redundant constants: their number by the formula of complete models, and what they say by moving them."""

import numpy as np
import pytest
from studies.katana_printed import CONSTANTS

from workbench.arm.built_in_arms import load_robot
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base import se3
from workbench.extras.geometry.redundant_constants import complete, redundancy


def poses(robot, rows=40):
    return np.random.default_rng(3).uniform(*robot.search_limits.T, (rows, robot.dof))


@pytest.mark.parametrize("name", ["aria", "ur5", "panda", "katana450"])
def test_a_complete_model_keeps_four_a_joint_and_six(name):
    robot = load_robot(name)
    found = redundancy(robot, frames=True)
    assert found.rank == complete(robot) == 4 * robot.dof + 6
    assert len(found.combinations) == len(found.redundant) == len(found.names) - found.rank
    assert set(found.independent) | set(found.redundant) == set(found.names)


@pytest.mark.parametrize("name", ["katana450", "katana450-three-rotation"])
@pytest.mark.parametrize("points", [False, True])
def test_a_combination_moves_no_tool(name, points):
    """A step of 1e-5 along each changes the tool's pose (or place) by its square at most."""
    robot = load_robot(name)
    q = poses(robot)
    for combination in redundancy(robot, points=points).combinations:
        values = robot.values(combination.names) + 1e-5 * np.array(combination.weights)
        moved = robot.with_values(dict(zip(combination.names, values.tolist(), strict=True)))
        change = se3.pose_error(tool_poses(moved, Motion(q)), tool_poses(robot, Motion(q)))
        assert np.abs(change[:, : 3 if points else 6]).max() < 3e-8


def test_what_is_removed_is_absorbed_by_what_stays():
    """Central differences of the tool's pose: a redundant constant's column is a mix of the kept ones'."""
    robot = load_robot("katana450-three-rotation")
    q, found = poses(robot), redundancy(load_robot("katana450-three-rotation"))

    def column(name):
        value = float(robot.values((name,))[0])
        ends = [tool_poses(robot.with_values({name: value + h}), Motion(q)) for h in (1e-5, -1e-5)]
        return (se3.pose_error(*ends) / 2e-5).ravel()

    kept = np.column_stack([column(name) for name in found.independent])
    assert np.linalg.matrix_rank(kept, tol=1e-6) == found.rank
    for name in found.redundant:
        mix = np.linalg.lstsq(kept, column(name), rcond=None)[0]
        assert np.abs(kept @ mix - column(name)).max() < 1e-6


def test_the_thesis_forms():
    """β4 turns about joint 5's own axis; under points β5 turns about a line through the tool point. The
    three-rotation form keeps axes 3 and 4 parallel, so it lacks two of the 26 of a complete model."""
    craig, three = load_robot("katana450"), load_robot("katana450-three-rotation")
    assert redundancy(craig, CONSTANTS).rank == 17
    assert redundancy(craig, CONSTANTS, points=True).rank == 16
    found = redundancy(three, three.default_free)
    assert (found.rank, len(found.names)) == (11, 12)
    assert set(found.combinations[0].names) == {"joint4.beta", "joint5.theta"}
    seen = redundancy(three, three.default_free, points=True)
    assert seen.rank == 10
    assert ("joint5.beta",) in {c.names for c in seen.combinations}
    assert redundancy(three, frames=True).rank == complete(three) - 2
