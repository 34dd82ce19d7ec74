"""What is saved is what was on the screen: every file evaluated by other code (`round_trip.py`).

Of each set of measurements an arm is identified and diagnosed by each entrance: Python, command, page. The
error of the file, from its own numbers on the rows of the set, is the one that was shown.
"""

import json
import re
import tomllib
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import round_trip as trip
from generator import VirtualArm, aria, seven, three_parallel
from real_arms import SETS

import workbench as wb
from tests.exports import readers
from tests.session.direct_commands import done
from workbench.arm.robot_toml import robot_text
from workbench.cli.exit_status import UNUSABLE
from workbench.exports import FORMS, Job, export_robot
from workbench.identification.result import Identification
from workbench.identification.run import file_text, refitted_errors
from workbench.session import start
from workbench.session.commands.data import LoadData
from workbench.session.commands.diagnose import AddEffects, Diagnose
from workbench.session.commands.identify import Identify
from workbench.session.export import calibrated_toml, calibrated_urdf

MICRON, TURN = 1e-6, np.deg2rad(1e-4)
MAX_ROWS = 250
"""Rows of a real set that are taken, evenly spread."""


# Sets ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Measured:
    """A robot and rows of it, as files or built-in names."""

    robot: str
    path: Path

    @property
    def rows(self) -> trip.Rows:
        return trip.read_rows(self.path)


def virtual(nominal: VirtualArm, folder: Path, *, seed: int, turned: bool) -> Measured:
    """A soft arm with errors, measured through a free base and tool."""
    rng = np.random.default_rng(seed)
    base, tool = (trip.placed(rng.uniform(-0.3, 0.3, 3), [0.1, 0.0, yaw]) for yaw in (0.4, 0.0))
    tool[:3, 3] = 0.03, -0.02, 0.12
    arm = replace(nominal.perturbed(rng, length=1e-3, angle=2e-3), base=base, tool=tool)
    limits = np.tile([-2.0, 2.0], (arm.dof, 1)) if arm.limits is None else arm.limits.clip(-2.5, 2.5)
    q = replace(arm, limits=limits).random(rng, 110)
    position, rotation = arm.measure(q, rng, 2e-5, 1e-4, arm.sag(q, compliance=4e-5))
    rows = replace(trip.rows_of(q), position=position, rotation=rotation if turned else None)
    trip.write_rows(folder / "rows.csv", rows)
    (folder / "robot.toml").write_text(nominal.toml(free='"auto"'))
    return Measured(str(folder / "robot.toml"), folder / "rows.csv")


VIRTUAL = {"aria": (aria, 1, True), "reflector": (three_parallel, 2, False), "seven": (seven, 3, False)}


def real(name: str, shared: Path, folder: Path) -> Measured:
    """A real set, thinned where it is large."""
    place, robot = SETS[name]
    head, lines = trip.thinned(shared / place / "measurements.csv", MAX_ROWS)
    (folder / "rows.csv").write_text("\n".join([head, *lines]) + "\n")
    return Measured(robot, folder / "rows.csv")


@cache
def named(name: str, shared: Path | None, place: Path) -> Measured:
    """Once for all tests, those of forms too: what is fitted to it is fitted once."""
    folder = place / f"round-trip-{name}"
    folder.mkdir()
    if shared is not None:
        return real(name, shared, folder)
    make, seed, turned = VIRTUAL[name]
    return virtual(make(), folder, seed=seed, turned=turned)


REAL = ("wam",)


def marked(name: str, *others: str):
    """A set, and what it is combined with."""
    marks = {"seven": [pytest.mark.slow], "reflector": [pytest.mark.slow], "wam": [pytest.mark.data]}
    return pytest.param(name, *others, marks=marks.get(name, []))


@pytest.fixture(scope="module", params=map(marked, [*VIRTUAL, *REAL]))
def measured(request, tmp_path_factory) -> Measured:
    shared = None if request.param in VIRTUAL else request.getfixturevalue("shared_data")
    return named(request.param, shared, tmp_path_factory.getbasetemp())


# Entrances ----------------------------------------------------------------------------------------------


@cache
def saved_in_python(measured: Measured, diagnosed: bool) -> trip.Saved:
    """Once for this entrance and all formats."""
    folder = measured.path.with_name(f"python-{diagnosed}")
    folder.mkdir()
    robot, data = wb.load_robot(measured.robot), wb.read_measurements(measured.path)
    result = wb.diagnose(robot, data) if diagnosed else wb.identify(robot, data)
    found = result.identification() if diagnosed else result
    assert (
        not diagnosed or result.after.fit.outcome.ok
    )  # balls in sockets show no turn: 60 steps were too few
    files = [Path(result.robot.save(folder / f"arm.{kind}")) for kind in ("toml", "urdf")]
    to_the_last_digit(found, *files, measured.rows)
    return trip.Saved(*files, file_text(found.best), found.held_out_data.row, refitted_rows(found))


def refitted_rows(found: Identification) -> np.ndarray | None:
    return None if found.best.before_refit is None else found.best.fit.problem.data.row


