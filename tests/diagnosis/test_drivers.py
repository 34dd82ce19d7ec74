"""Which driver an error follows, and whether a law of it is more than a smooth dependence on it."""

import re
import sys
from contextlib import nullcontext
from dataclasses import replace
from functools import cache
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from arms import make
from laws import Effect, poses
from real_arms import load
from refusals import refuses
from slow import slow

from workbench import Dataset, Frame, Motion, diagnose, evaluate, identify, load_robot
from workbench.arm.effects import EFFECTS, Candidate, JointCompliance
from workbench.arm.effects.axes import own
from workbench.arm.statics.wrenches import motion_wrenches
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.diagnosis.confidence import Confidence
from workbench.diagnosis.drivers import evidence
from workbench.diagnosis.drivers.driver import Driver, driver_of
from workbench.diagnosis.drivers.gravity import LoadsByAxis
from workbench.diagnosis.drivers.path import SLIPS, path_of
from workbench.diagnosis.drivers.process import smooth, smooth_plane, wandering
from workbench.diagnosis.payload import refuse_heavy
from workbench.diagnosis.report.results_json import diagnosis_json
from workbench.diagnosis.search.evidence import Term, _inertia

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
import strangers

SHARED = Path(__file__).resolve().parents[3] / "shared" / "data"


@pytest.mark.parametrize(("features", "numbers"), [(smooth, 1), (smooth_plane, 2)])
def test_features_span_a_smooth_process(features, numbers):
    """Beside those of a line, their products are the kernel, as far as the knots reach."""
    u = np.random.default_rng(0).uniform(-1.5, 1.5, (40, numbers))
    found = features(u[:, 0] if numbers == 1 else u, 1.2)[:, numbers:]
    dense = np.exp(-0.5 * ((u[:, None] - u) ** 2).sum(2) / 1.2**2)
    np.testing.assert_allclose(found @ found.T, dense, atol=0.06)


def test_a_walk_over_time_has_the_covariance_of_brownian_motion():
    t = np.linspace(0.0, 1.0, 30)
    walk = wandering(t, 400)[:, 1:]
    np.testing.assert_allclose(walk @ walk.T, np.minimum.outer(t, t), atol=2e-3)


def test_every_law_has_its_driver():
    for name, driver, settings in (
        ("joint-compliance", Driver.LOAD, {}),
        ("backlash", Driver.MOTION, {"by": "motion"}),
        ("joint-harmonic", Driver.ANGLE, {}),
        ("thermal-growth", Driver.TEMPERATURE, {}),
        ("frame-step", Driver.TIME, {}),
    ):
        kind = EFFECTS[name]
        assert driver_of(kind(() if kind.whole_arm else (0,), **settings)) is driver, name


def test_motions_are_known_only_where_rows_followed_each_other():
    """By times, or as they stand in the file. A joint that goes far is wound up, one that returns is not."""
    whole = make("none", 3).data
    path = path_of(whole.take(np.arange(5, 9)), whole)
    np.testing.assert_allclose(path.moves, np.diff(whole.q, axis=0)[4:8])
    assert not path.course.is_steady
    untimed = replace(whole, time=None)
    np.testing.assert_array_equal(path_of(untimed, untimed).wound, path_of(whole, whole).wound)
    mixed = replace(whole.take(np.argsort(whole.q[:, 0])), time=None, row=whole.row)
    assert path_of(mixed, mixed) is None
    assert path_of(turned := replace(whole, direction=-whole.direction), turned) is None
    q = np.outer([0.0, 1.0, 2.0, 3.0, 2.9, 2.8], np.eye(6)[0])
    sign = np.sign(np.diff(q, axis=0, prepend=q[:1]))
    data = replace(whole.take(np.arange(6)), q=q, direction=sign, time=np.arange(6.0))
    wound = path_of(data, data).wound[:, 0]
    np.testing.assert_allclose(wound[3], 1.0)
    np.testing.assert_allclose(wound[4], np.maximum(1.0 - 0.1 / (q[:, 0].std() * SLIPS), -1.0))


