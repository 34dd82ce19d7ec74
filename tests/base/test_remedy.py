"""Remedies are called as they are where the user is."""

import threading

from refusals import refuses

import workbench as wb
from workbench.base.errors import FileError
from workbench.base.remedy import remedy, speak_to_page
from workbench.session.commands.data import LoadData

URDF = b'<?xml version="1.0"?><robot name="r"><link name="a"/></robot>'


def test_only_what_is_computed_for_the_page_has_its_words():
    found = []

    def page() -> None:
        speak_to_page()
        found.append(remedy("--robot", page="the Robot tab"))

    thread = threading.Thread(target=page)
    thread.start()
    thread.join()
    assert [*found, remedy("--robot", page="the Robot tab")] == ["the Robot tab", "--robot"]


def test_a_refused_file_names_what_there_is(do, tmp_path):
    """The same fault, read through both entrances."""
    (tmp_path / "arm.csv").write_bytes(URDF)
    with refuses(FileError, "--robot", path=str(tmp_path / "arm.csv")):
        wb.read_measurements(tmp_path / "arm.csv")
    warnings = do(LoadData("arm.csv", URDF)).page.messages[-1].text
    assert "--" not in warnings
    assert "Robot tab" in warnings
