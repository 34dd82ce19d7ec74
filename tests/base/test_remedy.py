"""Remedies are called as they are where the user is."""

from refusals import refuses

import workbench as wb
from workbench.base.errors import FileError
from workbench.session.commands.data import LoadData

URDF = b'<?xml version="1.0"?><robot name="r"><link name="a"/></robot>'


def test_a_refused_file_names_what_there_is(do, tmp_path):
    """The same fault, read through both entrances."""
    (tmp_path / "arm.csv").write_bytes(URDF)
    with refuses(FileError, "--robot", path=str(tmp_path / "arm.csv")):
        wb.read_measurements(tmp_path / "arm.csv")
    warnings = do(LoadData("arm.csv", URDF)).page.messages[-1].text
    assert "--" not in warnings
    assert "Robot tab" in warnings
