"""Verification on fresh poses: ISO 9283 by hand, intervals, what the calibration used, the certificate."""

import csv
import hashlib
import json
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from html_page import Page
from refusals import mentions, refuses

import workbench as wb
from workbench.arm.calibration_record import Calibration, pose_keys
from workbench.arm.frame import Frame
from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.data.accuracy_requirement import Wanted
from workbench.data.prediction import row_components
from workbench.extras.service.verification.certificate import MAP, PAGE, write_certificate
from workbench.extras.service.verification.intervals import Bounds, minimum_share, tolerance_bound
from workbench.extras.service.verification.iso9283 import RepeatedPose, pose_labels, repeated_poses


@pytest.fixture(scope="module")
def arm():
    """A virtual ARIA, calibrated, with the rows that did it, and as many fresh ones of the same arm."""
    actual, rows = wb.measure_poses(wb.load_robot("aria"), 30, seed=1)
    calibrated = wb.identify(wb.load_robot("aria"), rows, algorithms=("opt2",), held_out=0).robot
    return calibrated, rows, wb.measure_poses(wb.load_robot("aria"), 70, seed=2, actual=actual)[1]


# -- ISO 9283 -------------------------------------------------------------------------------------


def test_accuracy_and_repeatability_by_hand():
    """Four visits at ±1 mm along x and ±2 mm along y about a barycentre that is (3, 4, 0) mm off."""
    off = 1e-3 * np.array([[4, 4, 0], [2, 4, 0], [3, 6, 0], [3, 2, 0]], float)
    turn = 1e-3 * np.array([[1, 0, 5], [1, 0, 5], [2, 0, 5], [2, 0, 5]], float)
    pose = RepeatedPose.of(np.arange(4), off, turn)
    assert pose.accuracy == pytest.approx(5e-3)
    # l = 1, 1, 2, 2 mm: mean 1.5 mm, S = √(4 · 0.25 / 3) = 0.57735 mm
    assert pose.repeatability == pytest.approx(1.5e-3 + 3 * 0.57735e-3, rel=1e-5)
    np.testing.assert_allclose(pose.angle_accuracy, [1.5e-3, 0, 5e-3])
    np.testing.assert_allclose(pose.angle_repeatability, [3 * 0.57735e-3, 0, 0], rtol=1e-5, atol=1e-18)


def test_a_row_that_stands_twice_is_no_second_visit(arm):
    calibrated, _, fresh = arm
    twice = fresh.take(np.r_[np.arange(len(fresh)), [3, 7]])
    found = wb.verify(calibrated, twice)
    assert len(found.data) == len(fresh)
    assert not found.repeated
    assert any("2 duplicate rows" in text for text in found.warnings)


def test_a_row_that_stands_again_after_it_was_excluded_is_judged(arm):
    """Row 3 is excluded and stands again at the end: only that copy is there to be judged."""
    calibrated, _, fresh = arm
    twice = fresh.take(np.r_[np.arange(30), [3]])
    exclude = np.arange(31) == 3
    found = wb.verify(calibrated, replace(twice, exclude=exclude, row=np.arange(31)))
    assert found.data.row.tolist() == [0, 1, 2, *range(4, 31)]
    assert not any("duplicate" in text for text in found.warnings)


def test_limits_per_axis_are_judged_axis_by_axis(arm):
    calibrated, _, fresh = arm
    largest = np.abs(row_components(calibrated, fresh).position).max(axis=1)
    limit = float(np.median(largest))
    found = wb.verify(calibrated, fresh, wanted=Wanted(position=limit, per_axis=True))
    assert found.within.tolist() == (largest <= limit).tolist()
    assert (found.evaluation.rows.position[found.within] > limit).any()  # longer than any of its entries


def test_a_certificate_that_passes_axis_by_axis_draws_no_pose_beyond_its_line(arm):
    calibrated, _, fresh = arm
    largest = 1.01 * np.abs(row_components(calibrated, fresh).position).max()
    found = wb.verify(calibrated, fresh, wanted=Wanted(position=float(largest), per_axis=True))
    assert found.passed
    assert found.evaluation.rows.position.max() > largest
    distribution = found.plot().axes[2]
    drawn, limit = (line.get_xdata() for line in distribution.lines)
    assert max(drawn) < limit[0] == pytest.approx(1e3 * largest)
    assert "largest axis" in distribution.get_xlabel()


