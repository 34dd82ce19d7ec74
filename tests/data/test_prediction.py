from dataclasses import replace

import numpy as np
import pytest

from workbench import Dataset, Frame, Motion, tool_poses
from workbench.arm.effects import EFFECTS
from workbench.base import se3
from workbench.data.prediction import predict, row_components
from workbench.identification.errors.row_errors import row_errors


def test_components_are_measured_minus_predicted_along_the_axes(aria):
    q = np.random.default_rng(1).uniform(-1.0, 1.0, (5, 6))
    shift, turn = np.array([1e-3, -2e-3, 3e-3]), np.array([1.0, 2.0, -0.5])
    poses = tool_poses(aria, Motion(q))
    rotation = se3.rotvec_to_matrix(turn) @ poses[:, :3, :3]
    found = row_components(aria, Dataset(q=q, position=poses[:, :3, 3] + shift, rotation=rotation))
    assert found.position == pytest.approx(np.tile(shift, (5, 1)))
    assert found.rotation == pytest.approx(np.tile(turn, (5, 1)))  # not its sine


def test_sessions_have_their_own_frames(aria):
    q = np.random.default_rng(3).uniform(-1.0, 1.0, (4, 6))
    moved = Frame(xyz=np.array([1.0, 2.0, 3.0]))
    mountings = {"a": aria.mounting, "b": replace(aria.mounting, base=moved)}
    poses = tool_poses(aria, Motion(q))
    poses[2:, :3, 3] += moved.xyz
    names = np.array(["a", "a", "b", "b"])
    data = Dataset(q=q, row=np.arange(4), position=poses[:, :3, 3], session=names)
    found = row_components(replace(aria, sessions=mountings), data)
    assert found.position == pytest.approx(np.zeros((4, 3)), abs=1e-12)
    assert np.isnan(found.rotation).all()
    assert found.has_position.all()


def test_what_drives_the_effects_is_taken_from_every_row(aria):
    """A payload bends the arm row by row; errors stand on the same prediction."""
    rng = np.random.default_rng(5)
    deflected = aria.with_effects(EFFECTS["joint-compliance"]((1,), (3e-4,)))
    q, payload = rng.uniform(-1.0, 1.0, (6, 6)), np.array([0.0, 1.0, 2.0, 0.0, 1.0, 2.0])
    poses = tool_poses(deflected, Motion(q, payload=payload))
    names = np.array(["a", "b"] * 3)
    data = Dataset(q=q, row=np.arange(6), position=poses[:, :3, 3], payload=payload, session=names)
    assert predict(deflected, data) == pytest.approx(poses, abs=1e-15)
    assert row_errors(deflected, data).position == pytest.approx(np.zeros(6), abs=1e-12)
    bare = row_errors(deflected, replace(data, payload=None)).position
    assert bare[payload == 0] == pytest.approx(0.0, abs=1e-12)
    assert (bare[payload > 0] > 1e-5).all()


def test_joined_rows_keep_every_column_of_both():
    rows = Dataset(
        q=np.zeros((2, 6)), row=np.array([3, 5]), position=np.ones((2, 3)), temperature=np.array([20.0, 30.0])
    )
    one = {"q": np.ones((1, 6)), "row": np.array([0]), "position": np.zeros((1, 3))}
    other = Dataset(**one, session=np.array(["late"]))
    both = rows.joined(other)
    assert both.row.tolist() == [3, 5, 6]
    assert both.session.tolist() == ["", "", "late"]
    assert both.temperature == pytest.approx([20.0, 30.0, np.nan], nan_ok=True)
    assert both.position[2] == pytest.approx(np.zeros(3))
