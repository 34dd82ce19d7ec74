"""Rows of another arm are refused before a fit; another robot can be changed to, and undone."""

import re
from dataclasses import replace

import numpy as np
import pytest
from checks import with_errors
from refusals import mentions

from workbench import WorkbenchError, evaluate, load_robot, measure_poses, write_measurements
from workbench.identification.checks.arm_match import arm_match
from workbench.session.commands.arm import ChooseRobot
from workbench.session.commands.compare import ShowRow
from workbench.session.commands.data import LoadData, MeasureVirtualArm
from workbench.session.commands.diagnose import Diagnose
from workbench.session.commands.identify import Identify
from workbench.session.commands.undo import Redo, Undo
from workbench.session.export import calibrated_toml, measurements_csv
from workbench.session.next_step import Tone, next_step
from workbench.session.page_state import Severity
from workbench.session.state import WHOLE
from workbench.session.target_steps import begin_step
from workbench.views.drawables.arms import arms
from workbench.views.page.panels.row_errors import exclude


@pytest.fixture(scope="module")
def ur5_rows():
    nominal = load_robot("ur5")
    return measure_poses(nominal, 40, actual=with_errors(nominal, 1e-3), seed=2)[1]


@pytest.fixture(scope="module")
def ur5_file(ur5_rows, tmp_path_factory):
    return write_measurements(ur5_rows, tmp_path_factory.mktemp("rows") / "ur5.csv").read_bytes()


@pytest.mark.parametrize("mistaken", ["position", "q"])
def test_rows_with_other_units_than_the_rest_are_named(ur5_rows, mistaken):
    """They bent base and tool so far that all rows were called another arm's."""
    values = getattr(ur5_rows, mistaken).copy()
    values[10:22] *= 1e-3 if mistaken == "position" else np.rad2deg(1.0)
    found = arm_match(load_robot("ur5"), replace(ur5_rows, **{mistaken: values}))
    assert found.is_foreign
    assert mentions(found.text, "12 rows (10–21) don't fit the others", "exclude")


def test_the_page_refuses_to_fit_another_arms_rows_and_offers_that_arm(do, ur5_file):
    loaded = do(LoadData("ur5.csv", ur5_file))
    assert loaded.page.messages[-1].severity is Severity.WARNING
    assert mentions(loaded.page.messages[-1].text, "UR5 (CB3)")
    step = next_step(loaded)
    assert step.next.command == ChooseRobot("ur5", keep=True)
    refused = do(Identify())
    assert refused.results.identification is None
    assert refused.page.messages[-1].severity is Severity.ERROR
    changed = do(step.next.command, Identify(("opt2",)))
    assert changed.robot.name == load_robot("ur5").name
    assert len(changed.measurements.loaded.dataset) == 40
    assert not changed.measurements.loaded.is_foreign
    assert all(m.severity is not Severity.WARNING for m in changed.page.messages)  # gone with its cause
    assert not changed.results.identification.foreign
    assert not changed.results.identification.best.implausible


def test_what_was_fitted_all_the_same_is_called_implausible(do, ur5_file):
    session = do(LoadData("ur5.csv", ur5_file), Identify(("opt2",), anyway=True))
    assert mentions(session.results.identification.warnings[0], "UR5 (CB3)")
    with pytest.raises(WorkbenchError, match="implausible"):
        calibrated_toml(session)
    assert calibrated_toml(session, force=True)[1]  # as 'Save anyway' does
    assert next_step(session).tone is Tone.CAREFUL
    assert next_step(session).sentence.startswith("Implausible")


def test_another_robot_has_its_own_plate_and_undo_brings_everything_back(do):
    before = do(MeasureVirtualArm(3), Identify(("opt2",)))
    other = do(ChooseRobot("ur5"))
    assert (other.plate.name, other.measurements.loaded) == ("Circle", None)
    back = do(Undo())
    parts = ("robot", "plate", "states", "measurements", "results")
    assert [part for part in parts if getattr(back, part) is not getattr(before, part)] == []
    assert do(Redo()).robot is other.robot
    for _ in range(WHOLE + 2):
        back = begin_step(back, is_whole=True)
    assert sum(step.session is not None for step in back.history.done) == WHOLE
    assert do(ChooseRobot("aria")).plate.name == "Table 2"
    assert np.array_equal(do(Undo()).plate.poses, other.plate.poses)


def test_rows_of_an_arm_with_more_joints_offer_that_arm_too(do):
    """A stranger's way: the arm that is open at first has six joints, the file seven."""
    arm = load_robot("panda")
    q = np.random.default_rng(1).uniform(*arm.limits.T, (30, 7))
    rows = [",".join(f"q{i}[rad]" for i in range(1, 8)) + ",x[m],y[m],z[m]"]
    rows += [",".join(f"{v:.9f}" for v in (*a, *p)) for a, p in zip(q, arm.predict(q)[:, :3, 3], strict=True)]
    loaded = do(LoadData("seven.csv", "\n".join(rows).encode()))
    assert loaded.measurements.loaded is None
    step = next_step(loaded)
    assert mentions(step.sentence, "6 joints, not 7", "Franka Emika Panda")
    assert step.tone is Tone.BAD
    assert step.next.command == ChooseRobot("panda", keep=True)  # not the FR3, outside whose limits some are
    changed = do(step.next.command)
    assert changed.robot.name == arm.name
    assert len(changed.measurements.loaded.dataset) == 30
    assert changed.measurements.unread is None
    assert next_step(changed).next.label == "Identify the geometry"
    own = do(ChooseRobot("aria"), MeasureVirtualArm(1), LoadData("seven.csv", "\n".join(rows).encode()))
    assert own.measurements.loaded.virtual  # what is there stays, and so does the way on from it
    assert next_step(own).other.command == ChooseRobot("panda", keep=True)


