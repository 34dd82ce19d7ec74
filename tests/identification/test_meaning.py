"""What rows mean: every changed reading is named right or not at all, and never another.

The rows are computed by other code, a product of matrices, of arms with errors of 1 mm and 1 mrad; what was
changed in them is undone by the reading that is found, on postures that were not measured.
"""

from dataclasses import replace

import numpy as np
import pytest
from generator import VirtualArm, shift, turn
from refusals import mentions, refuses
from scipy.spatial.transform import Rotation
from slow import slow

from workbench import Dataset, Frame, Robot, evaluate, identify, load_plate, load_robot, measure_plate, rezero
from workbench.arm.inverse.solve import Task, follow_many
from workbench.arm.robot_toml import robot_to_table
from workbench.arm.signs_and_offsets import with_couplings
from workbench.base.errors import DataError, OptionError, UnitError
from workbench.data.orientations import ORIENTATIONS, WrittenOrientation
from workbench.data.simulation.simulate import virtual_arm
from workbench.identification.checks.arm_match import arm_match
from workbench.identification.meaning import families
from workbench.identification.meaning.as_read import as_read
from workbench.identification.meaning.read_rows import read_rows

H, E = np.pi / 2, np.eye(6)
ARMS = {
    "puma": ([(0, 0.67, 0, H), (0, 0, 0.43, 0), (0, 0.15, 0.02, -H), (0, 0.43, 0, H), (0, 0, 0, -H),
              (0, 0.06, 0, 0)], "rrrrrr"),
    "seven": ([(0, 0.36, 0, -H), (0, 0, 0, H), (0, 0.42, 0, H), (0, 0, 0, -H), (0, 0.4, 0, -H), (0, 0, 0, H),
               (0, 0.126, 0, 0)], "rrrrrrr"),
    "cobot": ([(0, 0.15, 0, -H), (-H, 0.15, 0.43, 0), (0, -0.13, 0.41, 0), (H, 0.11, 0, H), (0, 0.11, 0, -H),
               (0, 0.11, 0, 0)], "rrrrrr"),
    "scara": ([(0, 0.3, 0.35, 0), (0, 0, 0.25, np.pi), (0, 0.1, 0, 0), (0, 0, 0, 0)], "rrpr"),
    "gantry": ([(0, 1, 0, -H), (-H, 1, 0, -H), (H, 0.5, 0, 0), (0, 0.2, 0, H), (0, 0, 0.1, -H),
                (0, 0.15, 0, 0)], "ppprrr"),
}  # fmt: skip


def measured(name: str, *, with_rotation: bool, seed: int = 3, alone: float = 1.0) -> tuple[Robot, Dataset]:
    table, kinds = ARMS[name]
    rng = np.random.default_rng(seed)
    made = np.array(table, float) + rng.uniform(-1e-3, 1e-3, (len(table), 4))
    span = np.array([1.8 if kind == "r" else 0.4 for kind in kinds])
    q = rng.uniform(-span, span, (50, len(kinds)))
    q *= np.where(np.arange(50)[:, None] % len(kinds) == np.arange(len(kinds)), 1.0, alone)
    base = shift([1.2, -0.7, 0.4]) @ turn("z", 0.8) @ turn("x", 0.3)
    tool = shift([0.05, 0.08, 0.11]) @ turn("y", 0.4)
    slides = tuple(kind == "p" for kind in kinds)
    seen = VirtualArm("dh", np.pad(made, ((0, 0), (0, 1))), base, tool, slides=slides).pose(q)
    xyz = seen[:, :3, 3] + rng.normal(0.0, 5e-5, (50, 3))
    rows = (dict(zip(("theta", "d", "a", "alpha"), row, strict=True)) for row in table)
    types = ("prismatic" if kind == "p" else "revolute" for kind in kinds)
    joints = [{"type": kind, **row} for kind, row in zip(types, rows, strict=True)]
    rows = Dataset(q=q, position=xyz, rotation=seen[:, :3, :3] if with_rotation else None, source=name)
    return Robot.from_dh(joints, name=name), rows


