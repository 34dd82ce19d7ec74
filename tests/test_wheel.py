"""The wheel alone, without the checkout: all that it needs is inside. Its commands: `.ci/run wheel`."""

import subprocess
import sys
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
