"""What is wrong with all rows, or with some together, is named, and nothing else is taken for such."""

import numpy as np
import pytest
from checks import with_errors
from refusals import refuses
from slow import slow

import workbench as wb
from tests.exports.test_unmeasured_orientation import flanges
from tests.identification.test_missing_units import poses_of_ur5e
from workbench import Dataset, identify
from workbench.arm.inverse.solve import Task, follow_many
from workbench.base.errors import DataError
from workbench.base.types import Freedom
from workbench.identification.checks.common_errors import instrument_scale, two_places
from workbench.identification.rows.course import course


def warned(factor: float, errors: float, *, seed: int, rows: int = 80, span: float = 1.5) -> str:
    """What is said of points of a UR5 by other code, whose parts differ by errors [m, rad]."""
    rng = np.random.default_rng(seed)
    q, wrong = rng.uniform(-span, span, (rows, 6)), rng.normal(0.0, errors, (6, 6))
    points = factor * (flanges(q, wrong) @ [0.03, 0.0, 0.1, 1.0])[:, :3] + rng.normal(0.0, 3e-5, (rows, 3))
    return instrument_scale(wb.load_robot("ur5"), Dataset(q=q, position=points))


@pytest.mark.parametrize(("factor", "what"), [(1.02, "longer"), (0.99, "shorter")])
def test_a_board_printed_too_large_is_named(factor, what):
    said = warned(factor, 4e-4, seed=1)
    percent, _, rest = said.removeprefix("all lengths are ").partition(" % ")
    assert float(percent) == pytest.approx(100.0 * abs(factor - 1.0), abs=0.2)
    assert rest.startswith(what)


@pytest.mark.parametrize("rows", [6, 20, 80])
@pytest.mark.parametrize("span", [0.5, 1.0, 2.5])
def test_errors_of_an_arm_are_no_scale(rows, span):
    """Two long links that err alike look like one, of half a percent."""
    assert not any(warned(1.0, 1e-3, seed=seed, rows=rows, span=span) for seed in range(40))


def test_one_wrong_length_is_no_scale():
    q = np.random.default_rng(2).uniform(-1.5, 1.5, (80, 6))
    actual = with_errors(arm := wb.load_robot("ur5"), np.array([8e-3]), ("joint2.a",))
    assert instrument_scale(arm, Dataset(q=q, position=actual.predict(q)[:, :3, 3])) == ""


def measured(shift, away, *, noise=5e-5):
    rng, nominal = np.random.default_rng(3), wb.load_robot("ur5e").bare
    arm = with_errors(nominal, 5e-4 * rng.normal(size=len(nominal.default_free)))
    q = rng.uniform(-2.0, 2.0, (90, 6))
    points = arm.predict(q)[:, :3, 3] + rng.normal(0.0, noise, (90, 3))
    return Dataset(q=q, position=points + away[:, None] * np.asarray(shift))


@pytest.mark.parametrize(
    ("shift", "away", "text"),
    [
        ((0.0, 3e-3, 0.0), np.arange(90) % 3 == 0, "rows 0, 3, 6, 9, "),
        ((1e-3, 0.0, -1e-3), np.arange(90) >= 60, "rows 60"),
        ((2e-3, 0.0, 0.0), np.random.default_rng(1).random(90) < 0.2, "rows "),
    ],
)
def test_rows_that_lie_off_together_are_named(shift, away, text):
    found = wb.identify("ur5e", measured(shift, away), held_out=0.2)  # of held-out rows too
    (said,) = [w for w in found.warnings if "together" in w]
    assert said.startswith(f"{away.sum()} of 90 rows (")
    assert text in said
    stated = [float(v) for v in said.split("together, by ")[1].split(" mm in")[0].split(", ")]
    assert stated == pytest.approx([1e3 * v for v in shift], abs=0.1)


