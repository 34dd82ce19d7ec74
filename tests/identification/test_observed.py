"""What rows show of the tool: by their channels, and by how well they leave it known."""

import numpy as np
import pytest

import workbench as wb
from workbench.arm.frame import Frame
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base.types import Freedom
from workbench.data.dataset import Dataset

ROWS = 80


def seen(**columns):
    """The record of a fit to rows with these columns, each made of the tool's poses."""
    rng = np.random.default_rng(2)
    tool = Frame(np.array([0.03, 0.02, 0.08]), free=Freedom.FREE)
    arm = wb.load_robot("ur5e").with_frames(tool=tool)
    q = np.array([0.2, -1.2, 1.6, -1.8, -1.4, 0.3]) + rng.uniform(-1.0, 1.0, (ROWS, 6))
    poses = tool_poses(arm, Motion(q))
    noise = rng.normal(0.0, 3e-5, (ROWS, 3))
    rows = {name: make(poses, noise) for name, make in columns.items()}
    data = Dataset(q=q, row=np.arange(ROWS), source="rows.csv", **rows)
    return wb.identify(arm, data, algorithms=("ols",)).robot.calibration.observed


@pytest.mark.parametrize(
    ("columns", "directions", "is_whole"),
    [
        ({"position": lambda t, n: t[:, :3, 3] + n}, (3, 0), False),
        ({"position": lambda t, n: t[:, :3, 3] + n, "rotation": lambda t, n: t[:, :3, :3]}, (3, 3), True),
        ({"markers": lambda t, n: (t[:, None] @ TWO)[..., :3, 0] + n[:, None]}, (3, 2), False),
    ],
    ids=["point", "pose", "two markers"],
)
def test_directions_that_no_number_depends_on_are_not_seen(columns, directions, is_whole):
    found = seen(**columns)
    assert (found.position, found.rotation) == directions
    assert found.sees_position
    assert found.sees_rotation == is_whole
    assert bool(found.missing) != is_whole


TWO = np.array([[0.05, 0.0, 0.0, 1.0], [-0.05, 0.02, 0.0, 1.0]])[:, :, None]
"""Two markers on the tool, as columns."""
