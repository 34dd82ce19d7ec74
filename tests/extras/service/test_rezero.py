"""Joint zeros found again: the joint that moved is named, the interval holds, anything else is refused."""

from dataclasses import replace

import numpy as np
import pytest
from checks import dh_table, robot_of, with_errors
from generator import VirtualArm, three_parallel
from refusals import mentions, refuses

import workbench as wb
from workbench.arm.calibration_record import Calibration, Expected, Observed
from workbench.arm.frame import Frame
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.types import Freedom

SIGMA = (5e-5, np.deg2rad(0.01))
KNOWN = 1e-4
H = np.pi / 2

ARMS = {
    "aria": wb.load_robot("aria"),
    "5R": wb.Robot.from_dh(
        [[0, 0.3, 0.05, H], [0, 0, 0.4, 0], [0, 0, 0.35, 0], [0, 0.02, 0, H], [0, 0.12, 0, 0]], name="5R"
    ),
    "7R": wb.Robot.from_dh(
        [[0, 0.34, 0, -H], [0, 0, 0, H], [0, 0.4, 0, H], [0, 0, 0, -H], [0, 0.4, 0, -H], [0, 0, 0, H],
         [0, 0.13, 0, 0]], name="7R",
    ),
}  # fmt: skip


def framed(arm, free=Freedom.FIXED):
    """An arm as a calibration saved it, with its record."""
    turn = se3.rpy_to_matrix(np.array([0.1, -0.2, 0.3]))
    frame = Frame.from_pose(se3.pose(turn, np.array([0.02, 0.05, 0.11])))
    known, std, poses = Expected(KNOWN, KNOWN), dict.fromkeys(arm.default_free, KNOWN), np.zeros(0, np.uint32)
    seen = Observed(position=3, rotation=3, tool=known, flange=known, q=np.zeros((1, arm.dof)))
    record = Calibration(source="a.csv", poses=poses, std=std, observed=seen)
    arm = arm.with_frames(base=replace(Frame(), free=free), tool=replace(frame, free=free))
    return replace(arm, calibration=record)


def real(arm, shifts, *, seed=0, changed=(), known=KNOWN, zeros=KNOWN):
    """An arm whose constants are off by what a calibration leaves, and whose zeros were shifted.

    Its poses are computed by the generator, which shares no code with the package.
    """
    rng = np.random.default_rng(seed)
    off = [(known if e.joint is None else zeros) * e.free * rng.normal() for e in arm.elements]
    off = [size + dict(changed).get(e.name, 0.0) for e, size in zip(arm.elements, off, strict=True)]
    table = dh_table(with_errors(arm, np.array(off), tuple(e.name for e in arm.elements)))
    table[:, 0] += shifts
    return VirtualArm("hayati", table, tool=np.array(arm.tool.pose)), rng


def measured(arm, shifts, *, rows=8, **how):
    """Poses of such an arm by a tracker."""
    actual, rng = real(arm, shifts, **how)
    q = rng.uniform(-2.0, 2.0, (rows, arm.dof))
    poses = actual.pose(q)
    turn = se3.rotvec_to_matrix(SIGMA[1] * rng.normal(size=(rows, 3)))
    position = poses[:, :3, 3] + SIGMA[0] * rng.normal(size=(rows, 3))
    sigma = np.tile(np.repeat(SIGMA, 3), (rows, 1))
    return wb.Dataset(q, position, turn @ poses[:, :3, :3], sigma=sigma)


def touched(arm, shifts, *, times=4, **how):
    """Joints of such an arm at touches of three seats that repeat to 0.015 mm."""
    actual, rng = real(arm, shifts, **how)
    rows, names = [], []
    for name, seat in {"A": (0.4, 0.15, 0.25), "B": (0.3, -0.25, 0.1), "C": (0.45, -0.05, 0.35)}.items():
        while names.count(name) < times:
            place = np.array(seat) + rng.normal(0.0, 1.5e-5, 3)
            found = actual.touching(place, rng.uniform(-1.5, 1.5, (1, arm.dof)))
            if np.abs(found).max() < 2.0 and np.abs(actual.pose(found)[0, :3, 3] - place).max() < 1e-9:
                rows.append(found[0])
                names.append(name)
    return wb.Dataset(np.array(rows), contact=names)


