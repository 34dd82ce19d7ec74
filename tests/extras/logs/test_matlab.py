"""MATLAB files: matrices as the option names them; those that would crash or fill all memory are refused."""

import io
import struct
import zlib

import numpy as np
import pytest
from refusals import mentions, refuses
from scipy.io import savemat

from tests.data.test_forms import ROTATED
from tests.data.test_hostile_files import refusal
from workbench.base.bounded_process import ChildError, in_child
from workbench.base.errors import FileError, OptionError, WorkbenchError
from workbench.data import binary_tables
from workbench.data.readers import read_measurements, read_trajectory
from workbench.extras.logs.matlab_arrays import matlab_arrays
from workbench.session.commands.data import LoadData, load_endings

HEADER = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H2s", 0x100, b"IM")
CRASHING = HEADER + struct.pack(  # the array's name is of a type that no name has
    "<16I72x", 14, 528, 6, 8, 6, 0, 5, 8, 10, 6, 0x10001, 1, 0, 0, 9, 72
)


def save_mat(path, **variables):
    savemat(path, variables)
    return path


def test_matlab_pages_labels_and_vectors(tmp_path):
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


def test_matlab_matrices_that_do_not_fit(read_here, tmp_path):
    file = save_mat(tmp_path / "t.mat", Q=np.zeros((4, 2)), P=np.zeros((5, 3)))
    with refuses(FileError, "x[mm]", 5, "q1[deg]", 4):
        read_measurements(file, columns="q[deg|row]=Q, xyz[mm]=P")
    for bad in ("q[deg|row]=Z", "q[deg|row]=Q,foo[mm]=P", "q1[deg],q2[deg]"):
        with pytest.raises(OptionError):
            read_measurements(file, columns=bad)


def test_a_trajectory_in_a_matlab_file(tmp_path):
    file = save_mat(tmp_path / "t.mat", t=np.arange(4.0), Q=np.arange(12.0).reshape(4, 3))
    columns = "time[s]=t, q[deg|row]=Q"
    found = read_trajectory(file, columns=columns)
    np.testing.assert_allclose(np.rad2deg(found.q), np.arange(12.0).reshape(4, 3))
    assert found.time.tolist() == [0, 1, 2, 3]
    with refuses(OptionError, "t.mat", "sheet 'A'"):
        read_trajectory(file, columns=columns, sheet="A")


@pytest.mark.parametrize("packed", [False, True])
def test_a_matlab_file_that_would_crash_its_reader(tmp_path, packed):
    path = tmp_path / "crash.mat"
    savemat(path, {"Q": np.zeros((3, 2))})
    at, crashing = path.stat().st_size, CRASHING[len(HEADER) :]
    if packed:
        crashing = struct.pack("<2I", 15, len(zlib.compress(crashing))) + zlib.compress(crashing)
    assert f"variable 2, at byte {at}, is damaged" in refusal(
        tmp_path, "crash.mat", path.read_bytes() + crashing
    )


@pytest.mark.parametrize("packed", [False, True])
def test_matlab_variables_of_every_class_are_read_and_none_that_is_changed_crashes(packed):
    """In a process of its own, as what crashes takes it along."""
    assert in_child(_read_changed, packed, seconds=20.0, needs="scipy.io") > 100


def _read_changed(packed: bool) -> int:
    """How many of some files, each with one byte of the variables changed, are refused in words."""
    from scipy.sparse import csc_array

    cells, file = np.array([[1.0, "two"], [np.eye(2), 4]], dtype=object), io.BytesIO()
    structs = {"inner": {"d": np.eye(2)}, "text": "some text"}
    savemat(
        file, {"Q": np.ones((3, 2)), "z": np.full(2, 1j), "c": cells, "s": structs, "p": csc_array(np.eye(3))}
    )
    sound, rng, refused = file.getvalue(), np.random.default_rng(1), 0
    assert set(matlab_arrays(_packed(sound) if packed else sound)) >= {"Q", "z", "c", "s.inner.d"}
    for place in rng.integers(128, len(sound), 600):
        changed = bytearray(sound)
        changed[place] = rng.integers(256)
        try:
            matlab_arrays(_packed(bytes(changed)) if packed else bytes(changed))
        except ChildError:
            refused += 1
    return refused


def _packed(content: bytes) -> bytes:
    """A MATLAB file whose variables are compressed; sizes beyond its end are cut."""
    made, at = content[:128], 128
    while at + 8 <= len(content):
        end = at + 8 + min(struct.unpack_from("<I", content, at + 4)[0], len(content))
        small = zlib.compress(content[at:end])
        made, at = made + struct.pack("<2I", 15, len(small)) + small, end
    return made


@pytest.mark.parametrize(
    ("depth", "text"), [(20, "there are no matrices|which matrix"), (3000, "variable 1.* is damaged")]
)
def test_matlab_cells_in_cells(tmp_path, depth, text):
    content = struct.pack("<2I", 14, 0)
    for _ in range(depth):
        content = struct.pack("<12I", 14, 40 + len(content), 6, 8, 1, 0, 5, 8, 1, 1, 1, 0) + content
    path = tmp_path / "deep.mat"
    path.write_bytes(HEADER + content)
    with pytest.raises(WorkbenchError, match=text):
        read_measurements(path)


def test_a_matlab_file_that_unpacks_to_all_memory(tmp_path, monkeypatch):
    file = io.BytesIO()
    savemat(file, {"Q": np.zeros((2000, 2000))}, do_compression=True)
    assert len(file.getvalue()) < 50_000
    monkeypatch.setattr(binary_tables, "BASE_MEMORY", 16 * 2**20)
    assert "MiB of memory" in refusal(tmp_path, "bomb.mat", file.getvalue())


def test_the_command_says_which_variable_is_damaged(run, tmp_path):
    (tmp_path / "crash.mat").write_bytes(CRASHING)
    status, _, err = run("identify", "crash.mat", "--robot", "aria")
    assert status == 1
    assert mentions(err, "variable 1", "byte 128")
    assert err.count("\n") == 1
    assert len(err.strip()) <= 300


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


@pytest.mark.data
def test_matlab_says_what_it_holds(read_here, shared_data):
    with refuses(OptionError, "Q (7 x 20)", option="columns"):
        read_measurements(shared_data / "importer_variants" / "wam_matrices.mat")
    with refuses(OptionError, "'P'", option="columns", found=20):
        read_measurements(
            shared_data / "importer_variants" / "wam_matrices.mat", columns="q[rad|row]=Q,xyz[mm|row]=P"
        )


def test_a_file_whose_words_only_the_command_takes_says_where_they_go(do, tmp_path):
    """Which matrix of a MATLAB file is what, no choice of the page can say."""
    savemat(tmp_path / "a.mat", {"Q": np.zeros((20, 6)), "P": np.zeros((20, 3))})
    session = do(LoadData("a.mat", (tmp_path / "a.mat").read_bytes()))
    assert ".mat" in load_endings()
    message = session.page.messages[-1].text
    assert message.startswith(
        "a.mat: a MATLAB file doesn't state what its matrices are; it holds Q (20 x 6), P (20 x 3)"
    )
    assert "--columns" in message
    assert session.measurements.loaded is session.measurements.unread is None