def test_a_row_that_no_arm_explains_is_red_in_the_scene(do, tmp_path):
    _, rows = measure_poses(load_robot("aria"), 60, seed=0)
    position = rows.position.copy()
    position[17] += [0.0, 0.05, 0.0]
    path = write_measurements(replace(rows, position=position), tmp_path / "rows.csv")
    session = do(LoadData("rows.csv", path.read_bytes()), Identify(("opt2",)))
    found = session.results.identification
    assert {outlier.row for outlier in found.outliers} | set(found.suspects) == {17}
    rows = session.results.comparison
    assert rows.measured[rows.set_apart] == pytest.approx(position[[17]], abs=1e-6)
    assert rows.number[rows.kept_out].tolist() == [outlier.row for outlier in found.outliers]
    there = do(ShowRow(int(np.flatnonzero(rows.number == 17)[0])))
    assert (exclude(there) is None) == bool(found.outliers)  # it is out already
    bent = {item.path: item for item in arms(there)}["arm/calibrated"]
    assert bent.inputs[4] is None  # 50 mm are the reading's, not the arm's
    name, content = measurements_csv(there)
    assert (name, content.count(b"true")) == ("rows-in-rad-and-m.csv", len(found.outliers))
    after = do(Diagnose()).results.identification.outliers  # of which something is to be done
    assert [outlier.row for outlier in after] == [outlier.row for outlier in found.outliers]


@pytest.mark.parametrize(
    "wrong",
    [
        {"q1[rad]": "q2[rad]", "q2[rad]": "q1[rad]"},
        {f"q{k}[rad]": f"q{k}[deg]" for k in range(1, 7)},
        {"x[m]": "z[m]", "z[m]": "x[m]"},
    ],
)
def test_headings_that_are_wrong_are_corrected_by_one_click(do, ur5_file, wrong):
    """The file's own rows come back, whatever stood above them."""
    do(ChooseRobot("ur5"))
    right = do(LoadData("rows.csv", ur5_file)).measurements.loaded.dataset
    head, rest = ur5_file.decode().split("\n", 1)
    assert set(wrong) <= set(head.split(","))
    head = ",".join(wrong.get(name, name) for name in head.split(","))
    session = do(LoadData("rows.csv", f"{head}\n{rest}".encode()))
    assert session.measurements.loaded.is_foreign
    corrected = do(next_step(session).next.command)
    assert not corrected.measurements.loaded.is_foreign
    np.testing.assert_allclose(corrected.measurements.loaded.dataset.q, right.q, atol=1e-12)
    np.testing.assert_allclose(corrected.measurements.loaded.dataset.position, right.position, atol=1e-12)


def test_degrees_labelled_rad_are_read_so_by_one_click_or_all_named(do, ur5_rows, tmp_path):
    turned = write_measurements(replace(ur5_rows, q=np.rad2deg(ur5_rows.q)), tmp_path / "r.csv").read_bytes()
    read = do(next_step(do(ChooseRobot("ur5"), LoadData("r.csv", turned))).next.command)
    np.testing.assert_allclose(read.measurements.loaded.dataset.q, ur5_rows.q, atol=1e-12)
    mixed = do(LoadData("r.csv", turned.replace(b"q1[rad]", b"q1[deg]")))
    assert "write q2[deg], q3[deg], q4[deg], q5[deg], q6[deg] in" in mixed.page.messages[-1].text


def test_units_that_a_file_lacks_are_told_by_its_rows_or_asked_for(do, ur5_file):
    bare = re.sub(rb"\[\w+\]", b"", ur5_file)
    with_units = do(ChooseRobot("ur5"), LoadData("ur5.csv", ur5_file)).measurements.loaded.dataset
    rows = do(LoadData("bare.csv", bare)).measurements.loaded.dataset
    assert not rows.missing_units
    assert np.array_equal(rows.q, with_units.q)
    asked = do(LoadData("few.csv", b"".join(bare.splitlines(keepends=True)[:5])))
    assert asked.measurements.unread.name == "few.csv"
    assert mentions(asked.page.messages[-1].text, "the unit is missing")


def test_the_arm_counts_its_joints_as_the_rows_that_are_read_so(do, ur5_rows, tmp_path):
    """What is saved then meets the file, as with `--reading found`."""
    path = write_measurements(replace(ur5_rows, q=ur5_rows.q * [-1.0, 1, 1, 1, 1, 1]), tmp_path / "r.csv")
    read = do(ChooseRobot("ur5"), LoadData("r.csv", path.read_bytes()))
    session = do(next_step(read).next.command, Identify())
    assert np.array_equal(session.measurements.loaded.dataset.q[:, 0], -ur5_rows.q[:, 0])
    saved = tmp_path / "saved.toml"
    saved.write_bytes(calibrated_toml(session)[1])
    errors = evaluate(load_robot(saved), path).errors
    assert errors.position_mm.mean < 0.5
