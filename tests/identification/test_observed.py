"""What rows show of the tool: by their channels, and by how well they leave it known."""

import numpy as np
import pytest
import round_trip as trip
from checks import robot_of
from generator import three_parallel

import workbench as wb
from workbench import Dataset, Frame, Motion, tool_poses
from workbench.base.types import Freedom

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
        (
            {"position": lambda t, n: t[:, :3, 3] + 1e2 * n, "rotation": lambda t, n: t[:, :3, :3]},
            (3, 3),
            True,
        ),
        ({"markers": lambda t, n: (t[:, None] @ TWO)[..., :3, 0] + n[:, None]}, (3, 2), False),
        ({"markers": lambda t, n: (t[:, None] @ THREE)[..., :3, 0] + n[:, None]}, (3, 3), True),
    ],
    ids=["point", "pose", "pose by coarse positions", "two markers", "three markers"],
)
def test_directions_that_no_number_depends_on_are_not_seen(columns, directions, is_whole):
    found = seen(**columns)
    assert (found.position, found.rotation) == directions
    assert found.sees_position
    assert found.sees_rotation == is_whole
    assert bool(found.missing) != is_whole


TWO = np.array([[0.05, 0.0, 0.0, 1.0], [-0.05, 0.02, 0.0, 1.0]])[:, :, None]
"""Two markers on the tool, as columns."""
THREE = np.concatenate([TWO, [[[0.01], [-0.06], [0.09], [1.0]]]])
"""A third one, not in line with them."""


def test_the_urdf_of_an_arm_with_several_reflectors_is_the_calibrated_arm(tmp_path):
    """What the last joint's zero and length are is left to the reflectors' places; all else was measured."""
    rng, nominal = np.random.default_rng(3), three_parallel()
    arm = nominal.perturbed(rng, length=1.5e-3, angle=4e-3)
    q = rng.uniform(-2.0, 2.0, (80, arm.dof))
    markers = (arm.pose(q)[:, None] @ THREE)[..., :3, 0] + rng.normal(0.0, 2e-5, (80, 3, 3))
    data = Dataset(q=q, row=np.arange(80), source="rows.csv", markers=markers)
    found = wb.identify(robot_of(nominal, tmp_path, free='"auto"'), data)
    left = {}
    for kind in ("toml", "urdf"):
        flange, _ = trip.read_arm(found.robot.save(tmp_path / f"arm.{kind}"))(trip.rows_of(q))
        left[kind] = _off_reflectors(flange, markers)
    assert left["urdf"] < 1.05 * left["toml"] < 5e-5


def _off_reflectors(flange, markers):
    """Mean distance from reflectors of the best places on the flange, on the best base [m]."""
    base = np.eye(4)
    for _ in range(200):
        seen = base @ flange
        places = np.einsum("rji,rkj->rki", seen[:, :3, :3], markers - seen[:, None, :3, 3]).mean(0)
        at = np.einsum("rij,kj->rki", flange[:, :3, :3], places) + flange[:, None, :3, 3]
        base = trip.aligned(at.reshape(-1, 3), markers.reshape(-1, 3))
    at = at @ base[:3, :3].T + base[:3, 3]
    return np.linalg.norm(at - markers, axis=2).mean()
