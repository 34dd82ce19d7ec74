"""A second package, one file and one entry point a part; what is broken beside it costs a warning."""

import json
from textwrap import dedent

import numpy as np
import pytest
from other_process import commands, python

import workbench as wb

PARTS = {
    "effects": """
        import numpy as np
        from dataclasses import dataclass
        from workbench.arm.effects import AbstractEffect, Loads
        from workbench.arm.effects.axes import diagonal, own

        @dataclass(frozen=True)
        class Part(AbstractEffect):
            name = "square-sag"
            loads = Loads.OWN

            def law(self, chain, motion, wrenches):
                moment = own(chain, self.joints, wrenches)
                return diagonal(-moment * np.abs(moment))

            def sentence(self, chain, motion):
                return f"{self.where} sags by {self.size(chain)}"
        """,
    "algorithms": """
        from workbench.identification.algorithms.identifier import AbstractIdentifier
        from workbench.identification.algorithms.ols import Ols

        class Part(AbstractIdentifier):
            name, title, summary = "theirs", "Theirs", "Least squares by another name."

            def search(self, problem):
                return Ols().search(problem)
        """,
    "layouts": """
        from workbench.base.units import Quantity
        from workbench.data.readers.layouts.layout import AbstractTableLayout, Picker

        class Part(AbstractTableLayout):
            name = "their-log"

            def matches(self, headings):
                return "axis-1" in headings

            def read(self, table):
                joints, places = [f"axis-{i}" for i in range(1, 7)], ["X", "Y", "Z"]
                pick = Picker(table, joints + places)
                pick.take([f"q{i}" for i in range(1, 7)], joints, "deg", Quantity.ANGLE)
                pick.take("xyz", places, "mm", Quantity.LENGTH)
                return pick.fields("their log")
        """,
    "exports": """
        from workbench.exports import AbstractForm

        class Part(AbstractForm):
            name, title, ending = "their-name", "the name of an arm", ".txt"

            def write(self, job):
                return job.robot.name

            def read(self, text, job):
                return None
        """,
    "report_sections": """
        from markupsafe import Markup
        from workbench.report.sections import AbstractSection

        class Part(AbstractSection):
            name, title = "their-section", "What they say"

            def html(self, result):
                return Markup("<p>{} by them</p>").format(result.robot.name)

            def json(self, result):
                return {"rows": len(result.data)}
        """,
    "commands": """
        from workbench.cli.exit_status import in_section

        @in_section("Files")
        def Part(number: int = 1) -> None:
            "Say a number twice."
            print(number, number)
        """,
    "panels": """
        from workbench.session.command import AbstractChange, AbstractLoad, computed
        from dataclasses import dataclass, replace
        from workbench.session.next_step import NextStep
        from workbench.session.part import AbstractPart
        from workbench.session.page_state import Severity, Tab
        from workbench.views.page.panels.panel import AbstractPanel

        class DoubleNoise(AbstractChange):
            factor: float = 2.0
            title = computed(lambda self: f"Noise times {self.factor:g}")

            def apply(self, session):
                noise = session.noise
                return replace(session, noise=noise._replace(position=self.factor * noise.position))

        @dataclass(frozen=True)
        class Counted(AbstractPart):
            is_mode = True
            number: int

            def step(self, session):
                return NextStep(f"{self.number} counted by them")

        class Count(AbstractChange):
            title = "Count one more"

            def apply(self, session):
                counted = session.part(Counted)
                return session.with_part(Counted(1 if counted is None else counted.number + 1))

        class LoadTheirs(AbstractLoad[str]):
            name: str
            content: bytes
            endings = (".theirs",)
            title = computed(lambda self: f"Read {self.name}")

            def compute(self, session):
                return self.content.decode()

            def finish(self, session, result):
                return session.with_message(Severity.INFO, result)

        SHOWN = []

        class Part(AbstractPanel):
            tab = Tab.PLATE
            depends = ("noise",)

            def build(self, gui):
                self._words = gui.add_html("")

            def show(self, session):
                self._words.content = f"{self.tab} {1e3 * session.noise.position:.3f} mm"
                SHOWN.append(self._words.content)
        """,
    "cube_fields": """
        from workbench.session.cube_fields import AbstractCubeField, CubeValues

        class Part(AbstractCubeField):
            name, choice, title, meaning = "height", "Height", "Height by them", "of the centre"

            def values(self, session):
                return CubeValues.scaled(session.plate.region.centres[:, 2])
        """,
    "options": """
        from dataclasses import dataclass
        from pathlib import Path
        from typing import Annotated
        from workbench.cli.joined_options import AbstractSource
        from workbench.cli.options import option
        from workbench.data.readers import read_measurements

        @dataclass(frozen=True)
        class Part(AbstractSource):
            theirs: Annotated[Path | None, option("A log of theirs, in place of the data.")] = None

            def read(self, path, arm, joints):
                return None if self.theirs is None else read_measurements(self.theirs, joints=arm.dof)
        """,
    "watchers": """
        from workbench.session.view import AbstractView

        SEEN = []

        class Part(AbstractView):
            def __init__(self, worker):
                self._worker = worker

            def draw(self, session):
                SEEN.append(session.noise.position)

            def close(self):
                SEEN.append("closed")
        """,
    "drawables": """
        import numpy as np
        from workbench.views.drawables.drawable import Axes
        from workbench.views.drawables.sink import Item

        def at(reach):
            return Axes(places=np.full((1, 3), reach), rotations=np.eye(3)[None])

        def Part(session):
            reach = session.robot.reach
            yield Item("theirs/reach", at, (reach,))
            yield Item("theirs/broken", lambda r: 1 / 0, (reach,))
        """,
}
"""What stands in the file of each part, by the group of its entry point."""
MORE = {"session_commands": "panels:DoubleNoise", "root": "commands:Part"}
BROKEN = "import a_module_that_nobody_has\n"


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    """A folder with a package of all parts, and one whose effect and algorithm can't be imported."""
    folder = tmp_path_factory.mktemp("packages")
    groups = {group: f"stranger.{group}:Part" for group in PARTS}
    groups |= {group: f"stranger.{home}" for group, home in MORE.items()}
    install(folder, "stranger", {n: dedent(code) for n, code in PARTS.items()}, groups)
    broken = dict.fromkeys(("effects", "algorithms"), "broken.part:Part")
    install(folder, "broken", {"part": BROKEN}, broken)
    return folder


