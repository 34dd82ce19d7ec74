"""A folder with everything to make a plate."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions

from workbench.base.errors import OptionError
from workbench.parts import Parts, register
from workbench.plate.export import PlateFile, export_plate, formats_named
from workbench.plate.plate_toml import load_plate, write_plate
from workbench.plate.stock import Stock

PARTS = ("plate", "block-A", "block-B", "probe", "bottom", "stand-off")


def test_every_format_is_written(tmp_path, aria):
    (tmp_path / "mine.txt").write_text("stays")
    files, missing, _ = export_plate(load_plate("table2"), tmp_path, formats=("stl", "csv"))
    names = {path.name for path in files}
    lists = ("holes", "blocks", "bores", "targets", "parts")
    assert names == {*(f"{p}.stl" for p in PARTS), *(f"{n}.csv" for n in lists)}
    assert not missing
    assert {path.name for path in tmp_path.iterdir()} == names | {"mine.txt"}


def test_a_format_of_another_package_is_written_with_the_usual_ones(tmp_path):
    theirs = PlateFile("theirs", lambda job: {"name.txt": f"{job.plate.name} {job.stock.play}".encode()})
    forget = register(Parts(plate_exports=(theirs,)))
    try:
        files, *_ = export_plate(load_plate("table2"), tmp_path, formats=formats_named("theirs,csv"))
    finally:
        forget()
    assert "name.txt" in {path.name for path in files}
    assert (tmp_path / "name.txt").read_text() == f"Table 2 {Stock().play}"


def test_what_can_be_written_is_written(tmp_path, monkeypatch, run):
    """Without optional libraries the lists are there, and what is missing is said."""
    monkeypatch.setitem(sys.modules, "manifold3d", None)
    assert run("plate", "export", "table2", "--out", "asked", "--formats", "csv,stl")[0] == 2
    assert run("plate", "export", "table2", "--out", "none", "--formats", "stl")[0] == 1
    assert not (tmp_path / "none").exists()
    status, out, _ = run("plate", "export", "table2", "--out", "made")
    assert status == 0
    assert mentions(out, "stl")
    names = {path.name for path in (tmp_path / "made").iterdir()}
    assert {"targets.csv", "bores.csv"} <= names
    assert "plate.toml" in names
    assert not any(name.endswith("stl") for name in names)


def test_a_plate_is_not_replaced_by_its_own_export(tmp_path, run):
    """It would lose its comments, and take the tolerance of one export."""
    file = write_plate(load_plate("table2"), tmp_path / "plate.toml")
    file.write_text("# mine\n" + file.read_text())
    exported = ("plate", "export", "plate.toml", "--out", ".", "--tolerance", "0.3mm,0.2deg")
    status, _, error = run(*exported)
    assert status == 64
    assert mentions(error, "plate.toml")
    assert [path.name for path in tmp_path.iterdir()] == ["plate.toml"]
    assert run(*exported, "--formats", "csv")[0] == 0
    assert file.read_text().startswith("# mine")


def test_nothing_is_written_where_it_can_not_be_made(tmp_path):
    plate = load_plate("table2")
    with pytest.raises(OptionError):
        export_plate(replace(plate, size=np.array([0.3, 0.3, 0.01])), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_format_that_there_is_not(refused):
    refused(["stl", "csv"], "plate", "export", "table2", "--out", "made", "--formats", "obj", status=64)


def test_formats_are_named():
    assert formats_named("stl, CSV") == ("stl", "csv")
    with pytest.raises(OptionError):
        formats_named("stl,obj")
    with pytest.raises(OptionError):
        formats_named("")
