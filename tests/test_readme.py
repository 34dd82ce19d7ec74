"""What the README shows is run: its commands, and its Python."""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def block(mark):
    """The code block after a mark."""
    return re.search(rf"<!-- {mark} -->\n```\w+\n(.*?)```", README, re.DOTALL).group(1)


def environment():
    return os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "80"}


def run_lines(lines, folder):
    """Every line as it is typed, in a folder."""
    for line in lines:
        done = subprocess.run(
            [sys.executable, "-m", *line.split("#")[0].split()],
            cwd=folder,
            env=environment(),
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, (line, done.stderr)


def test_the_commands(tmp_path):
    lines = [line for line in block("try").splitlines() if line.startswith("workbench ")]
    assert len(lines) == 6
    run_lines(lines, tmp_path)
    assert (tmp_path / "report" / "report.html").is_file()
    assert (tmp_path / "calibrated.urdf").is_file()


def test_the_diagnosis(tmp_path):
    lines = block("diagnose").splitlines()
    assert len(lines) == 3
    run_lines(lines, tmp_path)
    assert 'name = "joint-compliance"' in (tmp_path / "soft.toml").read_text()
    assert (tmp_path / "diagnosis" / "diagnosis.html").is_file()


def test_the_pencil(tmp_path):
    lines = block("pencil").splitlines()
    assert len(lines) == 4
    run_lines(lines, tmp_path)
    assert (tmp_path / "sheet.png").is_file()
    assert (tmp_path / "errors.png").is_file()


def test_the_recordings(tmp_path):
    (tmp_path / "recordings").symlink_to(ROOT / "recordings")
    run_lines(block("recordings").splitlines(), tmp_path)
    assert (tmp_path / "session.html").is_file()
    assert (tmp_path / "sample.rrd").is_file()


def test_the_python(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", block("python")],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    title, error = done.stdout.split()[:2]
    assert title in ("OLS", "OPT1", "OPT2")
    assert float(error) < 0.2


def test_names_of_the_root_are_no_modules():
    """A name that is also a folder would turn from a function into a module at the first import."""
    import workbench

    modules = {path.stem for path in (ROOT / "workbench").iterdir() if path.suffix in ("", ".py")}
    assert not modules & set(workbench.__all__)
    for name in workbench.__all__:
        assert getattr(workbench, name) is not None


def test_two_commands_are_marked():
    assert ".venv/bin/workbench" in block("start")
    assert ".venv/bin/pytest" in block("test")