@pytest.mark.parametrize(
    ("late", "play", "is_timed"),
    [(0.003, 0.0, True), slow(-1e-3, 0.0, True), (3e-3, 0.0, False), (0.0, 5e-4, True)],
)
def test_places_and_joints_of_different_times_are_told_from_play(late, play, is_timed):
    """Play of every joint and the tool's place were blamed, without times the angles of two joints together;
    `identify` saved an arm far worse than nominal. Half of a timed motion is repeated, and counts once."""
    t, rng, arm = np.r_[0.0:25.0:0.1, 0.0:12.5:0.1], np.random.default_rng(1), load_robot("ur5e").bare
    rates = rng.uniform(0.5, 1.3, 6)
    q, seen = (0.7 * np.sin(np.multiply.outer(s, rates) + np.arange(6.0)) for s in (t, t - late))
    seen[:, 2] += play * np.sign(np.gradient(q[:, 2]))
    points = arm.predict(seen)[:, :3, 3] + rng.normal(0.0, 3e-5, (len(t), 3))
    data = Dataset(q=q, position=points, time=t + 30.0 * (np.arange(len(t)) >= 250))
    once = replace(data.take(np.arange(250)), time=t[:250] if is_timed else None)
    found, alone = diagnose(arm, once), identify(arm, data if is_timed else once)
    size = f"{1e3 * abs(late):.2g} ms" if is_timed else f"{10.0 * late:.2g} of the time between rows"
    said = f"as if the arm was measured {size} {'before' if late > 0.0 else 'after'} its joints were read"
    assert (said in found.message, said in " ".join(alone.warnings)) == 2 * (late != 0.0,)
    assert [(c.kind, c.joints) for c in found.causes] == ([("backlash", (2,))] if play else [])
    assert found.error.after.main.mean < 0.06


def test_a_slide_that_is_not_straight_is_a_driver():
    """Its rail was bent by 0.4 mm, and the error followed "nothing that was tried"."""
    case = make("none", 2, "gantry")
    aside = 4e-4 * np.sin(6.0 * case.data.q[:, :1]) * [1.0, 0.0, 1.0]
    found = diagnose(case.robot, replace(case.data, position=case.data.position + aside))
    assert "the position of joint 1, in its way (certain)" in found.message


def test_masses_act_through_a_law_and_its_rivals_alike():
    """A joint's own law was weighed with masses through that joint, its rivals with masses through all."""
    both = Candidate(JointCompliance((1, 2)), np.eye(2), alike=True)
    alone = Candidate(JointCompliance((1,)))
    grams = mock.Mock(inertia={both.names: ("through both",), alone.names: ("through one",)})
    assert _inertia(grams, alone, (Term(both, 1.0),)) == ("through both",)
    assert _inertia(grams, alone, ()) == ("through one",)


@cache
def met(kind, seed):
    """A diagnosed arm with a trouble that the catalogue lacks."""
    robot, data, _ = strangers.rows_of(kind, seed)
    return strangers.diagnosed(strangers.STRANGERS[kind], robot, data)


@pytest.mark.parametrize(
    ("kind", "seed", "said", "most"),
    [
        slow("grown-link", 1, "the temperature, in the arm's constants", 1.01),
        ("settling", 0, r"it isn't simply backlash.* A correction from your rows would reduce", 0.5),
        ("creeping", 0, r"the time, in joint \d \(certain\)", 1.05),
        slow("sagging-tool", 0, "the direction of gravity in the frame of the tool", 1.05),
        slow("bent-link", 1, r"a step between rows \d+ and \d+, in the arm's constants.* A correction", 1.05),
        slow("warming", 0, "in the arm's lengths", 1.05),
        ("fading", 1_200_017, "its change over time", 1.05),
        ("pull", 6002, "a pull on the tool, as by a hose, in joints 2, 3", 1.05),
        slow("without-zero-step", 13, "", 1.05),
        slow("without-backlash-load", 14, "", 1.05),
        slow("without-clearance", 0, "", 1.05),
    ],
)
def test_an_error_without_a_law_is_said_to_follow_its_driver(kind, seed, said, most):
    """The law that comes nearest is kept where it helps: saved arms may have at most a share of the error."""
    found, exact = met(kind, seed), strangers.rows_of(kind, seed)[2]
    assert all(c.confidence is Confidence.OPEN for c in found.causes)
    assert strangers.STRANGERS[kind].driver in [str(f.driver) for f in found.followed]
    assert not found.is_good
    saved, alone = (strangers._error(fit.calibrated, exact) for fit in (found.after.fit, found.before_fit))
    assert saved < most * alone
    assert re.search(f"The error follows.*{said}", found.message)


@pytest.mark.parametrize(
    ("kind", "seed", "odds", "said"),
    [
        ("without-bearing", 6000, Confidence.OPEN, "explains as much"),
        slow("without-flexure", 6000, Confidence.PROBABLE, "or link-flexure at joint 3; .* the same rows"),
        slow("without-compliance", 6004, Confidence.OPEN, "explains as much"),
    ],
)
def test_a_law_is_not_certain_where_another_element_explains_as_much(kind, seed, odds, said):
    """A link was 'certain' in place of a bearing that the catalogue lacked, and the other way round."""
    (cause,) = met(kind, seed).causes
    assert cause.confidence is odds
    assert re.search(said, f"{cause.claim}; {cause.doubt}")


def of(joint, off):
    return -off[:, None] * np.eye(6)[joint]


