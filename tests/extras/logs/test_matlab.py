"""MATLAB files: matrices as the option names them; those that would crash or fill all memory are refused."""

import io
import re
import struct
import zlib

import numpy as np
import pytest
from refusals import refuses
from scipy.io import savemat
from slow import slow

from tests.binary_files import refusal
from tests.data.test_forms import ROTATED
from workbench.base.errors import FileError, OptionError
from workbench.data import binary_tables
from workbench.data.readers import read_measurements, read_trajectory
from workbench.extras.logs.matlab import matlab_arrays, read_arrays

HEADER = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H2s", 0x100, b"IM")
CRASHING = HEADER + struct.pack(  # the array's name is of a type that no name has
    "<16I72x", 14, 528, 6, 8, 6, 0, 5, 8, 10, 6, 0x10001, 1, 0, 0, 9, 72
)


def packed(content: bytes) -> bytes:
    """A compressed variable."""
    small = zlib.compress(content)
    return struct.pack("<2I", 15, len(small)) + small


def save_mat(path, **variables):
    savemat(path, variables)
    return path


def test_matlab_pages_labels_and_vectors(read_here, tmp_path):
    poses = np.repeat(np.eye(4)[:, :, None], 5, axis=2)
    poses[:3, :3, 1], poses[:3, 3, 1] = ROTATED, [1, 2, 3]
    names = np.array([["a"], ["a"], ["b"], ["b"], ["b"]], dtype=object)
    file = save_mat(tmp_path / "t.mat", Q=np.arange(10.0).reshape(5, 2), T=poses, s=names, t=np.arange(5.0))
    data = read_measurements(file, columns="q[deg|row]=Q, pose[mm]=T, session=s, time[s]=t")
    np.testing.assert_allclose(data.rotation[1], ROTATED)
    assert data.position[1].tolist() == [0.001, 0.002, 0.003]
    assert data.sessions == ("a", "b")
    assert data.time.tolist() == [0, 1, 2, 3, 4]


def test_matlab_square_or_open_matrices_ask_for_row_or_column(read_here, tmp_path):
    file = save_mat(tmp_path / "t.mat", Q=np.zeros((3, 3)), P=np.zeros((3, 3)))
    with refuses(OptionError, option="columns", found="P"):
        read_measurements(file, columns="q[deg|row]=Q, xyz[mm]=P")
    with refuses(OptionError, option="columns", found="Q"):
        read_measurements(file, columns="q[deg]=Q, xyz[mm|row]=P")


@pytest.mark.parametrize(("joints", "points"), [((20, 6), (20, 3)), ((6, 240), (240, 3)), ((6, 5), (3, 5))])
def test_matlab_shapes_that_leave_no_doubt(read_here, tmp_path, joints, points):
    file = save_mat(tmp_path / "t.mat", q=np.zeros(joints), mA=np.ones(points), mB=np.ones(points))
    data = read_measurements(file, columns="q[rad]=q, m1[m]=mA, m2[m]=mB")
    assert data.q.shape == (max(points), 6)
    assert data.markers.shape == (max(points), 2, 3)
    turned = np.ones(points if (joints[0] == 6) == (points[0] == 3) else points[::-1])
    save_mat(tmp_path / "s.mat", data={"joints_deg": np.zeros(joints), "position_mm": turned})
    alone = read_measurements(tmp_path / "s.mat")  # names that say it, as in an .npz
    assert alone.q.shape == data.q.shape
    assert (alone.position == 1e-3).all()


def test_matlab_matrices_that_do_not_fit(read_here, tmp_path):
    file = save_mat(tmp_path / "t.mat", Q=np.zeros((4, 2)), P=np.zeros((5, 3)))
    with refuses(OptionError, "'Q'", "4 measurements", "5 of"):
        read_measurements(file, columns="q[deg|row]=Q, xyz[mm]=P")
    save_mat(tmp_path / "v.mat", Q=np.zeros((4, 2)), Y=np.arange(12.0))  # x, y, z of row by row
    stacked = read_measurements(tmp_path / "v.mat", columns="q[deg|row]=Q, xyz[m]=Y")
    assert stacked.position.tolist() == np.arange(12.0).reshape(4, 3).tolist()
    save_mat(tmp_path / "v.mat", Q=np.zeros((8, 2)) + np.arange(8)[:, None], P=np.arange(72.0).reshape(24, 3))
    markers = read_measurements(
        tmp_path / "v.mat", columns="q[deg]=Q, xyz[m]=P"
    ).markers  # three points a posture
    assert markers.tolist() == np.arange(72.0).reshape(8, 3, 3).tolist()
    for bad in ("q[deg|row]=Z", "q[deg|row]=Q,foo[mm]=P", "q1[deg],q2[deg]"):
        with pytest.raises(OptionError):
            read_measurements(file, columns=bad)


