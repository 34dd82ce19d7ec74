"""Markers on the tool and the base: the motion-capture set-up of ARIA 5.1."""

import numpy as np
import pytest
from refusals import refuses

from workbench.base import se3
from workbench.base.errors import DataError, FileError
from workbench.data.dataset import Dataset
from workbench.data.observations.markers import marker_poses, synchronise
from workbench.data.readers.read import read_marker_rows

LAYOUT = np.array([[0.06, 0, 0], [0, 0.05, 0], [-0.05, 0, 0.01], [0, -0.06, 0.02]])


def seen(rng, rows=6, noise=0.0):
    poses = se3.pose(se3.rotvec_to_matrix(rng.normal(0.0, 1.0, (rows, 3))), rng.normal(0.0, 0.5, (rows, 3)))
    markers = se3.apply(poses[:, None], LAYOUT[None]) + noise * rng.standard_normal((rows, 4, 3))
    return poses, Dataset(q=np.zeros((rows, 6)), row=np.arange(rows), markers=markers)


def test_frames_from_markers_are_exact_without_noise():
    poses, data = seen(np.random.default_rng(0))
    found, residual = marker_poses(data, LAYOUT)
    np.testing.assert_allclose(se3.pose(found.rotation, found.position), poses, atol=1e-12)
    assert residual.max() < 1e-12
    assert found.markers is None


def test_residual_of_the_rigid_fit_shows_the_noise_and_is_said():
    rng = np.random.default_rng(1)
    _, data = seen(rng, rows=2000, noise=1e-4)
    found, residual = marker_poses(data, LAYOUT)
    # 12 numbers, 6 of them used by the pose: rms distance of a marker is sqrt(3 · 6/12) sigma
    assert np.sqrt((residual**2).mean()) == pytest.approx(np.sqrt(1.5) * 1e-4, rel=0.03)
    assert "rms residual" in found.notes[-1]


def test_hidden_markers_are_passed_over_while_three_are_left():
    poses, data = seen(np.random.default_rng(2))
    markers = data.markers.copy()
    markers[2, 1] = np.nan
    found, _ = marker_poses(Dataset(q=data.q, row=data.row, markers=markers), LAYOUT)
    np.testing.assert_allclose(found.position, poses[:, :3, 3], atol=1e-12)
    markers[4, :2] = np.nan
    with refuses(DataError, row=4, found=2):
        marker_poses(Dataset(q=data.q, row=data.row, markers=markers), LAYOUT)
    with refuses(DataError, row=0, found=4):  # on one line they make no frame
        marker_poses(data, np.outer(np.arange(4), [0.02, 0.0, 0.0]))


def test_motion_capture_and_base_frame_are_synchronised():
    rng = np.random.default_rng(4)
    poses, _ = seen(rng)
    base = se3.pose(se3.rotvec_to_matrix(np.array([0.2, -1.0, 0.5])), np.array([3.0, -1.0, 0.4]))
    designed = np.array([[0.1, 0.1, 0], [-0.1, 0.1, 0], [-0.1, -0.1, 0], [0.1, -0.1, 0.01]])
    places, turns = (base @ poses)[:, :3, 3], (base @ poses)[:, :3, :3]
    data = Dataset(q=np.zeros((6, 6)), row=np.arange(6), position=places, rotation=turns)
    found, residual = synchronise(data, se3.apply(base[None], designed), designed)
    np.testing.assert_allclose(found.position, poses[:, :3, 3], atol=1e-12)
    np.testing.assert_allclose(found.rotation, poses[:, :3, :3], atol=1e-12)
    assert residual < 1e-12


def test_marker_files(tmp_path):
    file = tmp_path / "tool.csv"
    names = [f"m{k}{axis}[mm]" for k in (1, 2, 3, 4) for axis in "xyz"]
    file.write_text(",".join(names) + "\n" + ",".join(repr(float(1e3 * v)) for v in LAYOUT.ravel()) + "\n")
    np.testing.assert_allclose(read_marker_rows(file, 1)[0], LAYOUT, atol=1e-15)
    with refuses(FileError, "1 rows", path=str(file)):
        read_marker_rows(file, 2)
    file.write_text("m1x[mm],m1y[mm],m1z[mm]\n1,2,3\n")
    with refuses(FileError, "three markers", path=str(file)):
        read_marker_rows(file, 1)
