"""The program without one of its extras, or all: entry points and code gone, everything else as it was."""

import os
import re
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
READ = ("observations", "options", "panels", "preparations", "drawables", "watchers")
READ += ("moving_drawables",)
READ += ("session_commands",)
"""Groups whose parts the program loads whether or not they are used."""
OF_CORE = {"export"}
"""Commands by whose name another one of an extra's goes, in a group."""
CODE = """
import os
import sys
import warnings
from importlib.abc import MetaPathFinder
from pathlib import Path

import matplotlib.figure, numba, scipy.optimize, scipy.spatial, scipy.stats, typer, viser  # once for all

for gone in sys.argv[1:]:
    if not (child := os.fork()):
        break
    assert os.waitpid(child, 0)[1] == 0, gone
else:
    sys.exit()

class Gone(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if any(f"{name}.".startswith(f"workbench.extras.{extra}.") for extra in gone.split(",")):
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Gone())
warnings.simplefilter("error", RuntimeWarning)  # what a broken part costs
os.chdir(gone)
sys.path.insert(0, os.path.abspath("site"))
sys.stdout = open("said.txt", "w")

import workbench as wb
from workbench.arm.built_in_arms import load_robot
from workbench.cli import _carry_out
from workbench.cli.joined_options import OPTIONS
from workbench.data.observations import OBSERVATIONS
from workbench.data.readers.joint_tables import JOINS
from workbench.data.readers.layouts import LAYOUTS
from workbench.identification.instrument_preparation import PREPARATIONS
from workbench.plate.export import PLATE_FILES, export_plate
from workbench.plate.plate_toml import load_plate
from workbench.session.command import kinds
from workbench.session.view import WATCHERS
from workbench.views.drawables.scene_contents import MOVING, ON_PAGE, SUBJECTS
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
if "workshop" in gone:
    export_plate(load_plate("table2"), "made")
else:  # the others' own tests write the other formats
    carried_out("plate", "export", "table2", "--out", "made", "--formats", "stl,csv,toml")
carried_out("identify", "rows.csv", "--robot", "aria", "--algorithm", "ols", "--json", "r.json")
app = App(load_robot("aria"), load_plate("table2"), data=("rows.csv", Path("rows.csv").read_bytes()))
assert app.worker.wait(60.0)
assert len(app.worker.session.measurements.loaded.dataset) == 40
app.close()
for registry in (OBSERVATIONS, OPTIONS, PANELS, PREPARATIONS, SUBJECTS, ON_PAGE, MOVING, WATCHERS):
    print(*registry)
kinds()
print(*PLATE_FILES)
print(*LAYOUTS, *JOINS)
print(*(name for name in sys.modules if name.startswith("workbench.extras.")))
"""


def left_of(group: str, gone: str) -> dict[str, str]:
    """Entry points of a group without those of some extras."""
    homes = tuple(f"workbench.extras.{extra}." for extra in gone.split(","))
    return {name: home for name, home in POINTS.get(group, {}).items() if not home.startswith(homes)}


ALL = ",".join(EXTRAS)


@pytest.fixture(scope="module")
def folders(tmp_path_factory) -> Path:
    """What the program did without each extra, and without all of them, each in a folder of its name."""
    root = tmp_path_factory.mktemp("without")
    rows = wb.measure_poses(wb.load_robot("aria"), 40, seed=1)[1]
    for gone in (*EXTRAS, ALL):
        info = root / gone / "site" / f"{NAME.replace('-', '_')}-{version(NAME)}.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {NAME}\nVersion: {version(NAME)}\n")
        lines = [[f"[{group}]", *(f"{n} = {h}" for n, h in left_of(group, gone).items())] for group in POINTS]
        (info / "entry_points.txt").write_text("\n".join(line for part in lines for line in part))
        wb.write_measurements(rows, root / gone / "rows.csv")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", CODE, *EXTRAS, ALL]
    done = subprocess.run(command, capture_output=True, text=True, cwd=root, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    return root


@pytest.mark.parametrize("gone", [*EXTRAS, ALL])
def test_commands_and_page_go_on_without(gone, folders):
    message = (folders / gone / "said.txt").read_text()
    root, *_, files, readers, extras = message.splitlines()
    assert set(files.split()) == {"toml", *left_of("workbench.plate_exports", gone)}
    assert set(readers.split()) == {*left_of("workbench.layouts", gone), *left_of("workbench.joins", gone)}
    for group, shown in (("workbench.root", root), ("workbench.commands", message)):
        names = {*(root.split() if shown == root else re.findall(r"^ {2}(\S+) ", shown, re.MULTILINE))}
        known, left = ({n.split()[-1] for n in points} for points in (POINTS[group], left_of(group, gone)))
        assert names & known - OF_CORE == left - OF_CORE
    formats = {"toml"} if "workshop" in gone else {"stl", "csv", "toml"}
    assert formats == {path.suffix.strip(".") for path in (folders / gone / "made").iterdir()}
    homes = tuple(f"workbench.extras.{extra}." for extra in gone.split(","))
    assert not [name for name in extras.split() if name.startswith(homes)]
    loaded = {
        home.partition(":")[0] for group in READ for home in left_of(f"workbench.{group}", gone).values()
    }
    assert loaded <= {*extras.split()}
    assert ("--camera" in message) is ("camera" not in gone.split(","))