def install(folder, name, files, groups):
    (folder / name).mkdir()
    for file, code in {"__init__": "", **files}.items():
        (folder / name / f"{file}.py").write_text(code)
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    points = [f"[workbench.{group}]\nits-{name} = {where}\n" for group, where in groups.items()]
    (info / "entry_points.txt").write_text("\n".join(points))


@pytest.fixture
def here(packages, tmp_path):
    """Where and with what programs run."""
    return {"folder": tmp_path, "packages": (packages,)}


@pytest.fixture
def log(tmp_path):
    """Measurements of a UR5 as only the stranger writes them."""
    _, rows = wb.measure_poses(wb.load_robot("ur5"), 40, instrument="laser-tracker", seed=2)
    table = np.column_stack([np.rad2deg(rows.q), 1e3 * rows.position])
    heading = ",".join([*(f"axis-{i}" for i in range(1, 7)), "X", "Y", "Z"])
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header=heading, comments="", fmt="%.9f")
    return tmp_path / "log.csv"


@pytest.mark.extra("reports")
def test_parts_of_another_package_through_the_command_line(here, log, tmp_path):
    lines = (
        f"identify {log} --robot ur5 --algorithm theirs --json r.json --save out.toml --report page",
        "export out.toml --for their-name --out x.txt",
        f"evaluate nothing.csv --robot ur5 --theirs {log} --json e.json",
        "new --help",
        f"preview {log} --layout list",
        "its-stranger --number 7",
        "--help",
    )
    identified, exported, evaluated, new, listed, messages, shown = commands(*lines, **here)
    assert (identified.status, exported.status, evaluated.status, messages.status) == (0, 0, 0, 0)
    (warning,) = [line for line in identified.err.splitlines() if "broken" in line]
    assert "a_module_that_nobody_has" in warning
    assert "theirs" in json.loads((tmp_path / "r.json").read_text())["algorithms"]
    page = (tmp_path / "page/report.html").read_text()
    assert f"<h2>What they say</h2>\n<p>{wb.load_robot('ur5').name} by them</p>" in page
    assert json.loads((tmp_path / "page/result.json").read_text())["their-section"] == {"rows": 40}
    assert (tmp_path / "x.txt").read_text() == wb.load_robot("ur5").name
    assert len(json.loads((tmp_path / "e.json").read_text())["rows"]) == 40
    assert "--theirs" not in new.out
    assert "'their-log'" in listed.err
    assert messages.out == "7 7\n"
    assert "its-stranger" in shown.out.partition("\nFiles:\n")[2]
    assert "\nCommands:\n" not in shown.out