def motors(q: np.ndarray, k: int, share: float) -> np.ndarray:
    """A differential's motors: differences and sums of two joints."""
    shown = q.copy()
    shown[:, k], shown[:, k + 1] = share * (q[:, k] - q[:, k + 1]), share * (q[:, k] + q[:, k + 1])
    return shown


@pytest.mark.parametrize("kind", [k for k in ORIENTATIONS if k.numbers == 3][::4], ids=lambda k: k.name)
def test_orientations_are_read_in_their_convention(kind):
    robot, data = measured("puma", with_rotation=True)
    turns = Rotation.from_matrix(data.rotation)
    numbers = turns.as_rotvec() if kind.name == "rotvec" else turns.as_euler(kind.name)
    for declared in ("rotvec", "xyz"):
        wrong = next(k for k in ORIENTATIONS if k.name == declared).matrices(numbers)
        rows = replace(data, rotation=wrong, written=WrittenOrientation(declared, numbers))
        read = as_read(robot, rows)[1]
        np.testing.assert_allclose(read.rotation, data.rotation, atol=1e-9)
        unnamed = replace(data, rotation=None, written=WrittenOrientation("", numbers))
        np.testing.assert_allclose(as_read(robot, unnamed)[1].rotation, data.rotation, atol=1e-9)
        assert (kind.name == declared) == (read is rows)
        assert evaluate(robot, rows, fit_frames=True).errors.orientation_deg.max < 1.0


@pytest.mark.parametrize(
    ("name", "with_rotation", "change", "text"),
    [
        ("puma", False, lambda d: replace(d, position=d.position / 25.4), "inch read as mm"),
        ("puma", False, lambda d: replace(d, position=d.position[:, [1, 0, 2]]), "left-handed"),
        ("puma", True, lambda d: replace(d, position=d.position[:, [0, 2, 1]]), "y and z are exchanged"),
        ("puma", True, lambda d: replace(d, position=-d.position), "and orientations with them"),
        ("seven", True, lambda d: replace(d, position=-d.position), "joint 7 = -q7: 1.3 mm"),
        ("puma", False, lambda d: replace(d, q=motors(d.q, 4, 1.0)), "joint 6 = 0.5 q6 - 0.5 q5"),
        (
            "puma",
            True,
            lambda d: replace(d, q=d.q + d.q @ np.eye(6, k=1) * [0, 0, 0, 0, 1, 1]),
            "q6 + q4 - q5",
        ),
        ("seven", False, lambda d: replace(d, q=motors(d.q, 4, 0.5)), "joint 6 = q6 - q5"),
        ("cobot", True, lambda d: replace(d, q=d.q - 0.536 * d.q[:, [5]] * E[4]), "joint 5 = q5 + 0.5368 q6"),
        ("puma", False, lambda d: replace(d, q=d.q + H * E[1] + d.q[:, [1]] * E[2]), "joint 3 = q3 - q2 +"),
        ("scara", False, lambda d: replace(d, q=d.q * [1, 1, -1, 1]), "joint 3 = -q3"),  # a mirror, too
        (
            "scara",
            True,
            lambda d: replace(d, q=d.q - 0.02 * d.q[:, [3]] * E[2, :4]),
            "joint 3 = q3 + 19.99 mm/rad q4",
        ),
        ("puma", False, lambda d: replace(d, q=d.q - 0.3 * d.q[:, [1]] * E[4]), "joint 5 = q5 + 0.2991 q2"),
        (
            "scara",
            True,
            lambda d: replace(d, q=d.q + np.outer(d.q[:, 0] + d.q[:, 1], [0, 0, 0, 1])),
            "joint 4 = q4 - q1 - q2",
        ),
    ],
)
def test_units_axes_and_a_slide_that_mirrors(name, with_rotation, change, text):
    robot, data = measured(name, with_rotation=with_rotation)
    found = arm_match(robot, change(data))
    assert (found.is_foreign, bool(found.readings), mentions(found.text, text)) == (True, True, True)


def test_an_arm_whose_joints_follow_is_coupled_and_one_that_slides_takes_mm():
    robot, data = measured("puma", with_rotation=False)
    with refuses(DataError, "joint 3 = q3 + q2"):
        as_read(with_couplings(robot, -np.eye(6, k=-1) * (np.arange(6) == 2)[:, None]), data)