FOLLOWED = {
    "the speed of the joints (certain)": lambda q, way, speed: 0.02 * speed,
    "the last motion of joint 5, in joint 4 (certain)": lambda q, way, speed: of(3, 7e-4 * way[:, 4]),
    "the last motion of joint 5 and its change over time (certain)": lambda q, way, speed: of(
        4, 7e-4 * way[:, 4] * (np.arange(len(q)) < 0.6 * len(q))
    ),
    "the angles of joints 2 and 3, in joint 3": lambda q, *_: of(2, 4e-4 * np.sin(3.0 * (q[:, 1] + q[:, 2]))),
    "the angle of joint 2 together with the angle of joint 5, in joint 2": lambda q, *_: of(
        1, 6e-4 * np.sin(2.0 * q[:, 1]) * np.cos(1.5 * q[:, 4])
    ),
    "the time, in joint 3 (certain)": lambda q, *_: of(2, 4e-4 * np.sin(np.arange(len(q)) / 4.0)),
}
OFTEN = [said for said in FOLLOWED if "in joint 4" in said or "together" in said]


@pytest.mark.parametrize("said", [s if s in OFTEN else slow(s) for s in FOLLOWED])
def test_joints_that_follow_speed_or_other_joints_do_not_scatter(said):
    """They did, or followed another joint's angle, or their load."""
    made = make("none", 0)
    q, speed = made.data.q, np.gradient(made.data.q, axis=0) / np.gradient(made.data.time)[:, None]
    off = FOLLOWED[said](q, made.data.direction, speed)
    found = diagnose(made.robot, replace(made.data, q=q + off), held_out=0.0)
    assert found.message.startswith(f"The error follows {said}")
    if "in joint 4" in said:
        (follows,) = diagnosis_json(found)["follows"]
        assert (follows["joints"], follows["in"]) == ([5], [{"part": "joint", "joints": [4]}])


def test_a_joint_may_give_way_only_under_a_payload():
    case = make("none", 0)
    q, payload = case.data.q.copy(), 2.0 * (np.arange(len(case.data)) % 3)
    data = replace(case.data, payload=payload)
    load = own(case.robot.chain, (1,), motion_wrenches(case.robot, Motion.of(data)))[:, 0]
    q[:, 1] -= 1.5e-3 * load / np.abs(load).max() * (payload > 0.0)
    found = diagnose(case.robot, replace(data, q=q), held_out=0.0)
    assert "follows the load of joint 2 and the payload (certain)" in found.message


TOLD = {"": lambda m: m, "kg where it says": lambda m: 2.2 * m, "one row late": lambda m: np.roll(m, 1)}


@pytest.mark.parametrize("said", [*(slow(s) if "kg" in s else s for s in TOLD), "mm from the tool's point"])
def test_a_payload_that_is_not_what_the_file_says_is_no_size_of_joints(said):
    """Joints gave way by half of the truth, "certain", 19 standard errors off."""
    case, rng = make("none", 0), np.random.default_rng(5)
    state = replace(case.state, payload=0.5 * rng.integers(0, 5, len(case.data)))
    soft = [Effect("joint-compliance", (1,), (2e-5,)), Effect("joint-compliance", (2,), (1.3e-4,))]
    off = se3.pose(np.eye(3), np.full(3, 0.06 * ("mm" in said)))
    robot = case.robot.with_frames(tool=Frame.from_pose(case.robot.tool.pose @ off))
    points = (poses(case.actual, soft, state) @ off)[:, :3, 3] + rng.normal(0.0, 5e-5, (len(case.data), 3))
    data = replace(case.data, position=points, rotation=None, payload=TOLD.get(said, np.array)(state.payload))
    (cause,) = (found := diagnose(robot, data, held_out=0.0)).causes
    assert cause.confidence == {"one": "cannot tell", "kg": "probable"}.get(said[:3].strip(), "certain")
    told = re.search(f"follows a payload that isn't what the file says: .*{said}", found.message)
    assert bool(found.followed) is bool(told) is bool(said)
    assert found.is_good is (said[:2] in ("", "mm"))
    with refuses(DataError, "1400 kg", "payload[g]") if said else nullcontext():
        refuse_heavy(robot, replace(data, payload=np.full(len(data), 1400.0 * bool(said))))