def test_rows_of_another_arm_and_computed_ones_are_named_and_play_is_not():
    rng, every = np.random.default_rng(5), np.arange(90) % 2
    q, arms = rng.uniform(-2.0, 2.0, (90, 6)), rng.normal(0.0, 5e-4, (2, 6, 6))
    noise = rng.normal(0.0, 3e-5, (90, 3))

    def found(first, second, noise=noise):
        seen = np.where(every[:, None, None] > 0, second, first) @ [0.03, 0.0, 0.1, 1.0]
        return wb.identify("ur5", Dataset(q=q, position=seen[:, :3] + noise))

    two = found(*(flanges(q, arm) for arm in arms))
    (said,) = [w for w in two.warnings if "need constants" in w]
    named = {int(k) for k in said.partition("(rows ")[2].partition(")")[0].split(", ")}
    assert len(named & {*np.flatnonzero(every == every[min(named)])}) > 0.9 * len(named)
    assert len(named) > 30
    assert said in two.robot.calibration.refused[""]
    typed = found(flanges(q, arms[0]), flanges(q, 0.0 * arms[0]), noise=noise * (1 - every[:, None]))
    (said,) = [w for w in typed.warnings if "45 of 90 rows were computed with the nominal arm" in w]
    assert f"--exclude {','.join(map(str, np.flatnonzero(every)))} " in said
    played = found(flanges(q, arms[0]), flanges(q + 2e-3 * np.eye(6)[1], arms[0]))
    tipped = flanges(q, arms[0])
    tipped[:, :3, 3] += np.cross([1.5e-3, 0.0, 0.0], tipped[:, :3, 3])  # joint 1's bearing has clearance
    for one_joint in (played, found(flanges(q, arms[0]), tipped)):
        assert not [w for w in one_joint.warnings if "need constants" in w]


@pytest.mark.parametrize("noise", [5e-5, 2e-3])
def test_noise_makes_no_two_groups(noise):
    found = wb.identify("ur5e", measured((0, 0, 0), np.zeros(90, bool), noise=noise), held_out=0.0)
    assert two_places(found.best.fit, found.data) == ""
    exact = measured((1e-6, 0, 0), np.arange(90) > 45, noise=1e-7)
    assert two_places(wb.identify("ur5e", exact, held_out=0.0).best.fit, exact) == ""


@pytest.mark.parametrize(("other", "said"), [("arm", "another arm"), ("base", "session=who"), ("none", "")])
def test_a_column_that_parts_the_rows_is_named_and_keeps_the_arm(other, said):
    first, who = measured((0, 0, 0), np.zeros(90, bool)), np.random.default_rng(1).random(90) < 0.3
    rng, nominal = np.random.default_rng(4), wb.load_robot("ur5e").bare
    second = with_errors(nominal, 5e-4 * rng.normal(size=len(nominal.default_free))).predict(first.q)
    shifts = {"arm": second[:, :3, 3] - first.position, "base": np.array([3e-3, 0.0, 1e-3]), "none": 0.0}
    seen = first.position + shifts[other]
    rows = Dataset(first.q, np.where(who[:, None], seen, first.position), unread={"who": who.astype(str)})
    found = wb.identify("ur5e", rows)
    assert said in found.common[0]
    assert bool(found.robot.calibration.refused) == bool(said)


def test_a_column_that_marks_bad_rows_is_named_with_them():
    rows, rng = measured((0, 0, 0), np.zeros(90, bool)), np.random.default_rng(1)
    bad = rng.random(90) < 0.3
    points = rows.position + bad[:, None] * rng.normal(0.0, 3e-4, (90, 3))
    columns = {"Valid": np.where(bad, "0", "1"), "who": rng.choice(["A", "B"], 90)}
    found = wb.identify("ur5e", Dataset(rows.q, points, unread=columns))
    assert found.common[0].startswith(f"rows whose 'Valid' is 0 ({bad.sum()} of 90)")
    assert f"--exclude {','.join(map(str, np.flatnonzero(bad)))} " in found.common[0]


def moved_rows(seed, moved_at, *, of=60):
    """Joints and points of a UR5e, of which the instrument is carried elsewhere after some rows."""
    rng = np.random.default_rng(seed)
    q, poses = poses_of_ur5e(rng, of)
    points = poses[:, :3, 3]
    points[moved_at:] += 0.5, 0.2, 0.0
    return q, points + rng.normal(0.0, 3e-5, points.shape)


@pytest.mark.parametrize("moved_at", [slow(15), 30, slow(36)])
def test_all_parts_are_named(moved_at):
    q, points = moved_rows(3, moved_at)
    points[48:] += [0.3, 0.1, 0.0]
    with refuses(DataError, f"data rows 0–{moved_at - 1} fit", f"{moved_at}–47 to", "48–59 to", "session"):
        identify("ur5e", Dataset(q, points))
    found = identify("ur5e", Dataset(q, points, session=np.digitize(range(60), [moved_at, 48]).astype(str)))
    assert found.best.held_out.position_mm.mean < 0.2


@pytest.mark.parametrize(
    ("first", "said"), [(35, "data rows 0–34 fit"), (0, "off with the best base and tool")]
)
def test_rows_that_fit_nowhere_after_some_are_said_alone(first, said):
    q, points = moved_rows(4, 60)
    points[first:] = np.random.default_rng(0).permutation(points[first:])
    with refuses(DataError, said) as caught:
        identify("ur5e", Dataset(q, points))
    parts = "data rows", "those after them don't"
    assert [part in str(caught.value) for part in parts] == 2 * [first > 0]