def test_a_slide_that_follows_a_turn_a_little_is_told_after_the_fit():
    """Geometry passed for a ball screw's spline: 5° of tilt, saved without a word."""
    robot, data = measured("scara", with_rotation=False)
    spline = replace(data, q=data.q - 3e-3 * data.q[:, [3]] * E[2, :4])
    said = identify(robot, spline, reading="given").warnings
    assert mentions(" ".join(said), "joint 3 moves along with joint 4, which leaves 26 %", "diagnose")


def test_rows_tell_units_of_what_slides_and_without_orientations_that_fit_none():
    robot, data = measured("scara", with_rotation=True)
    data = data.take(np.arange(8))  # fewer than a part may have
    for factor, unit, turned in ((1.0, "m", None), (1e3, "mm", data.rotation[::-1].copy())):
        shown = replace(data, q=data.q * [1, 1, factor, 1], rotation=None, missing_units="J1: rad or deg")
        read = as_read(robot, replace(shown, rotation=turned))[1]
        np.testing.assert_allclose(read.q, data.q, atol=1e-12)
        assert any(mentions(note, f"what slides is in {unit}") for note in read.notes)
        for angle in (1.0, np.pi / 180.0):  # in the file deg or rad, read as deg
            q = np.where([1, 1, 0, 1], angle, np.pi / 180.0) * shown.q
            read = as_read(robot, replace(shown, q=q, joint_units=("deg",) * 4), "given")[1]
            np.testing.assert_allclose(read.q, data.q, atol=1e-12)
    with refuses(UnitError, "m or mm for q3"):
        as_read(robot, replace(shown, position=data.position[::-1]))


def test_rows_shifted_by_one_against_the_joints_are_told():
    robot, data = measured("puma", with_rotation=False)
    rows = np.arange(len(data) - 1)
    whole = replace(data.take(rows + 1), q=data.q[rows])
    assert mentions(arm_match(robot, whole).text, "joints of the row after", "shift joints or places")
    kept = np.delete(np.arange(len(data)), 20)  # a place of row 20 is missing
    part = replace(data.take(kept), q=data.q[rows])
    assert mentions(arm_match(robot, part).text, "those after them don't", "joints of the row after")
    later = replace(data, q=np.where(np.arange(len(data))[:, None] >= 25, np.radians(data.q), data.q))
    assert mentions(arm_match(robot, later).text, "those after them don't: with joints 1–6 in rad", "unit")
    wrist = replace(data, q=np.where(np.arange(6) % 5 < 3, data.q, np.radians(data.q)))
    assert mentions(arm_match(robot, wrist).text, "with joints 4, 5 in rad, not degrees, they fit")


def test_a_coupling_is_told_by_joints_that_move_alone_though_some_signs_are_not():
    robot, data = measured("puma", with_rotation=False, seed=5, alone=0.0)
    shown = replace(data, q=data.q - data.q[:, [1]] * E[2])
    with refuses(DataError, "joint 3 = q3 + q2", "or else joint 3 = q3 + q2; joint 4 = -q4", "can't tell"):
        as_read(robot, shown)
    arm, read, _ = as_read(robot, shown, "found")
    np.testing.assert_allclose(arm.predict(read.q), robot.predict(data.q), atol=1e-9)


def test_the_pose_of_the_base_in_the_tool_and_the_column_of_a_jaw():
    robot, data = measured("seven", with_rotation=True)
    turned = np.swapaxes(data.rotation, 1, 2)
    inverse = replace(data, rotation=turned, position=-(turned @ data.position[..., None])[..., 0])
    jaw = replace(data, q=np.insert(data.q, 7, np.linspace(0.0, 0.4, len(data)), axis=1))
    for given, said in ((inverse, "base in the tool"), (jaw, "q8 moves no joint of this arm")):
        read = as_read(robot, given)[1]
        assert mentions(read.read_as, said)
        np.testing.assert_allclose(read.position, data.position, atol=1e-9)
        np.testing.assert_array_equal(read.q, data.q)


