"""Small files that would crash the program or take all of its memory and time: one sentence each."""

import io
import tracemalloc
import zipfile

import pytest
from binary_files import refusal, workbook
from refusals import mentions, refuses

from workbench.base import bounded_process
from workbench.base.bounded_process import ChildError, in_child
from workbench.base.progress import Cancelled, running
from workbench.data.readers import read_measurements


def changed(content: bytes, old: bytes, new: bytes) -> bytes:
    """A workbook whose sheet has other bytes in some place."""
    file = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old_file, zipfile.ZipFile(file, "w", 8) as new_file:
        for name in old_file.namelist():
            data = old_file.read(name)
            new_file.writestr(name, data.replace(old, new) if "sheet1" in name else data)
    return file.getvalue()


def test_a_row_of_a_number_that_no_sheet_has(file):
    content = changed(workbook({"Sheet": [["q1[deg]"], [1]]}), b'r="2"', b'r="2000000000"')
    assert mentions(str(refusal(file(content, "far.xlsx"))), 1048576)


def test_a_joint_of_a_number_beyond_all_counting(file):
    text = b"q1[deg],q2[deg],q3000000000[deg],x[mm],y[mm],z[mm]\n1,2,3,4,5,6\n"
    tracemalloc.start()
    said = str(refusal(file(text.replace(b"3000000000", b"300000000"), "far.csv")))
    assert tracemalloc.get_traced_memory()[1] < 1e8  # a name for each would take gigabytes
    tracemalloc.stop()
    assert mentions(said, "joint 3")


def test_reading_can_be_cancelled(tmp_path):
    path = tmp_path / "rows.xlsx"
    path.write_bytes(workbook({"Sheet": [["q1[deg]"], [1]]}))
    with pytest.raises(Cancelled), running(cancel=lambda: True):
        read_measurements(path)


def test_a_child_is_bounded_in_time():
    with refuses(ChildError, "0.2 s"):
        in_child(pow, 7, 10**8, seconds=0.2)


def test_a_child_is_told_more_than_a_pipe_holds(monkeypatch):
    monkeypatch.setattr(bounded_process, "_POLL", 1e-3)  # asked before it listens
    assert in_child(len, bytes(2**20)) == 2**20


def test_a_child_is_bounded_in_memory():
    with refuses(ChildError, "100 MiB"):
        in_child(bytearray, 10**9, memory=100 * 2**20)
