"""What the README shows is run: its commands, and its Python; marked blocks of the documentation too."""

import re
import sys
from pathlib import Path

import pytest
from documented_commands import run_lines, unbroken

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "assets" / "docs").glob("*.md"))]


def block(mark):
    """The code block after a mark, in the README or else in a page of the documentation."""
    pattern = re.compile(rf"<!-- {mark} -->\n```\w+\n(.*?)```", re.DOTALL)
    return unbroken(next(found[1] for text in (README, *PAGES) if (found := pattern.search(text))))


def test_the_commands(run, tmp_path):
    lines = [line for line in block("try").splitlines() if line.startswith("workbench ")]
    assert len(lines) == 6
    run_lines(run, lines)
    page = (tmp_path / "report" / "report.html").read_text()
    assert "<html" in page
    assert not re.search(r"(src|href)=\"https?://", page)
    assert (tmp_path / "calibrated.urdf").is_file()


def test_the_diagnosis(run, tmp_path):
    lines = block("diagnose").splitlines()
    assert len(lines) == 3
    run_lines(run, lines)
    assert 'name = "joint-compliance"' in (tmp_path / "soft.toml").read_text()
    assert (tmp_path / "diagnosis" / "diagnosis.html").is_file()


@pytest.mark.extra("review")
def test_the_recordings(run, tmp_path):
    (tmp_path / "recordings").symlink_to(ROOT / "recordings")
    run_lines(run, block("recordings").splitlines())
    assert (tmp_path / "sample.rrd").is_file()


def test_the_python(tmp_path, monkeypatch, capsys):
    """With what the install above it brings: neither pandas nor polars."""
    for name in ("pandas", "polars"):
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.chdir(tmp_path)
    exec(compile(block("python"), "README", "exec"), {})
    lines = capsys.readouterr().out.splitlines()
    held_out = [line.split() for line in lines if line.strip().startswith("held out")]
    nominal, calibrated = [float(parts[2]) for parts in held_out]
    assert calibrated < 0.2 < 2.0 < nominal
    assert (tmp_path / "calibrated.urdf").is_file()


def test_names_of_the_root_are_no_modules():
    """A name that is also a folder would turn from a function into a module at the first import."""
    import workbench

    modules = {path.stem for path in (ROOT / "workbench").iterdir() if path.suffix in ("", ".py")}
    assert not modules & set(workbench.__all__)