def test_two_visits_have_no_spread_of_distances():
    pose = RepeatedPose.of(np.arange(2), np.array([[1e-4, 0, 0], [3e-4, 0, 0]]), np.zeros((2, 3)))
    assert pose.accuracy == pytest.approx(2e-4)
    assert pose.repeatability == pytest.approx(1e-4)


def test_visits_are_told_by_their_joints_and_sessions():
    q = np.array([[0.0, 1.0], [0.5, 1.0], [2e-4, 1.0], [0.5, 1.0], [0.0, 1.0]])
    data = wb.Dataset(q, np.zeros((5, 3)), session=np.array(["a", "a", "a", "a", "b"]))
    assert pose_labels(data).tolist() == [0, 1, 0, 1, 2]
    assert pose_labels(data, same=1e-5).tolist() == [0, 1, 2, 1, 3]


@pytest.mark.data
def test_repeated_poses_of_a_measured_arm(shared_data):
    """Pairs of the UR10's grid that end in the same joints: half their distance, from the file by hand."""
    with (shared_data / "ur10_ipa" / "measurements.csv").open() as file:
        table = np.array([[float(cell) for cell in row[:12]] for row in list(csv.reader(file))[1:]])
    q, place = table[:, :6], table[:, 6:9]
    pairs = np.array([(i, j) for i, j in zip(range(len(q) - 9), range(9, len(q)), strict=True)])
    pairs = pairs[np.abs(q[pairs[:, 0]] - q[pairs[:, 1]]).max(1) < 1e-3]
    rows = pairs.ravel()
    assert len(pairs) > 50
    data = wb.Dataset(q[rows], place[rows], se3.rpy_to_matrix(np.deg2rad(table[rows, 9:])), row=rows)
    robot = wb.evaluate(wb.load_robot("ur10"), data, fit_frames=True).robot
    found = repeated_poses(robot, data, pose_labels(data, same=1e-3))
    assert [pose.rows.tolist() for pose in found] == pairs.tolist()
    commands = wb.tool_poses(robot, q[rows])[:, :3, 3].reshape(-1, 2, 3)
    off = place[pairs] - commands
    np.testing.assert_allclose(
        [p.repeatability for p in found], np.linalg.norm(off[:, 0] - off[:, 1], axis=1) / 2
    )
    np.testing.assert_allclose([p.accuracy for p in found], np.linalg.norm(off.mean(1), axis=1))
    assert 5e-6 < np.median([p.repeatability for p in found]) < 1e-4  # its data sheet says ±0.1 mm


# -- intervals ------------------------------------------------------------------------------------


def test_bounds_of_all_poses_are_exact():
    assert tolerance_bound(np.arange(59.0)) == 58.0  # 0.95^59 = 0.0485
    assert np.isnan(tolerance_bound(np.arange(58.0)))
    assert minimum_share(100, 100) == pytest.approx(0.05 ** (1 / 100))
    assert minimum_share(0, 5) == 0.0


def test_intervals_of_means_agree_with_the_normal_law():
    errors = np.abs(np.random.default_rng(1).normal(1.0, 0.1, 400))
    place = np.arange(400)
    bounds = Bounds.of(errors, place, place, np.random.default_rng(0))
    half = 1.96 * errors.std(ddof=1) / 20.0
    np.testing.assert_allclose(bounds.mean, [errors.mean() - half, errors.mean() + half], atol=0.1 * half)


def test_visits_of_a_pose_are_one_pose():
    """A pose that is measured a hundred times says nothing of the others."""
    errors, pose = np.repeat([1.0, 2.0, 3.0], 100), np.repeat([0, 1, 2], 100)
    bounds = Bounds.of(errors, pose, pose, np.random.default_rng(0))
    assert bounds.mean.low < 1.4 < 2.6 < bounds.mean.high
    assert np.isnan(bounds.maximum)


# -- fresh poses ----------------------------------------------------------------------------------


