"""Columns of a second package, each one entry: a driver with an effect that needs it, and an observation."""

import json
from textwrap import dedent

import pytest
from other_process import commands, python
from test_plugins import install

WEATHER = """
    from dataclasses import dataclass

    import numpy as np

    from workbench.arm.effects import AbstractEffect
    from workbench.arm.effects.axes import diagonal
    from workbench.base.columns import Column
    from workbench.base.units import Quantity
    from workbench.data.observations import AbstractObservation, Channel, Linearised

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
"""
ON_PAGE = dedent(
    """
    from dataclasses import replace
    from pathlib import Path

    def on_page(folder, file, commands):
        "The session after a file and commands were given to the page, recorded; and panels that failed."
        from workbench.arm.built_in_arms import load_robot
        from workbench.plate.plate_toml import load_plate
        from workbench.session.commands.data import LoadData
        from workbench.session.journal.folder import begin
        from workbench.views.page.app import App
        from workbench.views.recording.recorder import recorder

        robot, plate = load_robot("aria"), load_plate("table2")
        begun = begin(robot, plate, folder=Path(folder))
        begun = replace(begun, keepers=(*begun.keepers, recorder(Path(folder))))
        app = App(robot, plate, begun=begun)
        for command in (LoadData(file, Path(file).read_bytes()), *commands(robot)):
            app.worker.submit(command)
            assert app.worker.wait(120.0)
        session, failed = app.worker.session, app.view._failed
        app.close()
        return session, failed
    """
)
POINTS = {
    "columns": "weather.parts:HUMIDITY",
    "effects": "weather.parts:HumiditySwell",
    "observations": "weather.parts:HeightObservation",
}


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    folder = tmp_path_factory.mktemp("packages")
    install(folder, "weather", {"parts": dedent(WEATHER)}, {})
    points = "\n".join(f"[workbench.{group}]\n{group} = {home}\n" for group, home in POINTS.items())
    (folder / "weather-1.0.dist-info" / "entry_points.txt").write_text(points)
    return folder


@pytest.fixture(scope="module")
def here(package, tmp_path_factory):
    """Where and with what programs run."""
    return {"folder": tmp_path_factory.mktemp("home"), "packages": (package,)}


@pytest.fixture(scope="module")
def table(here):
    """80 rows of an arm whose second joint swells by 4 mrad, with the column as somebody else calls it."""
    text = "--poses 80 --effect humidity-swell:2:0.004 --seed 1 --out made.csv"
    commands(f"simulate --robot aria {text}", **here)
    made = (here["folder"] / "made.csv").read_text()
    head, _, rows = made.partition("\n")
    (here["folder"] / "rows.csv").write_text(f"{head.replace('humidity', 'Feuchte')}\n{rows}")
    return head.split(",")


@pytest.fixture(scope="module")
def diagnosed(here, table):
    """What commands say of the rows, and leave in the folder."""
    return commands(
        "preview rows.csv --save-mapping m.toml",
        "identify rows.csv --robot aria --algorithm ols --json i.json",
        "diagnose rows.csv --robot aria --json d.json --save s.toml",
        "evaluate rows.csv --robot s.toml",
        **here,
    )


def test_a_driver_is_written_read_previewed_mapped_and_found_by_the_diagnosis(here, table, diagnosed):
    folder = here["folder"]
    assert [end.status for end in diagnosed] == [0, 0, 0, 0], diagnosed
    assert table[table.index("humidity") - 1].startswith("qz")
    assert "humidity" in diagnosed[0].out
    assert 'Feuchte = "humidity"' in (folder / "m.toml").read_text()
    found = json.loads((folder / "d.json").read_text())
    (effect,) = found["effects"]
    assert (effect["name"], effect["joints"]) == ("humidity-swell", [2])
    assert effect["coefficients"][0]["value"] == pytest.approx(4e-3, rel=0.2)
    before = json.loads((folder / "i.json").read_text())["algorithms"]["ols"]["held_out"]
    assert found["after"]["held_out"]["position_mm"]["mean"] < 0.5 * before["position_mm"]["mean"]


