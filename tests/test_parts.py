"""Parts of another package: one record brings them all in; what is broken costs one warning that names it."""

import json
from dataclasses import dataclass
from textwrap import dedent

import numpy as np
import pytest
from gear_sag import GearSag
from other_process import beside_each, commands, python
from refusals import mentions

import workbench as wb
from workbench.arm.effects import EFFECTS
from workbench.parts import Parts

WEATHER = """
    from dataclasses import dataclass, replace

    import numpy as np

    from workbench.arm.effects import AbstractEffect
    from workbench.arm.effects.axes import diagonal
    from workbench.base.columns import Column
    from workbench.base.units import Quantity
    from workbench.data.observation import AbstractObservation, Channel, Linearised
    from workbench.data.readers.layouts import AbstractTableLayout, named
    from workbench.exports import AbstractForm

    HUMIDITY = Column(
        name="humidity", quantity=Quantity.NUMBER, also=("feuchte",), driver=True, usual=(0.5, 0.3)
    )

    @dataclass(frozen=True)
    class HumiditySwell(AbstractEffect):
        name = "humidity-swell"
        needs = ("humidity",)

        def law(self, chain, motion, wrenches):
            wet = motion.need("humidity", self.name) - 0.5
            return diagonal(np.repeat(wet[:, None], len(self.joints), axis=1))

        def sentence(self, chain, motion):
            return f"{self.where} swells by {self.size(chain)}"

    class HeightObservation(AbstractObservation):
        height: np.ndarray
        brings = (Column(name="height", quantity=Quantity.LENGTH, also=("z_laser",), observed=True),)
        columns = ("height",)

        @property
        def channels(self):
            return (Channel.POSITION,)

        @classmethod
        def of(cls, data):
            return cls(data.column("height"))

        def linearise(self, poses, unknown):
            up = np.tile([0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (len(poses), 1, 1))
            return Linearised((self.height - poses[:, 2, 3])[:, None], up, np.zeros((len(poses), 1, 0)))

    class TheirLog(AbstractTableLayout):
        name = "their-log"

        def matches(self, headings):
            return "axis-1" in headings

        def read(self, table):
            joints = {f"axis-{i}": f"q{i}[deg]" for i in range(1, 7)}
            return named(table, {**joints, "H": "height[mm]"}, "their log")

    class NameOfArm(AbstractForm):
        name, title, ending = "their-name", "the name of an arm", ".txt"

        def write(self, job):
            return job.robot.name

        def read(self, text, job):
            return job.robot

    def twice(number: int = 1, data: str = "rows", robot: int = 3) -> None:
        "Say a number twice."
        print(number, number)
"""
ON_PAGE = """
    from dataclasses import replace

    from workbench.session.command import AbstractChange, computed
    from workbench.session.page_state import Tab
    from workbench.views.page.panels.panel import AbstractPanel

    SHOWN = []

    class DoubleNoise(AbstractChange):
        factor: float = 2.0
        title = computed(lambda self: f"Noise times {self.factor:g}")

        def apply(self, session):
            noise = session.noise
            return replace(session, noise=noise._replace(position=self.factor * noise.position))

    class NoisePanelOfTheirs(AbstractPanel):
        tab = Tab.PLATE
        depends = ("noise",)

        def build(self, gui):
            self._text = gui.add_html("")

        def show(self, session):
            SHOWN.append(f"{1e3 * session.noise.position:.3f} mm")
            self._text.content = SHOWN[-1]
"""
RECORD = """
    from workbench.parts import Parts
    from workbench.cli.exit_status import in_section
    from weather import parts

    PARTS = Parts(
        columns=(parts.HUMIDITY,),
        effects=(parts.HumiditySwell,),
        observations=("weather.parts:HeightObservation",),
        layouts=("weather.parts:TheirLog",),
        exports=(parts.NameOfArm(),),
        commands={"twice": in_section("Files")(parts.twice)},
        root={"twice": "weather.parts:twice"},
        session_commands=("weather.page:DoubleNoise",),
        panels=("weather.page:NoisePanelOfTheirs", "weather.page:Missing"),
    )
"""


def install(folder, name, record, **files):
    """A package whose record stands in its `record.py`."""
    (folder / name).mkdir(parents=True)
    for file, code in {"__init__": "", "record": record, **files}.items():
        (folder / name / f"{file}.py").write_text(dedent(code))
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[workbench.parts]\nall = {name}.record:PARTS\n")
    return folder


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    """Where and with what programs run."""
    package = install(tmp_path_factory.mktemp("theirs"), "weather", RECORD, parts=WEATHER, page=ON_PAGE)
    return {"folder": tmp_path_factory.mktemp("home"), "packages": (package,)}


def test_effects_drivers_logs_observations_forms_and_commands(here):
    folder = here["folder"]
    arm, q = wb.load_robot("aria"), np.random.default_rng(1).uniform(-1.0, 1.0, (60, 6))
    moved = arm.with_values({"joint3.theta": arm.values(("joint3.theta",))[0] + 5e-3})
    table = np.column_stack([np.rad2deg(q), 1e3 * wb.tool_poses(moved, q)[:, 2, 3]])
    header = ",".join([*(f"axis-{i}" for i in range(1, 7)), "H"])
    np.savetxt(folder / "log.csv", table, delimiter=",", header=header, comments="", fmt="%.9f")
    *files, listed, called, shown = commands(
        "simulate --robot aria --poses 80 --effect humidity-swell:2:0.004 --seed 1 --out rows.csv",
        "diagnose rows.csv --robot aria --json d.json --save s.toml",
        "export s.toml --for their-name --out x.txt",
        "identify log.csv --robot aria --free joint3.theta --frames shared --algorithm ols --json h.json",
        "preview log.csv --layout list",
        "twice --number 7",
        "--help",
        **here,
    )
    assert not any(end.status for end in files), files
    assert "humidity" in (folder / "rows.csv").read_text().partition("\n")[0].split(",")
    (effect,) = json.loads((folder / "d.json").read_text())["effects"]
    assert (effect["name"], effect["joints"]) == ("humidity-swell", [2])
    assert effect["coefficients"][0]["value"] == pytest.approx(4e-3, rel=0.2)
    assert (folder / "x.txt").read_text() == arm.name
    (constant,) = json.loads((folder / "h.json").read_text())["algorithms"]["ols"]["parameters"]
    assert constant["value"] - constant["nominal"] == pytest.approx(5e-3, abs=1e-6)
    assert "their-log" in listed.out
    assert (called.status, called.out) == (0, "7 7\n")
    assert "twice" in shown.out.partition("\nFiles:\n")[2]