@pytest.mark.parametrize("name", ARMS)
def test_rows_that_fit_are_read_in_silence(name):
    robot, data = measured(name, with_rotation=False)
    assert as_read(robot, data)[1] is data
    with refuses(OptionError, "'auto', 'found' or 'given'"):
        as_read(robot, data, "Found")
    assert not arm_match(robot, data).is_foreign


def test_a_column_that_was_left_out_tells_which_rows_belong_together():
    robot, data = measured("puma", with_rotation=False)
    later = np.arange(len(data)) >= 25
    places, stations = data.position + 0.3 * later[:, None], {"Station": np.where(later, "S2", "S1")}
    with refuses(DataError, "columns='session=Station'"):
        as_read(robot, replace(data, position=places, unread=stations))
    robot, turned = measured("puma", with_rotation=True)
    _, read, _ = as_read(robot, replace(turned, rotation=turn("x", 2.5)[:3, :3] @ turned.rotation))
    assert mentions("; ".join(read.notes), "the positions alone fit", "columns='rx=-,…'")
    valid = np.arange(len(data)) % 3 > 0
    stale = np.where(valid[:, None], data.position, np.roll(data.position, 1, axis=0))
    marked = replace(data, position=stale, unread={"tracked": valid.astype(str)})
    assert not arm_match(robot, marked).is_foreign
    two = replace(marked, session=np.where(np.arange(len(data)) < 2 * len(data) // 3, "a", "b"))
    for rows in (marked, two):  # in all sessions, not in the largest alone
        assert as_read(robot, rows)[1].included.tolist() == valid.tolist()
    few = np.where(np.arange(len(data)) < len(data) - 8, "Anna", "Ben")  # tells nothing of one wrong row
    wrong = data.position + 0.4 * (np.arange(len(data)) == 5)[:, None]
    assert as_read(robot, replace(data, position=wrong, unread={"who": few}))[1].included.all()


def test_points_of_no_arm_end_with_all_that_was_tried():
    robot, data = measured("puma", with_rotation=False)
    noise = replace(data, position=np.random.default_rng(0).normal(0.0, 0.4, (50, 3)))
    with refuses(DataError, "tried in full", "signs and couplings", "orders"):
        identify(robot, noise)


def test_a_person_decides_once():
    robot, data = measured("puma", with_rotation=True)
    inverted = replace(data, q=data.q * [1, -1, 1, -1, -1, 1])
    with refuses(DataError, "joint 2 = -q2; joint 4 = -q4; joint 5", "reading='found' (--reading)"):
        identify(robot, inverted)
    with pytest.raises(DataError):
        evaluate(robot, inverted)
    names = "found", "joint 2 = -q2; joint 4 = -q4; joint 5 = -q5"
    found, _ = (identify(robot, inverted, reading=how) for how in names)
    assert found.error.after.position_mm.mean < 0.2
    assert any("joint 4 = -q4" in note for note in found.notes)


def test_of_equal_readings_a_person_chooses():
    robot, data = measured("seven", with_rotation=False)
    mirrored = replace(data, position=data.position * [1, -1, 1])
    with refuses(DataError, "reading='left-handed axes' or 'joint 1 = -q1' (--reading)"):
        identify(robot, mirrored, reading="found")
    read = [as_read(robot, mirrored, how)[1] for how in ("left-handed axes", "joint 1 = -q1")]
    assert [(rows.position == -mirrored.position).all() for rows in read] == [True, False]


def test_points_on_the_last_axis_can_not_tell_its_sign():
    robot = measured("puma", with_rotation=False)[0].bare
    q = np.random.default_rng(0).uniform(-1.8, 1.8, (40, 6))
    seen = robot.predict(q)[:, :3, 3]
    found = read_rows(robot, Dataset(q=q * [1, -1, -1, 1, -1, 1], position=seen))
    assert found.best.text == "joint 2 = -q2; joint 3 = -q3; joint 5 = -q5"
    assert any("joint 6 = -q6" in text for text in found.blind)


def test_a_near_twin_a_free_frame_and_two_rows_are_told():
    q = np.random.default_rng(0).uniform(-1.8, 1.8, (40, 6))
    arm, twin, small = map(load_robot, ("ur10e", "ur10", "ur5e"))
    rows = Dataset(q=q, position=arm.predict(q)[:, :3, 3] + [2.0, 0.0, 0.0])
    found = evaluate(twin, rows)
    assert mentions(found.foreign, "the arm is UR10e", "choose the robot 'ur10e'")
    held = arm.with_frames(base=Frame(), tool=Frame())  # as of a file with free = false
    assert all("computed" in evaluate(each, rows, fit_frames=True).warnings[-1] for each in (arm, held))
    with refuses(DataError, "correct [base] in its file"):
        identify(held, rows)
    with refuses(DataError, "correct [base] and [tool]"):
        identify(held, replace(rows, position=arm.predict(q)[:, :3] @ [0.3, 0.4, 0.0, 1.0] + [2.0, 0.0, 0.0]))
    assert mentions(evaluate(small, rows).warnings[0], "hardly this arm's")
    turned = replace(rows, rotation=arm.predict(-q)[:, :3, :3])
    assert mentions(evaluate(arm, turned).warnings[0], "mm and", "hardly this arm's")
    assert not read_rows(small, rows).blind
    assert mentions(evaluate(arm, rows.take(np.arange(2)), fit_frames=True).warnings[0], "2 rows can't tell")
    made = virtual_arm(arm, rng=np.random.default_rng(2))
    seen = replace(rows, position=made.predict(q)[:, :3, 3])
    near = virtual_arm(arm, rng=np.random.default_rng(2), errors=(3e-4, 3e-4))
    runs = [identify(a, seen, reading=how) for a, how in ((arm, "auto"), (twin, "given"))]
    reasons = [run.robot.calibration.refused.get("", "") for run in runs]
    assert ["lengths found are those of 'ur10e'" in reason for reason in reasons] == [False, True]
    for use in (identify, rezero):
        with refuses(DataError, "the arm is UR10e", "choose the robot"):
            use(twin, replace(rows, position=near.predict(q)[:, :3, 3]))


def test_a_frozen_reading_is_named_and_its_rows_can_be_excluded():
    robot, data = measured("puma", with_rotation=False)
    position = data.position.copy()
    position[10:20] = position[9]
    stuck = replace(data, position=position)
    with refuses(DataError, "10 rows (10–19)", "reading stays the same"):
        identify(robot, stuck)
    assert identify(robot, stuck, exclude=range(10, 20)).best.held_out.position_mm.max < 1.0


@pytest.mark.parametrize(("constant", "by"), [("joint2.a", 0.07), slow("joint4.d", -0.05)])
def test_one_constant_of_the_table_is_named_where_nothing_else_fits(constant, by):
    robot, data = measured("puma", with_rotation=True)
    wrong = robot.with_values({constant: float(robot.values((constant,))[0]) + by})
    rows = as_read(wrong, data)[1]
    assert mentions(rows.notes[-1], constant, "instead of", "they fit to")
    assert not read_rows(robot, data).told


@pytest.mark.parametrize("name", ["puma", "scara"])
def test_a_table_in_the_other_convention_is_named(name):
    robot, data = measured(name, with_rotation=False)
    joints = robot_to_table(robot)["joint"]
    with refuses(DataError, 'write convention = "dh" in the robot'):
        identify(Robot.from_dh(joints, "craig"), data)


@pytest.mark.parametrize("seed", [1, 8, 14, 22, 26, 29])
def test_ten_seats_of_a_plate_are_the_arms_own(seed):
    """Turns about nearly one axis misled both closed forms: one plate of five was of another robot."""
    arm = load_robot("aria")
    _, rows = measure_plate(arm, load_plate("table2"), seed=seed)
    found = read_rows(arm, rows)
    assert found.best.is_plain
    assert found.best.position < 0.005


@pytest.mark.parametrize("kind", ["plane", "sphere"])
def test_contacts_that_only_planes_explain_are_with_planes(kind):
    robot = load_robot("katana450")
    actual = virtual_arm(robot, rng=np.random.default_rng(0), errors=(5e-4, 2e-3))
    q = np.random.default_rng(2).uniform(*robot.search_limits.T, (60, robot.dof))
    poses, k = actual.predict(q), np.arange(60) % 3
    if kind == "plane":
        poses[np.arange(60), k, 3] = np.array([0.2, 0.2, 0.25])[k]
    else:
        poses[:, :3, 3] = np.array([[0.3, 0.0, 0.3], [0.0, 0.3, 0.3], [0.2, 0.2, 0.4]])[k]
    touched = follow_many(actual, poses, q, task=Task.POSITION)
    contact = np.array([f"top {name}" for name in k[touched.converged]])
    found = as_read(robot, Dataset(q=touched.q[touched.converged], contact=contact))[1].contact
    assert np.char.startswith(found, "plane top").all() == (kind == "plane")


def test_a_row_far_off_is_set_aside_though_it_is_held_out_and_others_hid_it():
    robot, data = measured("puma", with_rotation=False)
    position, rows = data.position.copy(), np.random.default_rng(3).choice(50, 5, replace=False)
    position[rows] = -9.999
    run = identify(robot, replace(data, position=position), reading="given")
    assert sorted(one.row for one in run.outliers) == sorted(rows)


def test_no_family_of_readings_is_searched_without_bound(monkeypatch):
    """Nine joints have 8 million quarter turns with signs: their search had no end."""
    monkeypatch.setattr(families, "MOST", 500)
    own = families.JointColumns(load_robot("aria").bare, np.zeros((5, 6)))
    assert max(len(some.cost) for each in families.FAMILIES for some in each.of(own)) <= 500
    assert len(own.orders[0]) == 15


def test_rows_that_the_nominal_arm_computed_are_named():
    """Targets that were filled in bent the arm: 26 of 80 left 0.7 mm, and none of them was named."""
    robot, data = measured("puma", with_rotation=False)
    base, tip = shift([1.2, -0.7, 0.4]) @ turn("z", 0.8) @ turn("x", 0.3), [0.05, 0.08, 0.11, 1.0]
    rows, own = np.arange(50) % 3 == 1, np.round((base @ robot.predict(data.q) @ tip)[:, :3], 7)
    found = identify(robot, replace(data, position=np.where(rows[:, None], own, data.position)))
    assert mentions(found.common[0], "17 of 50 rows were computed with the nominal arm")
    assert f"--exclude {','.join(map(str, np.flatnonzero(rows)))} " in found.common[0]
    assert found.common[0] in found.robot.calibration.refused[""]


@pytest.mark.parametrize("hidden", [0.0, 0.3])
def test_markers_whose_names_were_exchanged_are_put_back(hidden):
    """Rows of the wrong order were excluded, one held out was 49 mm off and not named; or base and tool were
    said to have moved."""
    rng, (robot, data) = np.random.default_rng(4), measured("puma", with_rotation=True)
    body = np.array([[0.0, 0.0, 0.0], [0.06, 0.0, 0.0], [0.0, 0.05, 0.01], [0.02, 0.02, 0.07]])
    seen = data.position[:, None] + np.einsum("rij,mj->rmi", data.rotation, body)
    seen[rng.random(seen.shape[:2]) < hidden] = np.nan
    rows = np.arange(50) >= 30
    markers = np.where(rows[:, None, None], seen[:, [1, 2, 0, 3]], seen)
    found = identify(robot, replace(data, position=None, rotation=None, markers=markers))
    assert mentions(" ".join(found.notes), "markers 1 and 2 and 3 are exchanged in rows 30–49")
    assert not found.outliers
    assert found.best.held_out.position_mm.max < 0.3


def test_a_held_out_row_of_markers_that_no_arm_explains_is_named():
    rng, (robot, data) = np.random.default_rng(4), measured("puma", with_rotation=True)
    body = np.array([[0.06, 0.0, 0.0], [-0.06, 0.0, 0.0], [0.0, 0.1, 0.0]])
    markers = data.position[:, None] + np.einsum("rij,mj->rmi", data.rotation, body)
    row = identify(robot, rows := replace(data, position=None, rotation=None, markers=markers)).held_out_rows[
        2
    ]
    markers[row, 1] += rng.normal(0.0, 4e-3, 3)
    assert identify(robot, replace(rows, markers=markers)).suspects == (row,)
