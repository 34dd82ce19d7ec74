"""The documentation's gallery: ten programs, each run as it stands."""

import runpy
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import pytest

GALLERY = Path(__file__).resolve().parents[1] / "assets" / "docs" / "gallery"
PROGRAMS = sorted(GALLERY.glob("*.py"))


def test_there_are_ten():
    assert len(PROGRAMS) == 10


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
def test_it_runs(program, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(matplotlib, "rcParams", matplotlib.rcParams.copy())
    matplotlib.use("Agg")
    runpy.run_path(str(program))
    plt.close("all")
