"""The commands from end to end, and what they say to bad input: one sentence, and nothing written."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import mentions

from workbench import cli, load_robot, measure_poses, read_measurements, write_measurements, write_urdf
from workbench.base.files import write_text


@pytest.fixture(scope="session")
def measured(tmp_path_factory) -> Path:
    """A folder with `good.csv` (40 poses of a virtual ARIA) and its spoilt relatives' sources."""
    folder = tmp_path_factory.mktemp("measured")
    _, rows = measure_poses(load_robot("aria"), 40, seed=1)
    rows = replace(rows, sigma=None)
    write_measurements(rows, folder / "good.csv")
    turn = np.diag([-1.0, -1.0, 1.0])
    turned = replace(rows, position=rows.position @ turn.T, rotation=turn @ rows.rotation)
    write_measurements(turned, folder / "turned.csv")
    write_urdf(load_robot("aria"), folder / "aria.urdf")
    return folder


# -- whole runs -----------------------------------------------------------------------------------


def test_from_simulation_to_a_calibrated_urdf(run, told):
    """simulate → identify → evaluate → export → evaluate: the held-out error survives every step."""
    made = "--poses", 40, "--errors", "5mm,5deg", "--out", "d.csv", "--actual", "a.toml"
    assert run("simulate", "--robot", "aria", *made)[0] == 0
    fits = ("--algorithm", "ols,opt2", "--save", "c.toml")
    result, out = told("identify", "d.csv", "--robot", "aria", *fits)
    assert "OLS" in out
    assert (result["schema"], set(result["algorithms"])) == ("workbench.identification/1", {"ols", "opt2"})
    assert all(found["converged"] for found in result["algorithms"].values())
    assert (result["measurements"]["used"], result["measurements"]["held_out"]) == (32, 8)
    assert result["nominal"]["held_out"]["position_mm"]["mean"] > 5.0
    held_out = result["algorithms"]["ols"]["held_out"]["position_mm"]["mean"]
    assert held_out < 0.25
    errors = []
    assert run("export", "c.toml", "--urdf", "c.urdf", "--toml", "again.toml")[0] == 0
    for robot in ("c.toml", "again.toml", "c.urdf"):
        found, _ = told("evaluate", "d.csv", "--robot", robot)
        assert (found["schema"], len(found["rows"])) == ("workbench.evaluation/1", 40)
        errors.append(found["errors"]["position_mm"]["mean"])
    assert errors[0] < 0.2
    np.testing.assert_allclose(errors, errors[0], rtol=1e-5)


def test_hidden_effects_are_simulated(run, told):
    """An effect acts on the rows as it stands in the actual arm's file, and what drives it is written."""
    status, out, _ = run(
        *("simulate", "--robot", "aria", "--poses", 30, "--out", "d.csv", "--actual", "a.toml"),
        *("--effect", "joint-compliance:2:4e-5", "--effect", "thermal-growth", "--instrument", "ideal"),
    )
    assert status == 0
    assert mentions(out, "joint2.compliance 4e-05 rad/(N*m)")
    actual = load_robot("a.toml")
    assert set(actual.coefficients) == {"joint2.compliance", "arm.thermal_growth"}
    rows = read_measurements(Path("d.csv"), joints=6)
    assert len(set(rows.payload)) > 1
    assert np.ptp(rows.temperature) > 5.0
    plate = ("simulate", "--robot", "aria", "--plate", "table2", "--of", "a.toml", "--out", "p.csv")
    assert run(*plate, "--instrument", "ideal")[0] == 0
    for name in ("d.csv", "p.csv"):
        assert told("evaluate", name, "--robot", "a.toml")[0]["errors"]["position_mm"]["max"] < 1e-6


@pytest.mark.parametrize(
    ("given", "read"),
    [
        ([], ["serve"]),
        (["rows.csv", "--robot", "ur10"], ["serve", "--data", "rows.csv", "--robot", "ur10"]),
        (["My arm.URDF"], ["serve", "--robot", "My arm.URDF"]),
        (["identify", "rows.csv"], ["identify", "rows.csv"]),
        (["--help"], ["--help"]),
        (["--data=x.csv"], ["--data=x.csv"]),
    ],
)
def test_a_file_in_the_place_of_a_command_is_opened_in_the_app(given, read):
    assert cli.opened(given) == read


# -- bad input ------------------------------------------------------------------------------------


def spoilt(name: str, change) -> "callable":
    """A file of measurements made from a good one by a change of its lines."""

    def make(folder: Path) -> Path:
        lines = (folder / name).read_text().splitlines()
        return write_text(Path("bad.csv"), "\n".join(change(lines)) + "\n")

    return make


def cell(lines: list[str], row: int, column: str, value: str) -> list[str]:
    """The lines with one cell of a data row changed."""
    place = [name.split("[")[0] for name in lines[0].split(",")].index(column)
    cells = lines[1 + row].split(",")
    cells[place] = value
    return [*lines[: 1 + row], ",".join(cells), *lines[2 + row :]]


