"""A folder with everything to make a plate, and the accuracy that its sheet promises."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.base.errors import OptionError
from workbench.plate.parts.export import Format, export_plate, formats_named
from workbench.plate.plate_toml import load_plate
from workbench.plate.score import score_plate


def test_every_format_is_written(tmp_path, aria):
    (tmp_path / "mine.txt").write_text("stays")
    fixture, files = export_plate(load_plate("table2"), tmp_path, formats=tuple(Format), robot=aria)
    names = {path.name for path in files}
    assert names == {
        *("plate.stl", "block-A.stl", "block-B.stl", "fixture.3mf", "plate.dxf", "holes.csv", "blocks.csv"),
        *("targets.csv", "plate.step", "block-A.step", "block-B.step", "sheet.html", "sheet.pdf"),
    }
    assert {path.name for path in tmp_path.iterdir()} == names | {"mine.txt"}
    page = (tmp_path / "sheet.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 2
    score = score_plate(aria, load_plate("table2"))
    assert f"{1e3 * score.measured.error.position_mean:.3f} mm" in page
    assert "wrist flip" in page
    assert (tmp_path / "sheet.pdf").read_bytes().count(b"/Type /Page ") == 1
    assert len(fixture.blocks) == 10


def test_nothing_is_written_where_it_can_not_be_made(tmp_path):
    plate = load_plate("table2")
    with pytest.raises(OptionError):
        export_plate(replace(plate, size=np.array([0.3, 0.3, 0.01])), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_formats_are_named():
    assert formats_named("stl, DXF") == (Format.STL, Format.DXF)
    with pytest.raises(OptionError):
        formats_named("stl,obj")
    with pytest.raises(OptionError):
        formats_named("")