def test_a_loose_seat_is_named_and_nothing_else_stepped():
    """The frame stepped by 2.16 mm, it was said, by coefficients of 0 ± 19 mm."""
    robot, rng, k = wb.load_robot("ur5e").bare, np.random.default_rng(4), np.arange(96) // 12
    actual = with_errors(robot, 5e-4 * rng.normal(size=len(robot.default_free)))
    q = rng.uniform(-2.0, 2.0, (96, 6))
    poses, places = actual.predict(q), rng.uniform([0.2, -0.5, 0.1], [0.5, 0.5, 0.5], (8, 3))
    poses[:, :3, 3] = places[k] + rng.normal(0.0, np.where(k == 5, 2.5e-4, 1.5e-5)[:, None], (96, 3))
    touched = follow_many(actual, poses, q, task=Task.POSITION)
    contact = np.array([f"K{seat}" for seat in k[touched.converged]])
    found = wb.diagnose(robot, Dataset(q=touched.q[touched.converged], contact=contact))
    assert (found.causes, found.followed) == ((), ())
    assert "rows whose 'contact' is K5" in found.message
    assert "is their seat loose?" in found.message


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        (
            lambda p: 4e-3 * p / np.linalg.norm(p, axis=1, keepdims=True),
            "distances from the measuring frame's origin are 4",
        ),
        (lambda p: p * [0.0, -2e-3, 0.0], "y of the measuring frame is 0.2 % too short, "),
        (
            lambda p: 1e-3 * p[:, [2, 1, 0]] * [1.0, 0.0, 1.0],
            "x and z of the measuring frame are 2 mrad off square, ",
        ),
    ],
)
def test_an_instrument_that_is_off_does_not_bend_the_arm(wrong, text):
    """The constant of a prism made a saved arm three times worse than nominal, without a word."""
    rows = measured((0.0, 0.0, 0.0), np.zeros(90))
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    points = rows.position @ (turn * np.linalg.det(turn)).T + [1.5, -1.0, 0.4]
    found = identify("ur5e", Dataset(q=rows.q, position=points + wrong(points)))
    assert any(w.startswith(text) for w in found.warnings), found.warnings
    assert not any(
        " of the measuring frame" in w for w in identify("ur5e", Dataset(q=rows.q, position=points)).warnings
    )


def test_a_base_that_is_held_elsewhere_is_told_and_no_axis_of_the_instrument():
    rows = measured((0.0, 0.0, 0.0), np.zeros(90))
    base = wb.Frame(xyz=[3e-3, 0.0, 0.0], free=Freedom.FIXED)
    found = identify(wb.load_robot("ur5e").with_frames(base=base), rows)
    assert any(w.startswith("with the base 2.9") and "free = true" in w for w in found.warnings), (
        found.warnings
    )
    assert not any(" of the measuring frame" in w for w in found.warnings)


def test_stops_of_a_mobile_base_have_a_base_each():
    """Five rows at each of 18 stops, 1.4 mm off; no constant was corrected, status 0."""
    rows, stop = measured((0.0, 0.0, 0.0), np.zeros(90)), np.arange(90) // 5
    off = np.random.default_rng(2).normal(0.0, 3e-3, (18, 3))[stop]
    robot = wb.load_robot("ur5e").with_frames(base=wb.Frame(free=Freedom.FREE))
    found = identify(robot, Dataset(rows.q, rows.position + off, unread={"Ort": stop.astype(str)}))
    assert "session=Ort" in found.common[0]
    assert found.robot.calibration.refused


def test_joints_of_a_slow_motion_are_known_between_its_rows():
    """Differences of rows 0.2 s apart were 1 % too small, which left 0.7 mrad of a delay of 40 ms."""
    t, rates = 0.2 * np.arange(150), 2.0 * np.pi * np.array([0.05, 0.11, 0.17, 0.2, 0.23, 0.08])
    motion = lambda t: 0.7 * np.sin(np.multiply.outer(t, rates) + np.arange(6.0))  # noqa: E731
    rows = Dataset(q=motion(t), position=np.zeros((150, 3)), time=t)
    np.testing.assert_allclose(course(rows, rows, delay=-0.04).q[2:-2], motion(t - 0.04)[2:-2], atol=1e-4)
    speed = (motion(t + 1e-6) - motion(t - 1e-6)) / 2e-6
    np.testing.assert_allclose(course(rows, rows).speed[2:-2], speed[2:-2], atol=2e-3)
