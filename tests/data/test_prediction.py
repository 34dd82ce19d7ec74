import numpy as np
import pytest

from workbench import Dataset, Motion, tool_poses
from workbench.base import se3
from workbench.data.prediction import row_components


def test_components_are_measured_minus_predicted_along_the_axes(aria):
    q = np.random.default_rng(1).uniform(-1.0, 1.0, (5, 6))
    shift, turn = np.array([1e-3, -2e-3, 3e-3]), np.array([1.0, 2.0, -0.5])
    poses = tool_poses(aria, Motion(q))
    rotation = se3.rotvec_to_matrix(turn) @ poses[:, :3, :3]
    found = row_components(aria, Dataset(q=q, position=poses[:, :3, 3] + shift, rotation=rotation))
    assert found.position == pytest.approx(np.tile(shift, (5, 1)))
    assert found.rotation == pytest.approx(np.tile(turn, (5, 1)))  # not its sine


def test_joined_rows_keep_every_column_of_both():
    two = {"q": np.zeros((2, 6)), "row": np.array([3, 5]), "position": np.ones((2, 3))}
    rows = Dataset(**two, temperature=np.array([20.0, 30.0]))
    one = {"q": np.ones((1, 6)), "row": np.array([0]), "position": np.zeros((1, 3))}
    both = rows.joined(Dataset(**one, session=np.array(["late"])))
    assert both.row.tolist() == [3, 5, 6]
    assert both.session.tolist() == ["", "", "late"]
    assert both.temperature == pytest.approx([20.0, 30.0, np.nan], nan_ok=True)
    assert both.position[2] == pytest.approx(np.zeros(3))
