"""What is said of what is left, where the rows know their noise, their groups or nothing at all."""

from dataclasses import replace

import numpy as np
import pytest

import workbench as wb
from tests.exports.test_unmeasured_orientation import flanges
from workbench import Motion, Noise, diagnose, measure_poses, tool_poses
from workbench.arm import effects as kinds
from workbench.arm.effects import LocalJointError, UnevenCompliance
from workbench.arm.gravity import tilted
from workbench.diagnosis import gravity_tilt
from workbench.diagnosis.diagnose import NO_WAY
from workbench.diagnosis.gravity_tilt import GravityTilt
from workbench.diagnosis.remaining_error import RemainingError
from workbench.diagnosis.result import Verdict, harm_done
from workbench.identification.checks.common_errors import two_places
from workbench.identification.errors.row_errors import Errors
from workbench.identification.joint_reading_noise import Readings

NOISE_ONLY = RemainingError(
    noise=Noise(1e-4, 1e-3), known_noise=None, joint_noise=None, followed=(), places=""
)
SLIDING = wb.Robot.from_dh([{"alpha": 1.2, "type": "prismatic"}, {"a": 0.3}], name="column")


@pytest.fixture(scope="module")
def soft():
    """An ARIA that gives way in joint 2, measured with a noise that its rows state."""
    robot = wb.load_robot("aria")
    return robot, measure_poses(robot, 40, effects=("joint-compliance:2:5e-5",), seed=3)[1]


def named(found):
    return [(str(e.effect.name), e.effect.joints) for e in found.effects]


def test_what_is_left_is_compared_with_the_noise_that_rows_state(soft):
    robot, rows = soft
    found = diagnose(robot, rows, noise=Noise(1e-3, 1e-2))
    sigma = float(np.sqrt((rows.sigma[:, :3] ** 2).mean()))
    assert found.remaining.known_noise.position == pytest.approx(sigma)
    assert found.remaining.noise.position == pytest.approx(sigma, rel=0.2)
    assert found.verdict is Verdict.EXPLAINED
    assert found.is_good
    assert not replace(found, harm="the effects make it worse").is_good
    together = replace(rows, sigma=rows.sigma / 3.0, group=np.full(len(rows), "all"))
    doubted = diagnose(robot, together, held_out=0.0)
    assert named(doubted) == [("joint-compliance", (1,))]
    assert doubted.verdict is Verdict.PARTLY
    assert "times what the known noise" in doubted.message


