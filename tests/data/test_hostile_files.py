"""Small files that would crash the program or take all of its memory and time: one sentence each."""

import io
import os
import re
import signal
import struct
import tracemalloc
import zipfile
import zlib

import numpy as np
import openpyxl
import pytest

from workbench.base.bounded_process import ChildError, in_child
from workbench.base.errors import FileError, WorkbenchError
from workbench.base.progress import Cancelled, running
from workbench.data import binary_tables
from workbench.data.readers import preview, read_measurements

HEADER = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H2s", 0x100, b"IM")
CRASHING = HEADER + struct.pack(  # the array's name is of a type that no name has
    "<16I72x", 14, 528, 6, 8, 6, 0, 5, 8, 10, 6, 0x10001, 1, 0, 0, 9, 72
)


def workbook(**cells: float | str) -> bytes:
    """A workbook with some cells of one sheet."""
    book = openpyxl.Workbook()
    for place, value in cells.items():
        book.active[place] = value
    file = io.BytesIO()
    book.save(file)
    return file.getvalue()


def changed(content: bytes, old: bytes, new: bytes) -> bytes:
    """A workbook whose sheet has other bytes in some place."""
    file = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old_file, zipfile.ZipFile(file, "w", 8) as new_file:
        for name in old_file.namelist():
            data = old_file.read(name)
            new_file.writestr(name, data.replace(old, new) if "sheet1" in name else data)
    return file.getvalue()


def refusal(tmp_path, name: str, content: bytes) -> str:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(FileError) as caught:
        read_measurements(path)
    assert preview(path).problems == (str(caught.value),)
    assert len(str(caught.value)) <= 300
    return str(caught.value)


@pytest.mark.parametrize("packed", [False, True])
def test_a_matlab_file_that_would_crash_its_reader(tmp_path, packed):
    from scipy.io import savemat

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
    from scipy.io import savemat
    from scipy.sparse import csc_array

    cells, file = np.array([[1.0, "two"], [np.eye(2), 4]], dtype=object), io.BytesIO()
    structs = {"inner": {"d": np.eye(2)}, "text": "some text"}
    savemat(
        file, {"Q": np.ones((3, 2)), "z": np.full(2, 1j), "c": cells, "s": structs, "p": csc_array(np.eye(3))}
    )
    sound, rng, refused = file.getvalue(), np.random.default_rng(1), 0
    assert set(binary_tables.matlab_arrays(_packed(sound) if packed else sound)) >= {
        "Q",
        "z",
        "c",
        "s.inner.d",
    }
    for place in rng.integers(128, len(sound), 600):
        changed = bytearray(sound)
        changed[place] = rng.integers(256)
        try:
            binary_tables.matlab_arrays(_packed(bytes(changed)) if packed else bytes(changed))
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
    from scipy.io import savemat

    file = io.BytesIO()
    savemat(file, {"Q": np.zeros((2000, 2000))}, do_compression=True)
    assert len(file.getvalue()) < 50_000
    monkeypatch.setattr(binary_tables, "BASE_MEMORY", 16 * 2**20)
    assert "MiB of memory" in refusal(tmp_path, "bomb.mat", file.getvalue())


def test_the_command_says_which_variable_is_damaged(run, tmp_path):
    (tmp_path / "crash.mat").write_bytes(CRASHING)
    status, _, err = run("identify", "crash.mat", "--robot", "aria")
    assert status == 1
    assert "variable 1, at byte 128, is damaged" in err
    assert err.count("\n") == 1
    assert len(err.strip()) <= 300


def test_a_row_of_a_number_that_no_sheet_has(tmp_path):
    content = changed(workbook(A1="q1[deg]", A2=1), b'r="2"', b'r="2000000000"')
    assert "more than 1048576 rows" in refusal(tmp_path, "far.xlsx", content)


def test_a_row_that_reaches_beyond_all_columns(tmp_path):
    assert "beyond column 1000" in refusal(tmp_path, "wide.xlsx", workbook(A1="q1[deg]", A2=1, XFD2=1))


def test_a_cell_that_unpacks_to_megabytes(tmp_path):
    content = changed(workbook(A1="q1[deg]", A2=1), b"q1[deg]", b"q" * 8_000_000)
    assert len(content) < 50_000
    assert re.search("unpacks to 8 MiB; the limit is 4", refusal(tmp_path, "cell.xlsx", content))


def test_a_joint_of_a_number_beyond_all_counting(tmp_path):
    text = b"q1[deg],q2[deg],q3000000000[deg],x[mm],y[mm],z[mm]\n1,2,3,4,5,6\n"
    tracemalloc.start()
    try:
        assert "joint 3" in refusal(tmp_path, "far.csv", text.replace(b"3000000000", b"300000000"))
        assert tracemalloc.get_traced_memory()[1] < 1e8  # a name for each would take gigabytes
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("digits", ["1" * 5000, "\u0661", "01"])
def test_numbers_of_joints_in_other_digits(tmp_path, digits):
    path = tmp_path / "digits.csv"
    path.write_text(f"q{digits}[rad],q2[rad],x[m],y[m],z[m]\n0,0,1,1,1\n")
    if digits == "01":
        assert read_measurements(path).joints == 2
    else:
        with pytest.raises(FileError, match="q1"):
            read_measurements(path)


def test_reading_can_be_cancelled(tmp_path):
    path = tmp_path / "rows.xlsx"
    path.write_bytes(workbook(A1="q1[deg]", A2=1))
    with pytest.raises(Cancelled), running(cancel=lambda: True):
        read_measurements(path)


def test_a_long_value_is_cut_in_the_sentence(tmp_path):
    text = b"q1[rad],x[m],y[m],z[m]\n" + b"w" * 5000 + b",1,2,3\n0,1,2,3\n"
    assert len(refusal(tmp_path, "long.csv", text)) < 300


def test_a_child_is_bounded_in_time():
    with pytest.raises(ChildError, match=r"0\.2 s"):
        in_child(_spin, seconds=0.2)


def test_a_child_that_crashes_says_so():
    with pytest.raises(ChildError, match="crashes"):
        in_child(_crash)


def _crash() -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


def _spin() -> None:
    while True:
        pass
