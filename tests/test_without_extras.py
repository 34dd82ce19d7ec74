"""The program without one of its extras, or all: their folders gone, everything else as it was."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from slow import slow

import workbench as wb
from workbench.parts import EXTRAS

ROOT = Path(__file__).resolve().parents[1]
CODE = """
import io
import os
import sys
import warnings
from contextlib import redirect_stdout
from dataclasses import fields
from importlib.abc import MetaPathFinder
from pathlib import Path

(gone,) = sys.argv[1:]

class Gone(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if any(f"{name}.".startswith(f"workbench.extras.{extra}.") for extra in gone.split(",")):
            raise ModuleNotFoundError(name, name=name)

sys.meta_path.insert(0, Gone())
warnings.simplefilter("error", RuntimeWarning)  # what a broken part costs

import workbench as wb
from workbench.arm.built_in_arms import load_robot
from workbench.cli import _carry_out
from workbench.parts import EXTRAS, Parts, offered, resolved
from workbench.plate.export import export_plate
from workbench.plate.measured_plate import load_plate
from workbench.views.page.app import App

def said(*words):
    with redirect_stdout(io.StringIO()) as out:
        try:
            _carry_out(words)
        except SystemExit as ended:
            assert not ended.code, words
    return out.getvalue()

left = {f"workbench.extras.{name}" for name in EXTRAS} - {f"workbench.extras.{n}" for n in gone.split(",")}
every = [each for field in fields(Parts) for each in offered(field.name)]
assert {origin for _, _, origin in every} == left
shown = said("--help") + said("plate", "--help") + said("identify", "--help")
for name, _, _ in offered("commands"):
    assert f"  {name.split()[-1]} " in shown, name
assert ("--camera" in shown) is ("workbench.extras.camera" in left)
assert {name for name, _, _ in offered("root")} <= {*dir(wb)}
said("identify", "rows.csv", "--robot", "aria", "--algorithm", "ols", "--json", os.devnull)
assert "toml" in {path.suffix.strip(".") for path in export_plate(load_plate("table2"), gone[:9]).files}
app = App(load_robot("aria"), load_plate("table2"), data=("rows.csv", Path("rows.csv").read_bytes()))
assert app.worker.wait(60.0)
assert len(app.worker.session.measurements.loaded.dataset) == 40
app.close()
for _, part, _ in every:
    resolved(part)
"""


@pytest.mark.parametrize("gone", [",".join(EXTRAS), *(slow(e) for e in EXTRAS)])
def test_commands_and_page_go_on_without(gone, tmp_path):
    wb.write_measurements(wb.measure_poses(wb.load_robot("aria"), 40, seed=1)[1], tmp_path / "rows.csv")
    command = [sys.executable, "-c", CODE, gone]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=environment, check=False)
    assert done.returncode == 0, done.stderr