def test_rows_of_two_arms_are_said_to_part_where_the_second_begins():
    rng, arm = np.random.default_rng(4), load_robot("ur5e").bare
    errors = rng.normal(0.0, 1e-3, (2, len(arm.default_free))) + arm.values(arm.default_free)
    one, other = (arm.with_values(dict(zip(arm.default_free, e.tolist(), strict=True))) for e in errors)
    q, first = rng.uniform(-2.0, 2.0, (120, 6)), np.arange(120)[:, None, None] < 70
    seen = np.where(first, one.predict(q), other.predict(q))
    points = seen[:, :3, 3] + rng.normal(0.0, 5e-5, (120, 3))
    found = diagnose(arm, Dataset(q=q, position=points, rotation=seen[:, :3, :3], time=np.arange(120.0)))
    rows = re.search(r"rows (\d+) and (\d+), in the arm's const.* later rows alone", found.message)
    assert found.error.after.main.mean < 0.15, "an arm between the two is of no use"
    assert 67 <= int(rows[1]) < int(rows[2]) <= 72


def test_gravity_is_found_from_loads_in_any_direction():
    """Compliances and direction from columns of all joints and axes; a joint can't push."""
    rng, down = np.random.default_rng(2), np.array([0.0, 0.0, -1.0])
    columns, pull = rng.standard_normal((200, 3, 3)), np.array([0.6, 0.0, 0.8])
    seen = columns @ pull @ np.array([2.0, 0.0, 1.0]) + 1e-3 * rng.standard_normal(200)
    loads = LoadsByAxis(np.einsum("rja,rkb->jakb", columns, columns), np.einsum("rja,r->ja", columns, seen))
    square, found = max((loads.likeliest(d) for d in (down, *np.eye(3))), key=lambda each: each[0])
    np.testing.assert_allclose(found, pull, atol=1e-3)
    assert square == pytest.approx(seen @ seen, rel=1e-4)
    assert loads.explained(-pull)[0] < 0.05 * square


@pytest.mark.slow
def test_an_arm_that_hangs_is_told_from_one_that_stands():
    """It was a harmonic or a map; drives that push back under the file's gravity give the same rows."""
    found = met("ceiling", 6000)
    assert {c.kind for c in found.causes} == {"gravity-direction", "joint-compliance"}
    assert all(c.confidence is Confidence.PROBABLE and "push back" in c.doubt for c in found.causes)
    assert found.calibrated.gravity[2] > 9.8
    assert "gravity pulls along" in found.message
    upright = diagnose(*strangers.rows_of("ceiling", 6001)[:2], levelled=True)
    assert "follows the load of joints 2, 3 (probable)" in upright.message  # was: or the angles of both


@pytest.mark.parametrize("kind", ["backlash-motion", "compliance", *map(slow, ("scale", "clearance"))])
def test_a_law_that_is_there_wins(kind, monkeypatch):
    """Alone: nobody knows the motion before the first row, 'the time (certain)'. All say what few can't."""
    monkeypatch.setattr(evidence, "MAX_ROWS", 5 if kind == "compliance" else evidence.MAX_ROWS)
    case = make(kind, 24 if kind == "backlash-motion" else 20, "aria")
    found = diagnose(case.robot, replace(case.data, direction=None), held_out=0.0)
    (cause,) = found.causes
    assert not found.followed
    assert (cause.kind, cause.joints) == (case.truth[0].name, case.truth[0].joints)
    assert cause.confidence is not Confidence.OPEN


def test_no_law_is_kept_that_adds_nothing_beside_the_place():
    """A reflector that turns to its tracker was a harmonic of joint 1, and the saved arm worse for it."""
    case, tracker = make("none", 0, "industrial"), np.array([2.5, 0.0, 0.0])
    sight = case.data.position - tracker
    position = case.data.position - 1.5e-3 * sight / np.linalg.norm(sight, axis=1)[:, None]
    found = diagnose(case.robot, replace(case.data, position=position, rotation=None), held_out=0.0)
    assert all(e.effect.is_event for e in found.effects)


@pytest.mark.slow
@pytest.mark.data
def test_a_step_hidden_in_measured_rows_is_claimed_though_other_events_are_doubted():
    """All events were dropped where one of them was doubtful."""
    robot, data = load(SHARED, "ur5")
    data = data.take(np.arange(200))
    q = data.q - 1e-3 * (np.arange(200) >= 100)[:, None] * np.eye(6)[2]
    found = diagnose(robot, replace(data, q=q, direction=None), held_out=0.2)
    (zero,) = (c for c in found.causes if c.kind == "zero-step")
    assert (zero.joints, zero.confidence) == ((2,), Confidence.CERTAIN)
    assert abs(zero.row - 100) <= 2


def test_a_frame_that_creeps_by_no_law_bends_no_arm():
    robot, data, exact = strangers.rows_of("quantised", 0)
    creep = 6e-4 * np.log1p(np.arange(len(data)) / 10.0)[:, None] * [0.6, -0.5, 0.6]
    found = diagnose(robot, replace(data, position=data.position + creep))
    assert evaluate(found.calibrated, exact, fit_frames=True).errors.position_mm.mean < 0.05