def shifted_in_turn(arm, seed, draws):
    """Share of zeros within their intervals; of each draw the joint that was shifted and those named."""
    rng, covered, named = np.random.default_rng(seed), [], []
    for draw in range(draws):
        shifts = np.zeros(arm.dof)
        shifts[joint := rng.integers(arm.dof)] = np.deg2rad(rng.uniform(0.1, 1.0)) * rng.choice([-1, 1])
        found = wb.rezero(arm, measured(arm, shifts, seed=draw))
        covered += [abs(s.shift - t) <= s.half for s, t in zip(found.shifts, shifts, strict=True)]
        named.append((joint, [s.joint for s in found.moved]))
    return np.mean(covered), named


def test_intervals_cover_and_the_joint_that_moved_is_named():
    covered, named = shifted_in_turn(framed(ARMS["5R"]), 1, 5)
    assert covered > 0.8
    assert sum(found == [joint] for joint, found in named) >= 4


@pytest.mark.slow
def test_intervals_cover_95_percent():
    found = [shifted_in_turn(framed(arm), 2, 30) for arm in ARMS.values()]
    assert np.mean([share for share, _ in found]) == pytest.approx(0.95, abs=0.03)  # of 540: three std errors
    assert sum(joint in moved for _, named in found for joint, moved in named) >= 88


def test_what_a_base_and_a_tool_hide_is_said_and_left_as_calibrated(aria):
    arm = framed(aria, Freedom.FREE)
    shifts = np.deg2rad([0.5, 0.0, 0.4, 0.0, 0.0, -0.3])
    found = wb.rezero(arm, measured(arm, shifts))
    assert [s.joint for s in found.moved] == [2]
    assert [s.joint for s in found.shifts if not s.determined] == [0, 5]
    assert found.sentence.endswith("; joints 1, 6 can't be determined")
    assert any("joint 1 and a turn of the base" in text for text in found.ambiguous)
    assert any("joint 6 and a turn of the tool" in text for text in found.ambiguous)
    zeros = aria.joint_offsets
    written = found.robot.values(zeros) - arm.values(zeros)
    assert written == pytest.approx([0, 0, shifts[2], 0, 0, 0], abs=3e-4)
    assert np.linalg.norm(found.robot.base.rpy) == pytest.approx(shifts[0], abs=3e-4)


def test_geometry_counts_as_known_as_its_record_says(aria):
    """Constants as of a manufactured arm: intervals hold where no calibration is recorded; that is said."""
    calibrated, new = framed(aria), replace(framed(aria), calibration=None)
    covered, found = {}, {}
    for arm, off in {calibrated: (5e-4, 0.0), new: (1e-3, 1e-3)}.items():
        hits = []
        for seed in (1, 3, 5):
            shifts = 0.01 * (np.arange(6) == seed)
            found[arm] = wb.rezero(arm, measured(arm, shifts, known=off[0], zeros=off[1], seed=seed))
            assert [s.joint for s in found[arm].moved] == [seed]
            hits += [abs(s.shift - t) <= s.half for s, t in zip(found[arm].shifts, shifts, strict=True)]
        covered[arm] = np.mean(hits)
    assert covered[calibrated] < 0.9 < covered[new]
    assert mentions(" ".join(found[new].notes), "no calibration record", "other lengths")
    wider = replace(calibrated.calibration, std=dict.fromkeys(aria.default_free, 1.5e-3))
    arm = replace(calibrated, calibration=wider)
    wide = wb.rezero(arm, measured(new, shifts, known=off[0], zeros=off[1], seed=5))
    assert np.mean([s.std for s in wide.shifts]) > np.mean([s.std for s in found[new].shifts])


ELSEWHERE, WRONG = np.array([0.0, 0.0, 4e-3]), np.eye(8, 1, -5) * [5e-3, 0.0, 0.0]
"""What moves all rows, as of a base that stands elsewhere, and row 5 alone [m]."""


