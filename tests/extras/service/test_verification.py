"""Verification on fresh poses: AP and RP by hand, intervals, what the calibration used, pass or fail."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from points_and_tilts import DH, points, write_mixed
from refusals import mentions, refuses

import workbench as wb
from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.data.accuracy_requirement import Wanted
from workbench.data.prediction import row_components
from workbench.extras.service.verification import RepeatedPose, mean_interval


@pytest.fixture(scope="module")
def arm():
    """A virtual ARIA, calibrated, with the rows that did it, and as many fresh ones of the same arm."""
    actual, rows = wb.measure_poses(wb.load_robot("aria"), 30, seed=1)
    calibrated = wb.identify(wb.load_robot("aria"), rows, algorithms=("opt2",), held_out=0).robot
    return calibrated, rows, wb.measure_poses(wb.load_robot("aria"), 70, seed=2, actual=actual)[1]


# -- AP, RP and intervals -------------------------------------------------------------------------


def test_accuracy_and_repeatability_by_hand():
    """l = 1, 1, 2, 2 mm: mean 1.5 mm, S = √(4 · 0.25 / 3) = 0.57735 mm."""
    pose = RepeatedPose.of(np.arange(4), 1e-3 * np.array([[4, 4, 0], [2, 4, 0], [3, 6, 0], [3, 2, 0]]))
    assert 1e3 * pose.accuracy == pytest.approx(5.0)
    assert 1e3 * pose.repeatability == pytest.approx(1.5 + 3 * 0.57735, rel=1e-5)


@pytest.mark.data
def test_repeated_poses_of_a_measured_arm(shared_data):
    """Pairs of the UR10's grid that end in the same joints: half their distance, from the file by hand."""
    with (shared_data / "ur10_ipa" / "measurements.csv").open() as file:
        table = np.array([[float(cell) for cell in row[:12]] for row in list(csv.reader(file))[1:]])
    q, place = table[:, :6], table[:, 6:9]
    pairs = np.array([(i, j) for i, j in zip(range(len(q) - 9), range(9, len(q)), strict=True)])
    pairs = pairs[np.abs(q[pairs[:, 0]] - q[pairs[:, 1]]).max(1) < 8e-4]
    rows = pairs.ravel()
    assert len(pairs) > 50
    data = wb.Dataset(q[rows], place[rows], se3.rpy_to_matrix(np.deg2rad(table[rows, 9:])), row=rows)
    found = wb.verify(wb.load_robot("ur10"), data, fit_frames=True)
    assert [pose.rows.tolist() for pose in found.repeated] == pairs.tolist()
    commands = wb.tool_poses(found.evaluation.robot, q[rows])[:, :3, 3].reshape(-1, 2, 3)
    off = place[pairs] - commands
    repeatability = [pose.repeatability for pose in found.repeated]
    np.testing.assert_allclose(repeatability, np.linalg.norm(off[:, 0] - off[:, 1], axis=1) / 2)
    np.testing.assert_allclose([p.accuracy for p in found.repeated], np.linalg.norm(off.mean(1), axis=1))
    assert 5e-6 < np.median(repeatability) < 1e-4  # its data sheet says ±0.1 mm


def test_intervals_of_means_agree_with_the_normal_law():
    errors = np.abs(np.random.default_rng(1).normal(1.0, 0.1, 400))
    found = mean_interval(errors, np.arange(400), np.random.default_rng(0))
    half = 1.96 * errors.std(ddof=1) / 20.0
    np.testing.assert_allclose(found, [errors.mean() - half, errors.mean() + half], atol=0.1 * half)


def test_visits_of_a_pose_are_one_pose():
    """A pose that is measured a hundred times says nothing of the others."""
    errors, pose = np.repeat([1.0, 2.0, 3.0], 100), np.repeat([0, 1, 2], 100)
    low, high = mean_interval(errors, pose, np.random.default_rng(0))
    assert low < 1.4 < 2.6 < high


# -- which rows count -----------------------------------------------------------------------------


def test_poses_of_the_calibration_are_left_out(arm):
    calibrated, rows, fresh = arm
    found = wb.verify(calibrated, fresh.joined(rows))
    assert len(found.pose) == 70
    jaw = replace(fresh, q=np.insert(fresh.q, fresh.joints, np.linspace(0.0, 0.4, 70), axis=1))
    assert wb.verify(calibrated, jaw).position == found.position
    exchanged = replace(fresh.joined(rows), q=fresh.joined(rows).q[:, [0, 1, 2, 4, 3, 5]])
    assert wb.verify(calibrated, exchanged, reading="found").position == found.position
    assert mentions(found.warnings[0], "30 rows")
    with pytest.raises(DataError, match="used"):
        wb.verify(calibrated, rows)
    assert "records no poses" in wb.verify(replace(calibrated, calibration=None), fresh).warnings[0]


def test_rows_tell_units_that_a_file_lacks(arm, tmp_path):
    """Degrees and millimetres, to `verify` and to `rezero`."""
    calibrated, _, fresh = arm
    numbers = np.column_stack([np.rad2deg(fresh.q), 1e3 * fresh.position])
    np.savetxt(tmp_path / "r.csv", numbers, delimiter=",", header="q1,q2,q3,q4,q5,q6,x,y,z", comments="")
    bare, told = wb.read_measurements(tmp_path / "r.csv"), wb.Dataset(fresh.q, fresh.position)
    found = ([do(calibrated, d) for d in (bare, told)] for do in (wb.verify, wb.rezero))
    (seen, known), (moved, same) = found
    assert seen.evaluation.errors.position == pytest.approx(known.evaluation.errors.position, abs=1e-7)
    assert [s.shift for s in moved.shifts] == pytest.approx([s.shift for s in same.shifts], abs=1e-6)