def test_no_effect_is_added_where_the_geometry_explains_little(soft):
    """One robot moved twice, taken for one that stood still."""
    robot, rows = soft
    away = np.repeat([[0.0, 0.0, 0.0], [0.0, 0.2, 0.0]], len(rows) // 2, axis=0)
    found = diagnose(robot, replace(rows, position=rows.position + away, sigma=None))
    assert found.verdict is Verdict.UNEXPLAINED
    assert "No effects were added" in found.message
    assert any(note.startswith("noise unknown") for note in found.notes)
    assert found.effects == ()
    assert found.calibrated.effects == ()


@pytest.mark.parametrize(
    ("effect", "text"),
    [
        (kinds.EncoderScale((1,), (-0.005,)), "Joint 2 moves farther than it counts: -0.5 %"),
        (kinds.JointCompliance((0,), (2e-6,)), "Joint 1 gives under load: 2 µm/N"),
        (kinds.JointCoupling((0, 1), (1e-3,)), "Joint 1 moves along with joint 2: 0.001 mm/mrad"),
        (LocalJointError((0,), (-1e-3, 0.0, 1e-3), knots=(0.0, 0.1, 0.2), range=(0.0, 0.2)), "up to 1 mm"),
    ],
)
def test_sliding_joints_slide(effect, text):
    rows = Motion(np.column_stack([np.linspace(0.0, 0.2, 9), np.linspace(-1.0, 1.0, 9)]))
    assert text in effect.sentence(SLIDING.chain, rows)


def test_all_arms_are_compared_on_the_same_rows(soft):
    """Three rows are so little off that they show only beside the effect: then no arm is judged by them."""
    robot, rows = soft
    off = rows.position.copy()
    off[[4, 17, 30]] += [0.0, 0.0, 1e-3]
    found = diagnose(robot, replace(rows, position=off, sigma=None), held_out=0.0)
    assert {4, 17, 30} <= set(found.outliers.tolist())
    assert "noise unknown, neither stated nor from repeated poses" in found.notes  # no size: it counted these
    assert found.before_fit.problem.data.row.size > found.after_fit.problem.data.row.size
    compared = found.nominal, found.before, found.after
    assert {len(each.train) for each in compared} == {len(rows) - len(found.outliers)}


def test_errors_of_orientation_are_compared_with_the_known_noise_too():
    """The joints' scatter was taken off first, and orientations weren't compared at all."""
    turned = replace(NOISE_ONLY, known_noise=Noise(1e-4, 2e-4))
    assert turned.noise_ratio == pytest.approx(5.0)
    assert "of unknown origin" in turned.text(wb.load_robot("aria").chain)
    assert not replace(NOISE_ONLY, known_noise=Noise(1e-4, 1e-3)).is_more_than_noise


def test_scatter_of_single_joints_is_left_to_be_explained():
    """A payload that came and went unsaid was 'explained' at five times the noise."""
    one = 0.0, 3e-4, 0.0
    for sigma, digit, is_left in ((one, 0.0, True), (one, 0.1, False), ((2e-4,) * 3, 0.0, False)):
        found = replace(NOISE_ONLY, joint_noise=Readings(sigma, 0.9, digit))
        assert (found.is_unexplained, found.scattering({1}) is None) == (is_left, sigma is one)
        warnings = [found.joint_noise_warning(SLIDING.chain, soft=soft) for soft in ((0,), (1,))]
        assert ["'payload'" in each for each in warnings] == [False, is_left and sigma is one]


def row_errors(position, rotation):
    return Errors(np.asarray(position), np.asarray(rotation), np.full(len(position), np.nan))


def test_rows_are_judged_by_positions_and_orientations_together():
    """Positions alone decided: a third of the orientation error was no gain, and twice of it no harm."""
    rng, noise = np.random.default_rng(0), Noise(1e-4, 1e-3)
    near, turned = 1e-4 * rng.uniform(0.5, 1.5, 30), 1e-3 * rng.uniform(0.5, 1.5, 30)
    before = row_errors(near, 3.0 * turned)
    assert harm_done(before, row_errors(1.05 * near, turned), noise) is None
    assert "°" in harm_done(row_errors(near, turned), row_errors(0.95 * near, 3.0 * turned), noise)
    assert "mm" in harm_done(row_errors(near, turned), row_errors(3.0 * near, turned), noise)


def test_a_tilt_is_not_claimed_where_the_measuring_frame_agrees_with_the_file(monkeypatch):
    fit = wb.identify(wb.load_robot("aria"), measure_poses(wb.load_robot("aria"), 40, seed=3)[1]).best.fit
    tilt = GravityTilt("", np.array([0.05, 0.0]), 1e-8 * np.eye(2), 1e-3)
    for upright, claims in ((False, 1), (True, 0)):
        found = replace(tilt, is_upright=upright)
        monkeypatch.setattr(gravity_tilt, "tilts_of_gravity", lambda *a, found=found: [found])
        given = wb.load_robot("aria").under(tilted(wb.load_robot("aria").gravity, np.array([0.05, 0.0])))
        assert len([*gravity_tilt.gravity_direction_causes(fit, given, Noise(0.0, 0.0), ())]) == claims
    assert "state whether the instrument is level" in found.text


def test_look_alikes_are_listed_with_their_order_and_nothing_drifts_by_zero():
    assert kinds.JointHarmonic((4,), order=2).phrase == "joint-harmonic at joint 5, order 2"
    drift = kinds.BaseDrift((), (0.0, 0.0, 0.0, 1e-7, 0.0, 0.0))
    chain, motion = wb.load_robot("aria").chain, Motion(np.zeros((2, 6)), time=np.zeros(2))
    assert drift.sentence(chain, motion) == "The measuring frame drifts: up to 0.36 mrad/h"


def test_terms_that_cancel_are_sized_by_what_they_leave():
    """19 mrad were said of each term, 2.4 mrad are the most that the joint deflects."""
    uneven = UnevenCompliance((1,), (0.0, 0.019, -0.019), load=10.0)
    motion = Motion(np.column_stack([np.zeros(5), np.linspace(0.9, 1.0, 5), *np.zeros((4, 5))]))
    assert "up to 4." in uneven.sentence(wb.load_robot("aria").chain, motion)


def test_a_law_does_not_end_at_the_largest_load_of_its_rows():
    """A fit of masses stalled there."""
    wrenches = np.full((1, 6, 6), 10.0)
    soft = UnevenCompliance((1,), (0.0, 0.0, 1e-3)).softened(chain := wb.load_robot("aria").chain, wrenches)
    assert soft.slope(chain, Motion(np.zeros((1, 6))), wrenches).any()


@pytest.mark.parametrize("axes", ["tool", "frame"])
def test_two_seats_of_a_reflector_are_no_noise(axes):
    """No driver explains them: the residuals have two centres."""
    robot, rows = wb.load_robot("aria"), measure_poses(wb.load_robot("aria"), 60, seed=3)[1]
    away = 4e-4 * np.array([0.6, 0.0, 0.8]) * (np.random.default_rng(0).random(len(rows)) < 0.4)[:, None]
    turn = tool_poses(robot, Motion.of(rows))[:, :3, :3] if axes == "tool" else np.eye(3)[None]
    moved = replace(rows, position=rows.position + (turn @ away[:, :, None])[:, :, 0])
    found = two_places(fit := wb.identify(robot, moved, held_out=0.0).best.fit, moved)
    assert f"{axes}: another" in found
    assert "the payload tells them apart" in two_places(fit, replace(moved, payload=4.0 * (away[:, 0] > 0.0)))
    told = replace(NOISE_ONLY, places=found)
    assert told.is_more_than_noise
    assert found in told.text(robot.chain)


def test_the_first_row_of_a_run_whose_last_motion_nobody_knows_is_no_outlier():
    rng = np.random.default_rng(6)
    q = rng.uniform(-2.0, 2.0, (80, 6))
    came = np.vstack([np.ones(6), np.sign(np.diff(q, axis=0))])
    seen = flanges(q + 1e-3 * came * [0, 0, 1, 0, 0, 0], rng.normal(0.0, 2e-4, (6, 6))) @ [
        0.03,
        0.0,
        0.1,
        1.0,
    ]
    rows = wb.Dataset(q=q, position=seen[:, :3] + rng.normal(0.0, 2e-5, (80, 3)), time=np.arange(80.0))
    found = wb.diagnose("ur5", rows, held_out=0.0)
    assert not len(found.outliers)
    assert [why for row, why in found.excluded if row == 0] == [NO_WAY]
    assert [c.kind for c in found.causes] == ["backlash"]