@pytest.mark.parametrize(
    ("changed", "moved", "doubt"),
    [
        ({"joint2.a": 4e-3}, 0.0, "link 2 is not as"),
        ({"joint3.alpha": 4e-3}, 0.0, "link 3 is not as"),
        ({}, WRONG, "--exclude 5"),
        ({}, ELSEWHERE, "the base is not where"),
    ],
)
@pytest.mark.parametrize("recorded", [True, False])
def test_what_is_no_shift_of_a_zero_is_named_and_nothing_is_written(aria, changed, moved, doubt, recorded):
    arm = framed(aria) if recorded else replace(framed(aria), calibration=None)
    rows = measured(arm, np.zeros(6), changed=changed.items())
    rows = replace(rows, position=rows.position + moved)
    found = wb.rezero(arm, rows)
    assert (found.verdict, found.robot is arm) == ("refused", True)
    assert any(doubt in text for text in found.doubts[: 1 if moved is not ELSEWHERE else None])
    assert not changed or any("damage" in text for text in found.doubts) == recorded
    if moved is WRONG:
        found = wb.rezero(arm, rows, exclude={5: "bumped"})
        assert found.verdict == "unchanged"
        assert found.sentence.startswith("no joint moved by more than chance")


def test_an_arm_whose_zeros_the_rows_leave_open_is_not_given_back(aria):
    """Three points, 3 mm off: the file was saved unchanged as 'with the zeros found'."""
    arm = replace(framed(aria), calibration=None)
    rows = measured(arm, 5e-3 * np.eye(6)[2], rows=3)
    found = wb.rezero(arm, wb.Dataset(rows.q, rows.position))
    assert (found.verdict, found.robot is arm) == ("refused", True)
    assert "determine no joint zero" in found.sentence
    assert not any("assigned" in text for text in found.ambiguous)


def test_several_lengths_that_changed_are_no_zeros(aria):
    """No single one explains the rows, and zeros alone would be written."""
    arm = framed(aria)
    shifts = np.deg2rad([0, 0, 0.6, 0, 0, 0])
    rows = measured(arm, shifts, changed={"joint2.a": 1.5e-3, "joint3.d": 1.5e-3}.items(), seed=3)
    found = wb.rezero(arm, rows)
    assert (found.verdict, found.robot is arm) == ("refused", True)
    assert "calibrate" in found.sentence


def test_a_scale_of_all_lengths_is_told_before_any_link(aria):
    """It was two links, to be checked for damage."""
    arm = framed(aria)
    data = measured(arm, np.zeros(6), rows=20)
    found = wb.rezero(arm, replace(data, position=1.0008 * data.position))
    assert len(found.doubts) == 1
    assert mentions(found.doubts[0], "all lengths are", "% longer than calibrated", "the instrument's scale")


def test_three_poses_suffice_and_two_are_refused(aria):
    arm = framed(aria)
    shifts = np.deg2rad([0, 0.5, 0, 0, 0, 0])
    found = wb.rezero(arm, measured(arm, shifts, rows=3))
    assert [s.joint for s in found.moved] == [1]
    points = replace(measured(arm, shifts, rows=1), rotation=None)
    with refuses(DataError, found=(1, 3)):
        wb.rezero(arm, points)


@pytest.mark.parametrize("joint", [None, 1, 2, 3, 4])
def test_touches_of_seats_show_the_joint_that_moved(joint, aria):
    """Joints alone, seats anywhere: joint 1 would turn the table, all others are told."""
    arm, shifts = framed(aria), np.zeros(6)
    if joint is not None:
        shifts[joint] = np.deg2rad(0.3)
    found = wb.rezero(arm, touched(arm, shifts, seed=3))
    assert [s.joint for s in found.moved] == ([] if joint is None else [joint])
    assert not found.shifts[0].determined
    for shift in found.shifts[1:]:
        assert abs(shift.shift - shifts[shift.joint]) < 2.0 * shift.half < np.deg2rad(1.0)


def test_the_command_writes_robot_and_result(run, told, tmp_path, aria):
    arm = framed(aria)
    robot = arm.save(tmp_path / "calibrated.toml")
    good = measured(arm, np.deg2rad([0, 0, 0.5, 0, 0, 0]))
    wb.write_measurements(good, tmp_path / "knock.csv")
    written, out = told("rezero", "knock.csv", "--robot", robot, "--save", "new.toml")
    assert "joint 3 by 0.49" in out
    assert (written["reading"], written["reading_open"]) == ("as given", [])
    assert written["reading_margin"] > 10.0
    assert written["joints"][2]["moved"]
    new, old = (robot.values(("joint3.theta",)) for robot in (wb.load_robot("new.toml"), arm))
    assert new == pytest.approx(old + np.deg2rad(0.5), abs=4e-4)
    bent = measured(arm, np.zeros(6), changed={"joint2.a": 4e-3}.items())
    wb.write_measurements(bent, tmp_path / "bent.csv")
    status, out, err = run("rezero", "bent.csv", "--robot", robot, "--save", "no.toml")
    assert status == 2
    assert mentions(out, "link 2")
    assert err.count("\n") == 1
    assert not (tmp_path / "no.toml").exists()


