"""The program without one of its extras, or all: entry points and code gone, everything else as it was."""

import os
import subprocess
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest

import workbench as wb
from workbench.base.installed_package import NAME

ROOT = Path(__file__).resolve().parents[1]
EXTRAS = sorted(path.parent.name for path in ROOT.glob("workbench/extras/*/__init__.py"))
POINTS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["entry-points"]
READ = ("observations", "options", "panels", "preparations", "drawables", "page_drawables", "watchers")
READ += ("session_commands",)
"""Groups whose parts the program loads whether or not they are used."""
CODE = """
import sys
import warnings
from importlib.abc import MetaPathFinder
from pathlib import Path

class Gone(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if any(f"{name}.".startswith(f"workbench.extras.{extra}.") for extra in sys.argv[1].split(",")):
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Gone())
warnings.simplefilter("error", RuntimeWarning)  # what a broken part costs

import workbench as wb
from workbench.arm.built_in_arms import load_robot
from workbench.cli import _carry_out
from workbench.cli.joined_options import OPTIONS
from workbench.data.observations import OBSERVATIONS
from workbench.data.readers.joint_tables import JOINS
from workbench.data.readers.layouts import LAYOUTS
from workbench.identification.own_preparation import PREPARATIONS
from workbench.plate.plate_toml import load_plate
from workbench.session.command import kinds
from workbench.session.view import WATCHERS
from workbench.views.drawables.scene_contents import ON_PAGE, SUBJECTS
from workbench.views.page.app import App
from workbench.views.page.panels import PANELS

def carried_out(*words):
    try:
        _carry_out(words)
    except SystemExit as ended:
        assert not ended.code, words

print(*dir(wb))
carried_out("--help")
carried_out("identify", "--help")
carried_out("plate", "--help")
carried_out("plate", "export", "table2", "--out", "made")
carried_out("identify", "rows.csv", "--robot", "aria", "--algorithm", "ols", "--json", "r.json")
app = App(load_robot("aria"), load_plate("table2"), data=("rows.csv", Path("rows.csv").read_bytes()))
assert app.worker.wait(60.0)
assert len(app.worker.session.measurements.loaded.dataset) == 40
app.close()
for registry in (OBSERVATIONS, OPTIONS, PANELS, PREPARATIONS, SUBJECTS, ON_PAGE, WATCHERS):
    print(*registry)
kinds()
print(*LAYOUTS, *JOINS)
print(*(name for name in sys.modules if name.startswith("workbench.extras.")))
"""


@pytest.mark.parametrize("gone", [*EXTRAS, ",".join(EXTRAS)])
def test_commands_and_page_go_on_without(gone, tmp_path):
    homes = tuple(f"workbench.extras.{extra}." for extra in gone.split(","))
    kept = {
        group: {n: h for n, h in parts.items() if not h.startswith(homes)} for group, parts in POINTS.items()
    }
    info = tmp_path / "site" / f"{NAME.replace('-', '_')}-{version(NAME)}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {NAME}\nVersion: {version(NAME)}\n")
    lines = [[f"[{group}]", *(f"{n} = {h}" for n, h in parts.items())] for group, parts in kept.items()]
    (info / "entry_points.txt").write_text("\n".join(line for part in lines for line in part))
    wb.write_measurements(wb.measure_poses(wb.load_robot("aria"), 40, seed=1)[1], tmp_path / "rows.csv")
    done = subprocess.run(
        [sys.executable, "-c", CODE, gone],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join((str(tmp_path / "site"), str(ROOT)))},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    root, *_, readers, extras = done.stdout.splitlines()
    assert set(readers.split()) == {*kept["workbench.layouts"], *kept["workbench.joins"]}
    for group, shown in (("workbench.root", root), ("workbench.commands", done.stdout)):
        names = {word for line in shown.splitlines() for word in line.split()[: None if shown == root else 1]}
        known, left = ({name.split()[-1] for name in points[group]} for points in (POINTS, kept))
        assert names & known == left
    written = {path.suffix.strip(".") for path in (tmp_path / "made").iterdir()}
    assert {"stl", "csv"} <= written
    assert all((kind in written) == (kind in kept["workbench.plate_exports"]) for kind in ("dxf", "pdf"))
    assert not [name for name in extras.split() if name.startswith(homes)]
    assert {h.partition(":")[0] for group in READ for h in kept.get(f"workbench.{group}", {}).values()} <= {
        *extras.split()
    }
    assert ("--camera" in done.stdout) is ("camera" not in gone.split(","))