def test_panels_and_commands_of_the_page_are_recorded_and_reopened(here):
    code = """
        import warnings
        from pathlib import Path

        warnings.simplefilter("ignore")
        from weather.page import SHOWN, DoubleNoise
        from workbench.arm.built_in_arms import load_robot
        from workbench.plate.measured_plate import load_plate
        from workbench.session.journal.folder import begin
        from workbench.session.journal.reader import read_recording
        from workbench.session.journal.replay import restore
        from workbench.views.page.app import App

        robot, plate = load_robot("aria"), load_plate("table2")
        app = App(robot, plate, begun=begin(robot, plate, folder=Path("rec")))
        app.worker.submit(DoubleNoise(3.0))
        assert app.worker.wait(60.0)
        told = [m.text for m in app.worker.session.page.messages if "weather.page:Missing" in m.text]
        app.close()
        again = restore(read_recording(Path("rec"))).session
        print(SHOWN[0], SHOWN[-1], f"{1e3 * again.noise.position:.3f}", len(told))
        import workbench as wb
        wb.twice(number=5)
        print("twice" in dir(wb))
        """
    assert python(code, **here) == "0.100 mm 0.300 mm 0.300 1\n5 5\nTrue\n"
    code = """
        from pathlib import Path
        from workbench.session.journal.reader import read_recording
        print(read_recording(Path("rec")).skipped)
        """
    assert "DoubleNoise" in python(code, **(here | {"packages": ()}))


LAW = """
    from dataclasses import dataclass
    from workbench.arm.effects.joint_compliance import JointCompliance

    @dataclass(frozen=True)
    class Sag(JointCompliance):
        name = "broken-compliance"

        def law(self, chain, motion, wrenches):
            return 1 / 0
"""
LAYOUT = """
    from workbench.data.readers.layouts import AbstractTableLayout

    class Log(AbstractTableLayout):
        name = "theirs"

        def matches(self, headings):
            return 1 / 0

        def read(self, table):
            return None
"""
START = "from workbench.parts import Parts\nPARTS = "
BROKEN = {
    "no record": ("import json\nPARTS = json.loads('x')", "", ("theirs.record", "line 2")),
    "a field that is none": (f"{START}Parts(effect=())", "", ("effect", "line 2")),
    "a licence": (
        f"{START}Parts(effects=('theirs.part:Sag',))",
        "raise SystemExit('no')",
        ("theirs.part:Sag",),
    ),
    "not whole": (
        f"from workbench.arm.effects import AbstractEffect\n{START}Parts(effects=(AbstractEffect,))",
        "",
        ("AbstractEffect", "theirs"),
    ),
    "a law that raises": (f"{START}Parts(effects=('theirs.part:Sag',))", LAW, ("Sag", "line 10")),
    "a layout that raises": (f"{START}Parts(layouts=('theirs.part:Log',))", LAYOUT, ("theirs", "line 8")),
}


@pytest.fixture(scope="module")
def ended(tmp_path_factory):
    """How commands ended beside each broken package."""
    folder = tmp_path_factory.mktemp("broken")
    rows = wb.measure_poses(wb.load_robot("aria"), 40, seed=1, effects="joint-compliance:2")[1]
    wb.write_measurements(rows, folder / "x.csv")
    packages = {
        case: install(folder / str(k), "theirs", record, part=part)
        for k, (case, (record, part, _)) in enumerate(BROKEN.items())
    }
    usual = ("--help", "export aria --for dh-csv --out a.csv", f"evaluate {folder}/x.csv --robot aria")
    lines = dict.fromkeys(
        packages, (*usual, "simulate --robot aria --poses 5 --effect backlash:2 --out b.csv")
    )
    lines["a law that raises"] = (*usual, f"diagnose {folder}/x.csv --robot aria")
    return beside_each(packages, lines, folder=folder)


@pytest.mark.parametrize("case", BROKEN)
def test_a_broken_part_costs_one_warning_and_no_command(ended, case):
    assert not any(end.status for end in ended[case]), ended[case]
    (warning,) = {line for end in ended[case] for line in end.err.splitlines() if "is left out" in line}
    assert mentions(warning, *BROKEN[case][2])


def test_a_cell_that_runs_again_replaces_its_part_and_nobody_takes_a_name_of_ours():
    @dataclass(frozen=True)
    class Again(GearSag):
        pass

    @dataclass(frozen=True)
    class Backlash(GearSag):
        name = "backlash"

    ours = EFFECTS["backlash"]
    forget = [wb.register(Parts(effects=(kind,))) for kind in (GearSag, Again, Backlash)]
    with pytest.warns(RuntimeWarning, match="backlash"):
        assert EFFECTS["backlash"] is ours
    assert EFFECTS["gear-sag"] is Again
    for undo in forget:
        undo()
    assert "gear-sag" not in EFFECTS