@pytest.mark.extra("trajectories")
def test_a_row_without_it_and_a_file_without_it_are_told(here, diagnosed):
    code = """
        import numpy as np
        from dataclasses import replace
        import workbench as wb
        from workbench.base.columns import COLUMNS
        from workbench.data.readers.mapping import meanings
        rows = wb.read_measurements("rows.csv")
        arm = wb.load_robot("s.toml")
        both = rows.take(np.arange(3)).joined(replace(rows, more={}).take(np.arange(2)))
        print(np.isnan(both.more["humidity"]).tolist(), "humidity" in repr(rows), "humidity" in meanings(6))
        try:
            wb.evaluate(arm, replace(rows, more={}))
        except wb.WorkbenchError as error:
            print(error)
        from pathlib import Path
        q = [f"{','.join(map(str, row))},0.9" for row in rows.q[:3]]
        head = ",".join([*(f"q{j}[rad]" for j in range(1, 7)), "humidity"])
        Path("path.csv").write_text("\\n".join([head, *q]))
        wb.compensate("s.toml", "path.csv", nominal="aria")
        wet = wb.read_trajectory("path.csv")
        print(wet.drivers["humidity"].tolist(), COLUMNS["temperature"].label)
        """
    first, messages, last = python(code, **here).splitlines()
    assert first == "[False, False, False, True, True] True True"
    assert "humidity" in messages
    assert last == "[0.9, 0.9, 0.9] temperature [°C]"


@pytest.mark.extra("review")
def test_it_drives_the_page_its_journal_and_the_recording(here, table):
    code = """
        from workbench.session.commands.diagnose import AddEffects, Diagnose

        s, failed = on_page("rec", "rows.csv", lambda robot: (Diagnose(), AddEffects()))
        rows = s.measurements.loaded.dataset.more["humidity"]
        print([e.name for e in s.results.accepted], len(rows), failed)
        """
    assert python(ON_PAGE + dedent(code), **here) == "['humidity-swell'] 80 set()\n"
    assert [path for path in (here["folder"] / "rec").rglob("*.rrd") if path.stat().st_size > 10_000]
    (replayed,) = commands("replay rec", **here)
    assert (replayed.status, replayed.err) == (0, "")


@pytest.fixture(scope="module")
def heights(here):
    """Heights alone, by an arm whose third joint is 5 mrad off; a file as somebody else names its column."""
    code = """
        import numpy as np
        import workbench as wb

        arm = wb.load_robot("aria")
        q = np.random.default_rng(1).uniform(-1.0, 1.0, (60, 6))
        moved = arm.with_values({"joint3.theta": arm.values(("joint3.theta",))[0] + 5e-3})
        high = wb.tool_poses(moved, q)[:, 2, 3]
        np.savetxt(
            "heights.csv", np.column_stack([q, 1e3 * high]), delimiter=",", comments="", fmt="%.9f",
            header=",".join([*(f"q{j}[rad]" for j in range(1, 7)), "z_laser[mm]"]),
        )
        rows = wb.read_measurements("heights.csv")
        np.testing.assert_allclose(rows.column("height"), high, atol=1e-9)
        wb.write_measurements(rows, "again.csv")
        print("height[m]" in open("again.csv").read())
        """
    assert python(code, **here) == "True\n"


def test_an_observation_brings_its_column_into_the_command_line(here, heights):
    previewed, identified = commands(
        "preview heights.csv",
        "identify heights.csv --robot aria --free joint3.theta --frames shared --held-out 0.2 "
        "--algorithm ols --json h.json",
        **here,
    )
    assert (previewed.status, identified.status) == (0, 0), identified
    assert "height" in previewed.out
    found = json.loads((here["folder"] / "h.json").read_text())
    (constant,) = found["algorithms"]["ols"]["parameters"]
    assert constant["value"] - constant["nominal"] == pytest.approx(5e-3, abs=1e-6)


def test_it_is_identified_from_on_the_page_and_in_the_reopened_session(here, heights):
    code = """
        from workbench.arm.built_in_arms import load_robot
        from workbench.session.commands.identify import HoldParameter, Identify
        from workbench.session.journal.reader import read_recording
        from workbench.session.journal.restore import restore

        def chosen(robot):
            for name in robot.default_free:
                if name != "joint3.theta":
                    yield HoldParameter(name, True)
            yield Identify(("ols",), frames="shared")

        s, failed = on_page("high", "heights.csv", chosen)
        assert not failed, s.page.messages
        robot = load_robot("aria")
        opened = restore(read_recording(Path("high")))
        assert not opened.differences
        found = opened.session.results.identification
        off = found.robot.values(("joint3.theta",))[0] - robot.values(("joint3.theta",))[0]
        print(round(1e3 * off, 3), len(opened.session.measurements.loaded.dataset.column("height")))
        """
    assert python(ON_PAGE + dedent(code), **here) == "5.0 60\n"
    assert [path for path in (here["folder"] / "high").rglob("*.rrd") if path.stat().st_size > 10_000]