def in_degrees(lines: list[str]) -> list[str]:
    """Joint positions in the wrong unit under an unchanged heading."""
    numbers = [[float(v) for v in line.split(",")] for line in lines[1:]]
    return [lines[0], *(",".join(map(str, [*np.rad2deg(row[:6]), *row[6:]])) for row in numbers)]


GOOD = spoilt("good.csv", lambda lines: lines)
# each way in which a file is wrong: `tests/data`; here one of each kind of error, and what the robot refuses
BAD_DATA = {
    "no header": (spoilt("good.csv", lambda s: s[1:]), "aria", ["bad.csv", "--columns"]),
    "wrong joint count": (GOOD, "panda", ["bad.csv", "6", "7"]),
    "no number": (spoilt("good.csv", lambda s: cell(s, 3, "q2", "one")), "aria", ["bad.csv", "line 5", "q2"]),
    "degrees labelled rad": (spoilt("good.csv", in_degrees), "aria", ["bad.csv", "degrees", "q1[deg]"]),
    "turned base": (lambda home: home / "turned.csv", "aria", ["turned.csv", "17", "° about z", "[base]"]),
    "too few rows": (spoilt("good.csv", lambda s: s[:5]), "aria", ["bad.csv", "rows", "at least"]),
    "no such file": (lambda home: Path("none.csv"), "aria", ["none.csv"]),
    "unknown robot": (GOOD, "arai", ["arai", "aria"]),
}
SHOWN = ("turned base", "too few rows")
"""Errors of a given model are shown, whatever they are."""


@pytest.mark.parametrize(
    ("command", "case"),
    [
        *(("identify", case) for case in BAD_DATA),
        *(("evaluate", case) for case in BAD_DATA if case not in SHOWN),
    ],
)
def test_bad_data(refused, measured, command, case):
    make, robot, text = BAD_DATA[case]
    data = make(measured)
    options = ["--save", "c.toml"] if command == "identify" else []
    refused(text, command, data, "--robot", robot, "--json", "r.json", *options)


BAD_OPTIONS = {
    "unknown algorithm": (["--algorithm", "olz"], ["olz", "ols"]),
    "held-out share of one": (["--held-out", "1.0"], ["held-out", "1"]),
    "unknown frames": (["--frames", "mine"], ["mine", "auto"]),
    "unknown constant": (["--free", "joint9.theta"], ["joint9.theta"]),
    "rows in words": (["--exclude", "first-last"], ["first-last", "--exclude"]),
    "noise without unit": (["--noise", "0.05"], ["0.05", "unit"]),
}


@pytest.mark.parametrize("case", BAD_OPTIONS)
def test_bad_options(refused, measured, case):
    options, text = BAD_OPTIONS[case]
    data = measured / "good.csv"
    refused(text, "identify", data, "--robot", "aria", "--json", "r.json", *options)


@pytest.mark.parametrize("option", ["--save", "--json", "--report"])
@pytest.mark.parametrize("place", ["/proc/nowhere/x.json", "taken.csv/x.json"])
def test_unwritable_places(refused, measured, option, place):
    Path("taken.csv").write_text("a file, no folder")
    refused([place], "identify", measured / "good.csv", "--robot", "aria", option, place)
    refused(["its own"], "identify", rows := measured / "good.csv", "--robot", "aria", "--json", rows)


SIMULATE = "simulate --robot aria --out"
OTHER_COMMANDS = {
    "plate and poses": (f"{SIMULATE} d.csv", ["--plate", "--poses"]),
    "unknown instrument": (f"{SIMULATE} d.csv --poses 9 --instrument ruler", ["ruler", "tracker-6d"]),
    "nothing to export": ("export aria", ["--urdf", "--toml"]),
    "controller without nominal": ("export aria --controller c.json", ["--nominal"]),
}


@pytest.mark.parametrize("case", OTHER_COMMANDS)
def test_other_commands_refuse(refused, case):
    command, text = OTHER_COMMANDS[case]
    refused(text, *command.split())


@pytest.mark.parametrize("command", ["identify", pytest.param("diagnose", marks=pytest.mark.slow)])
def test_an_implausible_arm_is_not_written_unless_forced(run, command):
    """An arm whose second link is 60 mm longer than its file says."""
    robot = load_robot("aria")
    longer = robot.with_values({"joint2.a": 0.47})
    _, rows = measure_poses(robot, 60, actual=longer, seed=4)
    write_measurements(rows, Path("long.csv"))
    status, _, err = run(command, "long.csv", "--robot", "aria", "--save", "arm.toml")
    assert status == 2
    assert "joint2.a" in err
    assert not Path("arm.toml").exists()
    status, _, _ = run(command, "long.csv", "--robot", "aria", "--save", "arm.toml", "--force")
    assert status == 2
    assert load_robot("arm.toml").values(("joint2.a",))[0] == pytest.approx(0.47, abs=2e-4)