def to_the_last_digit(found: Identification, toml: Path, urdf: Path, rows: trip.Rows) -> None:
    """What is shown rounded, exactly; and the record in the file is the number that was shown."""
    saved = trip.Saved(toml, urdf, "", found.held_out_data.row, refitted_rows(found))
    own = refitted_errors(found.best) or found.best.file_errors
    numbers = saved.held_out if saved.refitted is None else saved.refitted
    for name, path in (("TOML", toml), ("URDF", urdf)):
        file = trip.errors(saved.arm(path), rows.take(numbers))
        assert 1e-3 * own[name].position_mm.mean == pytest.approx(file.position, abs=1e-9)
        if rows.rotation is not None:
            assert np.deg2rad(own[name].orientation_deg.mean) == pytest.approx(file.rotation, abs=1e-9)
    record = trip.toml_arm(toml.read_text()).table["calibration"]
    assert record["error"][0] == pytest.approx(1e-3 * found.error.after.position_mm.mean, abs=1e-12)
    if found.robot.effects:  # what `export` says of the URDF then
        alone = found.best.file_errors["URDF"].position_mm.mean
        assert record["geometry_error"][0] == pytest.approx(1e-3 * alone, abs=1e-12)


def by_command(measured: Measured, folder: Path, *, diagnosed: bool, run: Callable, **_) -> trip.Saved:
    verb = "diagnose" if diagnosed else "identify"
    toml, urdf = folder / "arm.toml", folder / "arm.urdf"
    options = ("--save", toml, "--force", "--json", folder / "r.json")
    code, out, err = run(verb, measured.path, "--robot", measured.robot, *options)
    assert code in (0, UNUSABLE), err
    assert run("export", toml, "--urdf", urdf)[0] == 0
    found = json.loads((folder / "r.json").read_text())
    line = " ".join(out.split("mean error of the files on ")[1].split())
    rows = found["measurements"]
    numbers, held_out = np.arange(len(measured.rows)), np.array(rows["held_out_rows"])
    refitted = None
    if "after the final fit" in line:
        apart = [*(row["row"] for row in rows["excluded"]), *rows["outliers"], *found["suspects"]]
        refitted = np.setdiff1d(numbers, apart)
    if not diagnosed:
        shown = found["algorithms"][re.search(r"calibrated robot \((\w+)\)", out)[1].lower()]
        file = trip.errors(trip.read_arm(toml), measured.rows.take(held_out))
        assert shown["held_out"]["position_mm"]["mean"] == pytest.approx(1e3 * file.position, abs=1e-6)
    return trip.Saved(toml, urdf, line, held_out, refitted)


def on_the_page(measured: Measured, folder: Path, *, diagnosed: bool, **_) -> trip.Saved:
    """The commands that the page sends, and the files behind its buttons."""
    content = measured.path.read_bytes()
    commands = [LoadData(measured.path.name, content), Identify()]
    commands += [Diagnose(), AddEffects()] if diagnosed else []
    session = done(start(wb.load_robot(measured.robot), wb.load_plate("table2")), *commands)
    paths = []
    for make, kind in ((calibrated_toml, "toml"), (calibrated_urdf, "urdf")):
        paths.append(folder / f"arm.{kind}")
        paths[-1].write_bytes(make(session)[1])
    found = session.results.identification
    text = file_text(found.runs[session.results.fit])
    return trip.Saved(*paths, text, found.held_out_data.row, refitted_rows(found))


ENTRANCES = {
    "python": lambda measured, _, diagnosed, **__: saved_in_python(measured, diagnosed),
    "command": by_command,
    "page": on_the_page,
}
OTHERS = [("aria", "command"), ("aria", "page")]
"""By the quickest entrance every set, by the others one, which is diagnosed by all in the slow tests."""
ENTERED = [marked(*each) for each in product((*VIRTUAL, *REAL), ["python"], [False, True])]
ENTERED += [pytest.param(*each, d, marks=[pytest.mark.slow] * d) for each in OTHERS for d in (False, True)]


@pytest.mark.parametrize(("measured", "entrance", "diagnosed"), ENTERED, indirect=["measured"])
def test_each_file_leaves_what_was_shown(measured, entrance, diagnosed, run, tmp_path):
    saved = ENTRANCES[entrance](measured, tmp_path, diagnosed=diagnosed, run=run)
    saved.check(measured.rows)


NO_WORSE = 1.02
"""Ratio of errors that counts as none: rows fitted and held out weigh a little differently."""


def test_without_its_effects_a_diagnosis_leaves_no_more_than_geometry_alone(measured):
    alone, diagnosed = (saved_in_python(measured, d) for d in (False, True))
    left = [trip.errors(files.arm(files.urdf), measured.rows) for files in (alone, diagnosed)]
    assert left[1].position < NO_WORSE * left[0].position
    if measured.rows.rotation is not None:
        assert left[1].rotation < NO_WORSE * left[0].rotation