def test_a_row_that_stands_twice_is_no_second_visit(arm):
    """Row 3 is excluded and stands again at the end: only that copy is there to be judged."""
    calibrated, _, fresh = arm
    twice = fresh.take(np.r_[np.arange(len(fresh)), [3, 7]])
    found = wb.verify(calibrated, twice)
    assert (len(found.pose), found.repeated) == (len(fresh), ())
    assert mentions(" ".join(found.evaluation.notes), "2 duplicate rows")
    exclude = np.arange(len(twice)) == 3
    found = wb.verify(calibrated, replace(twice, exclude=exclude, row=np.arange(len(twice))))
    assert found.evaluation.data.row.tolist() == [*range(3), *range(4, 71)]


# -- verdict --------------------------------------------------------------------------------------


def test_pass_and_fail(arm):
    calibrated, _, fresh = arm
    worst = float(wb.evaluate(calibrated, fresh).errors.position.max())
    passed = wb.verify(calibrated, fresh, wanted=1.01 * worst)
    assert (passed.passed, "Passed" in passed._repr_html_()) == (True, True)
    failed = wb.verify(calibrated, fresh, wanted=0.99 * worst)
    assert failed.verdict.startswith("Failed: 1 of 70 measurements of 70 fresh poses")
    assert mentions(failed.verdict, f"row {int(wb.evaluate(calibrated, fresh).errors.position.argmax())}")
    assert mentions(failed.warnings[0], "70 different poses")  # fewer than 100
    for off, said in ((0.025, ["not 43.3 mm"]), ([0, 0, 5e-3], ["another base", "5.00 mm"])):  # a tripod's
        moved = wb.verify(calibrated, replace(fresh, position=fresh.position + np.array(off)), wanted=1e-3)
        assert mentions(" ".join(moved.warnings), "--frames fit", *said)
    turned = wb.verify(calibrated, replace(fresh, rotation=fresh.rotation @ np.diag([1.0, -1.0, -1.0])))
    assert mentions(" ".join(turned.warnings), "--frames fit", "180°")  # another frame of the flange
    assert wb.verify(calibrated, fresh).passed is None
    assert not wb.verify(calibrated, fresh, wanted=Wanted(position=1.0, rotation=1e-6)).passed
    for wanted in (0.0, "large"):
        with refuses(OptionError, option="wanted"):
            wb.verify(calibrated, fresh, wanted=wanted)


@pytest.mark.parametrize(("real", "other", "near"), [("ur10e", "ur10", 1.8), ("ur5e", "ur5", 0.2)])
def test_a_sister_arm_neither_passes_nor_fails(real, other, near):
    q = np.random.default_rng(0).uniform(1.0 - near, 1.0 + near, (40, 6))
    rows = wb.Dataset(q=q, position=wb.load_robot(real).predict(q)[:, :3, 3])
    found = wb.verify(wb.load_robot(other), rows, wanted=1.0)
    assert mentions(found.verdict, f"No verdict: the arm is UR{real[2:]}", f"choose the robot '{real}'")
    assert found.passed is False


def test_limits_per_axis_are_judged_axis_by_axis(arm):
    calibrated, _, fresh = arm
    largest = np.abs(row_components(calibrated, fresh).position).max(axis=1)
    limit = float(np.median(largest))
    found = wb.verify(calibrated, fresh, wanted=Wanted(position=limit, per_axis=True))
    assert found.within.tolist() == (largest <= limit).tolist()
    assert (found.evaluation.errors.position[found.within] > limit).any()  # longer than any of its entries


# -- points and inclinometers in one table --------------------------------------------------------


def test_the_measured_positions_alone_are_judged(run, told, tmp_path):
    """Ten points, whatever 30 inclinometer rows say."""
    q, xyz, _ = write_mixed(tmp_path)
    off = 1e3 * np.linalg.norm(points(DH, q) - xyz, axis=1)[:10]
    options = ("verify", "mixed.csv", "--robot", "arm.toml")
    found, out = told(*options, "--wanted", f"{1.01 * off.max()}mm,0.5deg")
    assert mentions(out, "Passed", "10 of 40", "0 of 10 rows have a measured orientation")
    assert (found["rows"], found["poses"], found["reading"]) == (10, 10, "as given")
    assert found["errors"]["position_mm"]["mean"] == pytest.approx(off.mean(), rel=1e-6)
    assert found["errors"]["orientation_deg"] is None
    assert found["intervals"]["orientation_deg"] is None
    low, high = found["intervals"]["position_mm"]["mean"]
    assert off.min() < low < off.mean() < high < off.max()
    found, said = told(*options, "--wanted", f"{0.99 * off.max()}mm", status=2)
    assert mentions(said, "Failed: 1 of 10")
    assert found["failed_rows"] == [int(off.argmax())]
    assert run(*options, "--wanted", "3")[0] == 64
    data = wb.read_measurements("mixed.csv").take(np.arange(12, 40))
    with pytest.raises(DataError):
        wb.verify("arm.toml", data, wanted=1.0)