def test_the_robot_file_remembers_poses_and_standard_errors(arm, tmp_path):
    calibrated, rows, _ = arm
    again = wb.load_robot(calibrated.save(tmp_path / "arm.toml")).calibration
    assert again.used(rows.q).all()
    assert not again.used(rows.q + 1e-4).any()
    assert again.std == calibrated.calibration.std
    assert 0.0 < again.std["joint2.theta"] < 1e-3


def test_poses_of_the_calibration_are_left_out(arm):
    calibrated, rows, fresh = arm
    found = wb.verify(calibrated, fresh.joined(rows))
    assert len(found.data) == 70
    assert mentions(found.warnings[0], "30 rows")
    with pytest.raises(DataError, match="used"):
        wb.verify(calibrated, rows)
    forgetful = replace(calibrated, calibration=None)
    assert "--used" in wb.verify(forgetful, fresh).warnings[0]
    assert len(wb.verify(forgetful, fresh.joined(rows), used=rows).data) == 70


def test_keys_of_poses_tell_them_apart():
    q = np.random.default_rng(0).uniform(-3, 3, (2000, 6))
    other = Calibration(source="", poses=pose_keys(q))
    assert not other.used(np.random.default_rng(1).uniform(-3, 3, (2000, 6))).any()


# -- verdict and certificate ----------------------------------------------------------------------


def test_it_takes_what_a_notebook_has_at_hand(arm, tmp_path):
    calibrated, _, fresh = arm
    csv = wb.write_measurements(fresh, tmp_path / "fresh.csv")
    assert wb.verify("aria", str(csv), wanted="0.5mm").wanted == Wanted(position=5e-4)
    assert wb.verify(calibrated, fresh, wanted=5e-4).wanted == Wanted(position=5e-4)
    assert wb.verify(calibrated, fresh, wanted="1mm,0.1deg").wanted.rotation == pytest.approx(np.deg2rad(0.1))
    assert wb.verify(calibrated, fresh, wanted=wb.Requirement()).wanted == wb.Requirement().wanted
    zeros = wb.rezero("aria", csv, replaced=2, exclude=[3], noise=(1e-4, 1e-4))
    assert zeros.excluded == ((3, "by hand"),)


def test_pass_and_fail(arm):
    calibrated, _, fresh = arm
    worst = float(wb.evaluate(calibrated, fresh).rows.position.max())
    passed = wb.verify(calibrated, fresh, wanted=1.01 * worst)
    assert passed.passed
    assert f"{100 * 0.05 ** (1 / 70):.1f} %" in passed.verdict
    failed = wb.verify(calibrated, fresh, wanted=0.99 * worst)
    assert failed.verdict.startswith("Failed: 1 of 70 measurements of 70 fresh poses")
    assert wb.verify(calibrated, fresh).passed is None
    turned = wb.verify(calibrated, fresh, wanted=Wanted(position=1.0, rotation=1e-6))
    assert not turned.passed
    assert mentions(failed.warnings[0], "70 different poses")  # fewer than 100
    for wanted in (0.0, "large"):
        with refuses(OptionError, option="wanted"):
            wb.verify(calibrated, fresh, wanted=wanted)
    assert "Passed" in passed._repr_html_()
    assert passed.plot()._repr_png_().startswith(b"\x89PNG")


def test_points_alone_are_verified(arm):
    calibrated, _, fresh = arm
    twice = replace(fresh, rotation=None).take(np.repeat(np.arange(3), 2))
    twice = replace(twice, position=twice.position + 1e-7 * np.arange(6)[:, None])
    found = wb.verify(calibrated, twice, wanted=1e-3)
    assert found.rotation is None
    assert len(found.repeated) == 3
    assert "–" in str(found)


def test_angles_alone_verify_nothing(arm):
    """An inclinometer sees no position; without any, every position error would be 0."""
    calibrated, _, fresh = arm
    tilted = replace(fresh, position=None, rotation=None, tilt={2: np.zeros((70, 2))})
    with refuses(DataError, "x[m], markers, distance, contact"):
        wb.verify(calibrated, tilted, wanted=1e-3)