def test_masses_and_gravity_leave_as_they_were_given(measured):
    """What was fitted of them for an effect of load stands under the effect, and is read from there."""
    files, robot = saved_in_python(measured, True), wb.load_robot(measured.robot)
    given, found = (tomllib.loads(text) for text in (robot_text(robot), files.toml.read_text()))
    assert found["gravity"] == given["gravity"]
    for mine, own in zip(found["joint"], given["joint"], strict=True):
        assert [mine.get(k) for k in ("mass", "com")] == [own.get(k) for k in ("mass", "com")]
    again = tomllib.loads(robot_text(wb.load_robot(str(files.toml))))
    assert all(again.get(key) == found.get(key) for key in ("joint", "effect", "gravity"))
    nodes = ET.fromstring(files.urdf.read_text()).findall("link/inertial")
    masses = [float(node.find("mass").get("value")) for node in nodes]
    assert masses == [j["mass"] for j in given["joint"] if j.get("mass")]
    assert all(float(node.find("inertia").get(k)) > 0.0 for node in nodes for k in ("ixx", "iyy", "izz"))


# Formats ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=[False, True], ids=["identify", "diagnose"])
def saved(request, measured) -> tuple[Measured, trip.Saved]:
    return measured, saved_in_python(measured, request.param)


def at_observed(saved: trip.Saved) -> tuple[trip.Rows, trip.Poses]:
    """The poses that the file keeps, and its arm there in its first session."""
    arm = trip.toml_arm(saved.toml.read_text())
    rows = trip.rows_of(np.array(arm.table["calibration"]["observed"]["q"]))
    first = arm.table["session"][0]["name"] if arm.table.get("session") else ""
    rows = replace(rows, session=np.full(len(rows), first))
    driven = [e for e in arm.effects if e.get("by") != "motion"]
    return rows, replace(arm, effects=driven)(rows)


def typed_tool(notes: tuple[str, ...]) -> np.ndarray | None:
    """The tool frame that a note says to enter."""
    for note in notes:
        if found := re.search(r"\(TCP\) ([-\d., ]+) mm, rotation vector ([-\d., ]+) rad", note):
            xyz, turn = (np.array([float(v) for v in part.split(",")]) for part in found.groups())
            size = float(np.linalg.norm(turn))
            axis = turn / size if size > 0.0 else np.array([0.0, 0.0, 1.0])
            pose = trip.moved(axis, np.array([size]), turns=True)[0]
            pose[:3, 3] = 1e-3 * xyz
            return pose
    return None


def test_a_joint_table_is_as_far_from_the_calibrated_arm_as_it_says(saved, tmp_path):
    measured, files = saved
    job = Job(robot=wb.load_robot(str(files.toml)), nominal=wb.load_robot(measured.robot))
    written = export_robot(FORMS["dh-csv"], tmp_path / "arm.csv", job)
    rows, (_, wanted) = at_observed(files)
    urdf, tool = trip.urdf_arm(files.urdf.read_text()), typed_tool(written.notes)
    arm = readers.spreadsheet(written.path.read_text())
    found = trip.frames_arm(arm, urdf if tool is None else replace(urdf, tool=tool))(rows)[1]
    geometry = trip.read_arm(files.urdf)(rows)[1]
    assert trip.pose_difference(found, wanted)[0] == pytest.approx(written.position, abs=MICRON)
    assert trip.pose_difference(found, geometry) < (MICRON, TURN)
    if measured.rows.rotation is not None:
        assert trip.pose_difference(found, wanted)[1] == pytest.approx(written.rotation, abs=TURN)


def test_numbers_for_a_controller_leave_what_they_say(saved, run, tmp_path):
    """Offsets added to the readings of the nominal arm, on the base and with the tool that were advised."""
    measured, files = saved
    path = tmp_path / "controller.json"
    code, *_ = run("export", files.toml, "--controller", path, "--nominal", measured.robot)
    variants = json.loads(path.read_text())["controller"]
    nominal = trip.toml_arm(robot_text(wb.load_robot(measured.robot).with_effects()))
    rows, (_, wanted) = at_observed(files)
    assert (code == 0) == any(v["advised"] for v in variants)
    for numbers in variants:
        moved = replace(rows, q=rows.q + np.array(numbers["offsets"]))
        flange = nominal(moved)[0]
        base, tool = (trip.placed(numbers[k]["xyz"], numbers[k]["rpy"]) for k in ("base", "tool"))
        missed = np.linalg.norm((base @ flange @ tool)[:, :3, 3] - wanted[:, :3, 3], axis=1)
        message = numbers["remains"]["position_mm"]
        assert (1e3 * missed.mean(), 1e3 * missed.max()) == pytest.approx(
            (message["mean"], message["max"]), abs=1e-3
        )
        if measured.rows.rotation is not None:
            turned = np.rad2deg(trip.angle(base @ flange @ tool, wanted)).mean()
            assert turned == pytest.approx(numbers["remains"]["orientation_deg"]["mean"], abs=1e-4)