@pytest.mark.parametrize(
    ("w", "text"),
    [(np.diag([1, -1, 1, 1, 1, 1]), "joint 2 = -q2"), (np.eye(6)[[0, 1, 2, 4, 3, 5]], "joint 4 = q5")],
)
def test_joints_that_count_otherwise_are_no_collision(aria, w, text):
    rows = measured(framed(aria), np.zeros(6), rows=12)
    with pytest.raises(DataError) as refused:
        wb.rezero(framed(aria), replace(rows, q=rows.q @ w.T))
    assert text in str(refused.value)


def test_the_zero_of_a_new_motor_may_be_anywhere(aria):
    rows, zero = measured(framed(aria), np.zeros(6), rows=12), np.deg2rad([0, 0, 40, 0, 0, 0])
    found = wb.rezero(framed(aria), replace(rows, q=rows.q - zero))
    assert [s.joint for s in found.moved] == [2]
    assert found.shifts[2].shift == pytest.approx(zero[2], abs=1e-3)


@pytest.fixture(scope="module", params=["toml", "urdf"])
def recalibrated(request, tmp_path_factory):
    """An arm that was identified from a table, or from a URDF, whose constants rows can't tell apart."""
    folder, rng, nominal = tmp_path_factory.mktemp("arm"), np.random.default_rng(5), three_parallel()
    actual = nominal.perturbed(rng, length=1e-3, angle=2e-3)
    path = robot_of(nominal, folder, free='"auto"').save(folder / f"arm.{request.param}")

    def rows(count, shift=0.0, *, noise=2e-5, turn=1e-4, turned=True):
        q = rng.uniform(-2.0, 2.0, (count, nominal.dof))
        pose = actual.pose(q + shift)
        turns = se3.rotvec_to_matrix(rng.normal(0.0, turn, (count, 3)))
        position = pose[:, :3, 3] + rng.normal(0.0, noise, (count, 3))
        return wb.Dataset(q, position, pose[:, :3, :3] @ turns if turned else None, source="rows.csv")

    saved = wb.identify(wb.load_robot(str(path)), rows(60)).robot.save(folder / "calibrated.toml")
    return wb.load_robot(str(saved)), rows


@pytest.mark.parametrize("turned", [True, False])
@pytest.mark.parametrize("joint", [1, 2, 3])
def test_a_tenth_of_a_degree_is_found_on_tables_and_urdfs(recalibrated, joint, turned):
    arm, rows = recalibrated
    found = wb.rezero(arm, rows(20, np.deg2rad(0.1) * np.eye(arm.dof)[joint], turned=turned))
    (shift,) = found.moved
    assert shift.joint == joint
    assert shift.shift == pytest.approx(np.deg2rad(0.1), abs=shift.half)
    assert shift.half < np.deg2rad(0.03)
    assert found.error.after.position_mm.mean < 0.06


@pytest.mark.parametrize("count", [4, 5, 6, 7])
def test_few_poses_with_exact_orientations_contradict_no_zeros(recalibrated, count):
    """What fits one of two channels to nothing is no evidence against the zeros."""
    arm, rows = recalibrated
    found = wb.rezero(arm, rows(count, np.deg2rad([0, 0.12, 0, 0.08, 0, 0]), turn=0.0))
    assert [s.joint for s in found.shifts if s.moved] == [1, 3]
    assert not found.doubts


def test_rows_that_stay_far_off_are_refused(recalibrated):
    """Ten times the calibration's error is none that its zeros explain, whatever the rows scatter by."""
    arm, rows = recalibrated
    found = wb.rezero(arm, rows(20, noise=5e-4))
    assert (found.verdict, found.moved) == ("refused", ())
