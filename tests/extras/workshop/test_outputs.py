"""A folder with everything to make a plate, from the command and from the page."""

import io
import sys
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions

from workbench import Parts, load_plate, register, write_plate
from workbench.extras.workshop.fixture import fixture_of
from workbench.plate.export import PlateFile, export_plate, formats_named
from workbench.session.export import fixture_zip

FILES = {
    *(f"{part}.{end}" for part in ("plate", "block-A") for end in ("stl", "step")),
    *("plate.toml", "plate.dxf", "plate.pdf", "targets.csv"),
}


@pytest.fixture(scope="module")
def small(plate):
    """One target of Table 2: a block and its plate are soon made."""
    return replace(plate, targets=plate.targets[:1])


def test_every_format_is_written(tmp_path, told, small):
    write_plate(small, tmp_path / "small.toml")
    (tmp_path / "made").mkdir()
    (tmp_path / "made" / "mine.txt").write_text("stays")
    found, out = told("plate", "export", "small.toml", "--out", "made")
    assert (found["schema"], found["shapes"]) == ("workbench.plate-export/1", {"A": 1})
    assert {*found["files"]} == FILES
    assert mentions(out, "1 × A")
    assert {path.name for path in (tmp_path / "made").iterdir()} == FILES | {"mine.txt"}


def test_the_page_packs_them_all(first, small, monkeypatch):
    """STEP, too, with what was decided about the plate."""
    _, content, notes = fixture_zip(replace(first, plate=small, states=first.states[:1]))
    packed = zipfile.ZipFile(io.BytesIO(content))
    assert set(packed.namelist()) == {f"fixture/{name}" for name in (*FILES, "poses.csv")}
    q = np.loadtxt(io.BytesIO(packed.read("fixture/poses.csv")), delimiter=",", skiprows=1, usecols=range(6))
    assert np.deg2rad(q) == pytest.approx(first.states[0].q, abs=1e-6)
    assert notes == fixture_of(small).notes
    monkeypatch.setattr("workbench.extras.workshop.outputs.pdf_of", lambda _: b"")  # takes seconds
    blocked = (replace(first.states[0], hit="link 2 would run into the plate"),)
    _, content, notes = fixture_zip(replace(first, plate=small, states=blocked))
    assert len(zipfile.ZipFile(io.BytesIO(content)).read("fixture/poses.csv").splitlines()) == 1
    assert mentions(" ".join(notes), "target 1 is not in poses.csv")


def test_a_format_of_another_package_is_written_with_the_usual_ones(tmp_path):
    theirs = PlateFile("theirs", lambda plate: {"name.txt": plate.name.encode()})
    forget = register(Parts(plate_exports=(theirs,)))
    try:
        files, *_ = export_plate(load_plate("table2"), tmp_path, formats=formats_named("theirs,csv"))
    finally:
        forget()
    assert {path.name for path in files} == {"name.txt", "targets.csv"}
    assert (tmp_path / "name.txt").read_text() == "Table 2"


@pytest.mark.slow
def test_what_can_be_written_is_written(tmp_path, monkeypatch, run):
    """Without optional libraries the lists are there, and what is missing is said."""
    for library in ("manifold3d", "OCP.BRepAlgoAPI"):
        monkeypatch.setitem(sys.modules, library, None)
    assert run("plate", "export", "table2", "--out", "asked", "--formats", "csv,stl")[0] == 2
    assert run("plate", "export", "table2", "--out", "none", "--formats", "stl")[0] == 1
    assert not (tmp_path / "none").exists()
    status, out, _ = run("plate", "export", "table2", "--out", "made")
    assert status == 0
    assert mentions(out, "stl", "step")
    names = {path.name for path in (tmp_path / "made").iterdir()}
    assert names == {"plate.toml", "targets.csv", "plate.dxf", "plate.pdf"}


@pytest.mark.parametrize("formats", [(), ("--formats", "toml,csv")])
def test_a_plate_is_not_replaced_by_its_own_export(tmp_path, run, formats):
    """It would lose its comments, and take the tolerance of one export."""
    file = write_plate(load_plate("table2"), tmp_path / "plate.toml")
    file.write_text("# mine\n" + file.read_text())
    exported = ("plate", "export", "plate.toml", "--out", ".", "--tolerance", "0.3mm,0.2deg")
    status, _, error = run(*exported, *formats)
    assert status == 64
    assert mentions(error, "plate.toml")
    assert [path.name for path in tmp_path.iterdir()] == ["plate.toml"]
    assert run(*exported, "--formats", "csv")[0] == 0
    assert file.read_text().startswith("# mine")
