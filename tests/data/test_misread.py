"""Measurements that are plausible by themselves, and impossible for the arm."""

from dataclasses import replace

import numpy as np
import pytest

from workbench import Dataset, Motion, tool_poses
from workbench.base import se3
from workbench.identification.rows.row_selection import hold_out_share

NOTE = "orientation from the quaternion qw, qx, qy, qz"


@pytest.fixture(scope="module")
def rows(aria):
    """Rows of an arm that stands somewhere, with another tool."""
    rng = np.random.default_rng(2)
    q = rng.uniform(*aria.limits.T, (30, aria.dof))
    there, tool = (
        se3.pose(se3.rpy_to_matrix(rng.uniform(-1, 1, 3)), rng.uniform(-1, 1, 3)) for _ in range(2)
    )
    poses = there @ tool_poses(aria, Motion(q)) @ tool
    return Dataset(
        q=q,
        row=np.arange(30),
        position=poses[:, :3, 3],
        rotation=poses[:, :3, :3],
        source="rows",
        notes=(NOTE,),
    )


def test_copies_of_a_row_are_held_out_together(rows):
    data = replace(rows.take(np.tile(np.arange(15), 3)), row=np.arange(45))
    train, held = hold_out_share(data, 0.2, rng=np.random.default_rng(0))
    assert len(held) == 9
    assert not {i % 15 for i in train} & {i % 15 for i in held}
