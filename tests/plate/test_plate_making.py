"""A folder with everything to make a plate, and the accuracy that its sheet promises."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from workbench.base.errors import OptionError
from workbench.plate.parts.drawing_set import pages_of
from workbench.plate.parts.export import Format, as_drawn, export_plate, formats_named
from workbench.plate.parts.fixture import fixture_of
from workbench.plate.parts.sheet import PlateSheet
from workbench.plate.parts.stock import Stock
from workbench.plate.plate_toml import load_plate
from workbench.plate.score import score_plate

PARTS = ("plate", "block-A", "block-B", "probe", "bottom", "stand-off")


def test_every_format_is_written(tmp_path, aria):
    (tmp_path / "mine.txt").write_text("stays")
    fixture, files, missing = export_plate(load_plate("table2"), tmp_path, formats=tuple(Format), robot=aria)
    names = {path.name for path in files}
    assert names == {
        *(f"{part}.{end}" for part in PARTS for end in ("stl", "dxf", "step")),
        *("fixture.3mf", "drawings.pdf", "sheet.html", "sheet.pdf", "holes.csv", "blocks.csv", "bores.csv"),
        *("targets.csv", "parts.csv", "inspection.csv"),
    }
    assert not missing
    assert {path.name for path in tmp_path.iterdir()} == names | {"mine.txt"}
    page = (tmp_path / "sheet.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 2
    drawn = as_drawn(load_plate("table2"), fixture, Stock())
    score = score_plate(aria, drawn)
    assert "made within ±0.05 mm, ±0.05°, seat play ±0.012 mm, ±0.08°" in page
    assert f"{1e3 * score.measured.error.position_mean:.3f} mm" in page
    assert "wrist flip" in page
    assert (tmp_path / "sheet.pdf").read_bytes().count(b"/Type /Page ") == 1
    assert len(fixture.blocks) == 10


def test_what_can_be_written_is_written(tmp_path, monkeypatch, run):
    """Without optional libraries the lists, drawings and sheet are there, and what is missing is said."""
    lost = {"manifold3d": ("stl", "3mf"), "ezdxf": ("dxf",)}
    for library, kinds in lost.items():
        with monkeypatch.context() as without:
            without.setitem(sys.modules, library, None)
            words = ("plate", "export", "table2", "--out", "asked", "--formats", f"csv,{kinds[0]}")
            assert run(*words)[0] == 2
            assert run("plate", "export", "table2", "--out", "none", "--formats", kinds[0])[0] == 1
            assert not (tmp_path / "none").exists()
        monkeypatch.setitem(sys.modules, library, None)
    status, out, _ = run("plate", "export", "table2", "--out", "made")
    assert status == 0
    missing = tuple(kind for kinds in lost.values() for kind in kinds)
    assert all(f"not written: {kind}; " in out for kind in missing)
    names = {path.name for path in (tmp_path / "made").iterdir()}
    assert {"targets.csv", "bores.csv", "drawings.pdf", "sheet.pdf"} <= names
    assert not any(name.endswith(missing) for name in names)
    assert "not written" in (tmp_path / "made" / "sheet.html").read_text(encoding="utf-8")


def test_every_shape_is_drawn(plate_of):
    """Ten different blocks: all in the page, and the sheet says where the rest of the PDF's are."""
    places = [
        (0.1 * (i % 5) - 0.2, 0.1 * (i // 5) - 0.05, 0.05 + 0.003 * i, 0.3, 0.4, 0.1 * i) for i in range(10)
    ]
    fixture = fixture_of(plate_of(*places, size=(0.6, 0.3, 0.012)))
    assert len(fixture.shapes) == 10
    page = PlateSheet(fixture=fixture).html()
    assert "--shapes 3" in page
    assert "its own page in drawings.pdf" in page
    assert (
        len({page_.name for page_ in pages_of(fixture)} & {f"block-{s.letter}" for s in fixture.shapes}) == 10
    )


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