def test_a_trajectory_in_a_matlab_file(read_here, tmp_path):
    file = save_mat(tmp_path / "t.mat", t=np.arange(4.0), Q=np.arange(12.0).reshape(4, 3))
    columns = "time[s]=t, q[deg|row]=Q"
    found = read_trajectory(file, columns=columns)
    np.testing.assert_allclose(np.rad2deg(found.q), np.arange(12.0).reshape(4, 3))
    assert found.time.tolist() == [0, 1, 2, 3]
    with refuses(OptionError, "t.mat", "sheet 'A'"):
        read_trajectory(file, columns=columns, sheet="A")


def deep(depth: int) -> bytes:
    """Cells in cells."""
    content = struct.pack("<2I", 14, 0)
    for _ in range(depth):
        content = struct.pack("<12I", 14, 40 + len(content), 6, 8, 1, 0, 5, 8, 1, 1, 1, 0) + content
    return HEADER + content


def sound() -> bytes:
    """A variable of every class."""
    from scipy.sparse import csc_array

    cells, file = np.array([[1.0, "two"], [np.eye(2), 4]], dtype=object), io.BytesIO()
    structs = {"inner": {"d": np.eye(2)}, "text": "some text"}
    savemat(
        file, {"Q": np.ones((3, 2)), "z": np.full(2, 1j), "c": cells, "s": structs, "p": csc_array(np.eye(3))}
    )
    return file.getvalue()


def huge() -> bytes:
    file = io.BytesIO()
    savemat(file, {"Q": np.zeros((2000, 2000))}, do_compression=True)
    assert len(file.getvalue()) < 50_000
    return file.getvalue()


HOSTILE = {
    "crashing": (lambda: CRASHING, "MATLAB"),
    "packed": (lambda: HEADER + packed(CRASHING[len(HEADER) :]), "MATLAB"),
    "cut": (lambda: sound()[:-300], "MATLAB"),
    "deep": (lambda: deep(3000), "MATLAB"),
    "hollow": (lambda: deep(20), "there are no matrices|which matrix"),
    "bomb": (huge, "MiB of memory"),
}


@pytest.mark.parametrize("name", [slow(name) if name == "deep" else name for name in HOSTILE])
def test_a_hostile_matlab_file_costs_one_sentence(name, tmp_path, monkeypatch):
    content, text = HOSTILE[name]
    if name == "bomb":
        monkeypatch.setattr(binary_tables, "BASE_MEMORY", 16 * 2**20)
    (path := tmp_path / "hostile.mat").write_bytes(content())
    assert re.search(text, str(refusal(path)))


def test_variables_of_every_class_are_read_and_none_that_is_changed_does_more_harm(tmp_path):
    """A sample of files of which one byte is other; what crashes the reader ends its process only."""
    assert set(matlab_arrays(sound())) >= {"Q", "z", "c", "s.inner.d"}
    rng, path, refused = np.random.default_rng(1), tmp_path / "changed.mat", 0
    for place in rng.integers(128, len(sound()), 3):
        changed = bytearray(sound())
        changed[place] = rng.integers(256)
        try:
            read_arrays(bytes(changed), path)
        except FileError:
            refused += 1
    assert refused > 0


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("wam_matrices.mat", "q[rad|column]=Q,xyz[mm|column]=P"),
        ("wam_matrices.mat", "Q[column]=q1[rad],…,q7[rad],P[column]=x[mm],y[mm],z[mm]"),
        ("wam_matrices.mat", "Q[rad|column]=q; P[mm|column]=xyz"),
        ("wam_struct.mat", "q[deg|row]=data.joints_deg, xyz[m|row]=data.position_m"),
    ],
)
def test_matlab(read_here, shared_data, name, columns):
    converted = read_measurements(shared_data / "wam_jacobi" / "measurements.csv")
    data = read_measurements(shared_data / "importer_variants" / name, columns=columns, joints=7)
    np.testing.assert_allclose(data.q, converted.q[-20:], atol=2e-10)
    np.testing.assert_allclose(data.position, converted.position[-20:], atol=1e-7)