def test_parts_of_another_package_through_python(here, log):
    code = f"""
        import warnings
        import workbench as wb
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            arm, rows = wb.measure_poses(wb.load_robot("ur5"), 30, effects=("square-sag:2",), seed=1)
            again = wb.read_measurements({str(log)!r})
            fit = wb.identify("ur5", again, algorithms="theirs")
        warned = sum("broken" in str(w.message) for w in told)
        print([e.name for e in arm.effects], list(fit.runs), len(again), warned)
        getattr(wb, "its-stranger")(number=5)
        assert "its-stranger" in dir(wb)
        """
    assert python(code, **here) == "['square-sag'] ['theirs'] 40 2\n5 5\n"


def test_parts_of_another_package_in_page_journal_recording_and_reopened_session(here, log, reader):
    code = """
        import warnings
        from dataclasses import replace
        from pathlib import Path
        from stranger.panels import SHOWN, Count, DoubleNoise
        from stranger.watchers import SEEN
        from workbench.arm.built_in_arms import load_robot
        from workbench.exports import FORMS
        from workbench.plate.plate_toml import load_plate
        from workbench.session.commands.data import LoadData
        from workbench.session.commands.identify import Identify
        from workbench.session.commands.region import ShowCubes
        from workbench.session.export import exported_as
        from workbench.session.journal.folder import begin
        from workbench.session.page_state import Severity
        from workbench.session.state import CubeView
        from workbench.views.page.app import App
        from workbench.views.page.panels.legend import cubes_scale
        from workbench.views.recording.recorder import recorder

        warnings.simplefilter("ignore")
        robot, plate = load_robot("ur5"), load_plate("table2")
        begun = begin(robot, plate, folder=Path("rec"))
        begun = replace(begun, keepers=(*begun.keepers, recorder(Path("rec"))))
        app = App(robot, plate, begun=begun, data=("a.theirs", b"read by them"))
        for command in (DoubleNoise(3.0), Count(), Count(), ShowCubes(CubeView(field="height"))):
            app.worker.submit(command)
        assert app.worker.wait(60.0)
        messages = app.worker.session.page.messages
        assert "read by them" in [m.text for m in messages]
        (broken,) = [m for m in messages if "theirs/broken" in m.text]
        assert broken.severity is Severity.WARNING
        nodes = app.server.scene._handle_from_node_name
        assert any("theirs/reach" in name for name in nodes)
        assert "Height by them" in cubes_scale(app.worker.session)
        assert app.worker.session.region.cubes is None
        app.worker.submit(LoadData("log.csv", Path("log.csv").read_bytes()))
        assert app.worker.wait(60.0)
        app.worker.submit(Identify(algorithms=("theirs",)))
        assert app.worker.wait(120.0)
        assert broken in app.worker.session.page.messages
        made = exported_as(FORMS["their-name"])(app.worker.session)
        assert made[1].decode() == robot.name, made
        app.close()
        print(SHOWN[0], "to", SHOWN[-1])
        print(round(max(SEEN[:-1]) / min(SEEN[:-1])), SEEN[-1])
        """
    assert python(code, **here) == "Plate 0.100 mm to Plate 0.300 mm\n3 closed\n"
    code = """
        from pathlib import Path
        from workbench.session.next_step import next_step
        from workbench.session.journal.reader import read_recording
        from workbench.session.journal.restore import restore

        opened = restore(read_recording(Path("rec")))
        again = opened.session
        assert not opened.differences
        assert len(again.measurements.loaded.dataset) == 40
        assert list(again.results.identification.runs) == ["theirs"]
        assert again.region.view.field == "height"
        print(f"{1e3 * again.noise.position:.3f}", next_step(again).sentence)
        """
    assert python(code, **here) == "0.300 2 counted by them\n"
    drawn = reader(here["folder"] / "rec" / "session.rrd")
    assert any("theirs/reach" in path for path in drawn.paths)
    code = """
        from pathlib import Path
        from workbench.session.journal.reader import read_recording
        print(read_recording(Path("rec")).skipped)
        """
    assert "DoubleNoise" in python(code, **(here | {"packages": ()}))