def test_a_certificate_says_what_was_done(arm, tmp_path):
    calibrated, _, fresh = arm
    robot = calibrated.save(tmp_path / "arm.toml")
    again = fresh.take(np.arange(5))
    rows = fresh.joined(replace(again, position=again.position + 1e-7))
    found = wb.verify(calibrated, rows, wanted=1e-3, facts={"Customer": "A <b> & C"})
    page = write_certificate(found, tmp_path / "out", inputs=[robot], day=date(2026, 1, 2))
    text = page.read_text()
    assert {p.name for p in page.parent.iterdir()} == {PAGE, f"{MAP}.svg", "result.json"}
    html = Page()
    html.feed(text)
    message = " ".join(html.text)
    for output in (
        "PASSED",
        "A <b> & C",
        hashlib.sha256(robot.read_bytes()).hexdigest(),
        "2026-01-02",
        "ISO 9283",
    ):
        assert output in message
    assert not [value for name, value in html.attributes if name in ("src", "href") and "http" in value]
    assert json.loads((page.parent / "result.json").read_text())["iso9283"][0]["visits"] == 2


def test_the_command_fails_where_the_arm_does(arm, run, tmp_path):
    calibrated, _, fresh = arm
    calibrated.save(tmp_path / "arm.toml")
    wb.write_measurements(fresh, tmp_path / "fresh.csv")
    options = ("verify", "fresh.csv", "--robot", "arm.toml", "--json", "r.json")
    status, out, _ = run(*options, "--wanted", "1mm,0.5deg", "--report", "out", "--fact", "Serial=7")
    assert status == 0
    assert "Passed" in out
    assert "Serial" in Path("out", PAGE).read_text()
    assert json.loads(Path("r.json").read_text())["facts"] == {"Serial": "7"}
    status, _, err = run(*options, "--wanted", "1um")
    assert status == 2
    assert mentions(err, "Failed", "70 of 70")
    assert run(*options, "--wanted", "3")[0] == 64
    assert run(*options, "--report", "c.pdf")[0] == 64
    assert not Path("c.pdf").exists()
    assert run(*options, "--fact", "no")[0] == 64


@pytest.mark.parametrize(
    "command",
    [
        "verify fresh.csv --robot arm.toml --wanted 9mm --json r.json --report out",
        "rezero fresh.csv --robot arm.toml --save zeros.toml --json r.json",
    ],
)
def test_every_file_is_there_though_nobody_reads(command, arm, run_unread, tmp_path):
    calibrated, _, fresh = arm
    calibrated.save(tmp_path / "arm.toml")
    wb.write_measurements(fresh.take(np.arange(12)), tmp_path / "fresh.csv")
    status, _, err = run_unread(*command.split())
    assert status == 0, err
    assert all(Path(name).exists() for name in ("r.json", "out", "zeros.toml") if name in command)


def test_command_poses_know_the_sessions(arm):
    """Each placement of the instrument has its own base."""
    calibrated, _, fresh = arm
    moved = se3.pose(se3.rpy_to_matrix(np.array([0.0, 0.0, 1.0])), np.array([1.0, 2.0, 0.0]))
    second = replace(calibrated.mounting, base=Frame.from_pose(moved @ calibrated.base.pose))
    robot = replace(calibrated, sessions={"one": calibrated.mounting, "two": second})
    two = np.arange(70) % 2 == 1
    poses = se3.pose(fresh.rotation, fresh.position)
    poses[two] = moved @ poses[two]
    data = replace(
        fresh, position=poses[:, :3, 3], rotation=poses[:, :3, :3], session=np.where(two, "two", "one")
    )
    plain, both = wb.verify(calibrated, fresh), wb.verify(robot, data)
    np.testing.assert_allclose(both.evaluation.rows.position, plain.evaluation.rows.position, atol=1e-12)
    assert both.plot().axes


def test_the_terminals_table_of_repeats_fits_eighty_columns(arm):
    calibrated, _, fresh = arm
    thrice = [
        replace(rows, position=rows.position + 1e-7 * k)
        for k, rows in enumerate([fresh.take(np.arange(3))] * 3)
    ]
    table = str(wb.verify(calibrated, thrice[0].joined(thrice[1]).joined(thrice[2]))).partition("ISO 9283")[2]
    lines = table.partition("bound:")[0].splitlines()[:8]
    assert next(line.split()[:3] for line in lines if "…" in line)[1:] == ["…", "3"]
    assert sum("…" in line for line in lines) == 3
    assert max(map(len, lines)) <= 80
