"""The wheel alone, without the checkout: all that it needs is inside. Its commands: `.ci/run wheel`."""

import os
import socket
import subprocess
import sys
import urllib.request
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow
ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """The wheel, built without a network."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return next(folder.glob("arm_calibration_workbench-*.whl"))


@pytest.fixture(scope="module")
def elsewhere(wheel):
    """A folder with the wheel's content, and what runs the command there as an installed one."""
    folder = wheel.parent / "site"
    zipfile.ZipFile(wheel).extractall(folder)
    environment = os.environ | {"PYTHONPATH": str(folder), "COLUMNS": "100"}
    work = wheel.parent / "work"
    work.mkdir()

    def start(*arguments: str, **options) -> subprocess.Popen:
        command = [sys.executable, "-m", "workbench", *arguments]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        return subprocess.Popen(command, cwd=work, env=environment, **pipes, **options)

    where = subprocess.run(
        [sys.executable, "-c", "import workbench; print(workbench.__file__)"],
        cwd=work,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert Path(where.stdout.strip()).is_relative_to(folder)
    return work, start


def test_the_wheel_holds_the_package_and_no_pictures(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    assert not [n for n in names if "__pycache__" in n or "assets/pictures" in n or n.startswith("tests/")]
    own = {p.relative_to(ROOT).as_posix() for p in (ROOT / "workbench").rglob("*") if p.is_file()}
    own = {name for name in own if "__pycache__" not in name}
    assert own <= set(names)
    kept = {p.relative_to(ROOT).parts[1] for p in (ROOT / "assets").rglob("*.toml")}
    assert {n.split("/")[2] for n in names if n.startswith("workbench/assets/")} >= kept
    assert wheel.stat().st_size < 3e6
    metadata = next(n for n in names if n.endswith("METADATA"))
    text = zipfile.ZipFile(wheel).read(metadata).decode()
    assert "License-Expression: Apache-2.0" in text
    assert any(n.endswith("licenses/LICENSE") for n in names)


def test_the_page(elsewhere):
    """A demo on a live source first, then a branch of its recording."""
    work, start = elsewhere
    with socket.create_server(("127.0.0.1", 0)) as source:
        live = f"127.0.0.1:{source.getsockname()[1]}"
        served(start, "serve", "--demo", "--source", live)
    (recording,) = (work / "recordings").iterdir()
    assert (recording / "journal.jsonl").is_file()
    served(start, "serve", "--session", str(recording), "--step", "0", "--no-record")
    assert [*(work / "recordings").iterdir()] == [recording]


def served(start, *options: str) -> None:
    """The page is served, and its command ends when it is told to."""
    with start(*options, "--no-open", "--port", "0") as program:
        try:
            message = dict(program.stdout.readline().split(None, 1) for _ in range(3))
            assert {"page:", "session:"} < set(message), message
            with urllib.request.urlopen(message["page:"].strip()) as page:
                assert b"<html" in page.read()
        finally:
            program.terminate()
        _, err = program.communicate(timeout=60)
    assert program.returncode == 0, err
