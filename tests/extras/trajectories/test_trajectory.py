"""Trajectories corrected for arms with hidden geometry and effects, measured by the generator's statics."""

import generator
import numpy as np
import pytest
from checks import robot_of
from refusals import mentions, refuses
from scipy.spatial.transform import Rotation

from workbench import Frame, Motion, Robot, tool_poses
from workbench.arm.effects import EFFECTS
from workbench.arm.inverse.damped_newton import Task
from workbench.base.errors import DataError
from workbench.extras.trajectories.correction import correct
from workbench.extras.trajectories.path import command_joints, command_poses

SOFT = np.zeros((6, 3))
SOFT[1] = SOFT[2] = 0.0, 0.0, 4e-5
EFFECT = EFFECTS["joint-compliance"]((1, 2), (4e-5, 4e-5))


@pytest.fixture(scope="module")
def arms(tmp_path_factory):
    """Nominal ARIA and Katana, the robots that model their hidden relatives, and the generator's arms."""
    folder, found = tmp_path_factory.mktemp("arms"), {}
    for name, arm in (("aria", generator.aria()), ("katana", generator.katana())):
        hidden = arm.perturbed(np.random.default_rng(2), length=1e-3, angle=np.deg2rad(0.5))
        found[name] = (*(robot_of(each, folder, name=name) for each in (arm, hidden)), hidden)
    return found


def arc(rows=60):
    """Joints along a smooth path, away from singularities and limits."""
    s = np.linspace(0.0, 1.0, rows)[:, None]
    start = np.array([0.2, 0.3, 0.9, 0.3, 1.0, -0.4])
    return start + s * np.array([0.8, 0.3, -0.3, 0.4, -0.3, 0.6]) + 0.1 * np.sin(6.0 * s + np.arange(6))


def missed(hidden, q, poses, **bend):
    """Distance of the generator's deflected arm from the poses [m]."""
    return np.linalg.norm(hidden.pose(q, hidden.sag(q, **bend))[:, :3, 3] - poses[:, :3, 3], axis=1)


def test_a_bent_arm_follows_what_was_commanded(arms):
    """Ten times better, nowhere worse: measured by other code."""
    nominal, model, hidden = arms["aria"]
    bend = {"compliance": SOFT, "payload": 2.0}
    q = arc()
    motion = Motion(q, payload=np.full(len(q), 2.0))
    commanded = command_joints(model.with_effects(EFFECT), nominal, q)
    np.testing.assert_allclose(commanded.poses, generator.aria().pose(q), atol=1e-12)
    before = missed(hidden, q, commanded.poses, **bend)
    found = correct(commanded, motion=motion)
    after = missed(hidden, found.q, commanded.poses, **bend)
    assert after.mean() < before.mean() / 10.0
    assert (after < before).all()
    np.testing.assert_allclose(found.before.position, before, rtol=2e-3)
    assert not found.kept.any()
    assert found.after.position.max() < 1e-9
    assert found.after.rotation.max() < 1e-9
    # the correction of the geometry alone leaves what the loads do
    rigid = correct(command_joints(model, nominal, q))
    assert missed(hidden, rigid.q, commanded.poses, **bend).mean() > 10.0 * after.mean()


def test_poses_are_followed_in_one_branch(arms):
    nominal, model, _ = arms["aria"]
    poses = generator.aria().pose(arc())
    found = correct(command_poses(model, nominal, poses))
    assert any("[tool]" in note for note in found.notes)
    assert tool_poses(found.commanded.nominal, Motion(found.commanded.q)) == pytest.approx(poses, abs=1e-8)
    np.testing.assert_allclose(tool_poses(found.commanded.calibrated, Motion(found.q)), poses, atol=1e-8)
    assert np.abs(np.diff(found.q, axis=0)).max() < 0.1
    few = command_poses(model, nominal, poses[[0, 59]]).q  # a joint moves by 0.77 rad between them
    np.testing.assert_allclose(few, found.commanded.q[[0, 59]], atol=1e-6)
    points = correct(command_poses(model, nominal, poses, positions_only=True))
    at = tool_poses(points.commanded.calibrated, Motion(points.q))
    np.testing.assert_allclose(at[:, :3, 3], poses[:, :3, 3], atol=1e-8)
    turn = points.commanded.poses[:, :3, :3].swapaxes(1, 2) @ at[:, :3, :3]
    np.testing.assert_allclose(points.after.rotation, Rotation.from_matrix(turn).magnitude(), atol=1e-8)
    assert points.before.rotation.min() > 1e-4


def test_five_joints_meet_position_and_axis(arms):
    nominal, model, _ = arms["katana"]
    model = model.with_effects(EFFECTS["joint-compliance"]((1, 2, 3), (1e-3,) * 3))
    s = np.linspace(0.0, 1.0, 30)[:, None]
    q = np.array([0.3, 1.0, -1.2, 0.8, 0.5]) + 0.3 * s
    found = correct(command_joints(model, nominal, q))
    at, wanted = tool_poses(found.commanded.calibrated, Motion(found.q)), found.commanded.poses
    np.testing.assert_allclose(at[:, :3, 2:], wanted[:, :3, 2:], atol=1e-8)
    assert found.commanded.task is Task.POSITION_AXIS


def test_four_joints_meet_the_position_and_the_turn_they_have():
    rows = np.array([[0, 0.3, 0, np.pi / 2], [0, 0, 0.3, 0], [0, 0, 0.25, 0], [0, 0, 0.1, 0]])
    off = np.random.default_rng(1).uniform(-2e-3, 2e-3, rows.shape)
    nominal, model = (Robot.from_dh(rows + e, name="four") for e in (0.0, off))
    q = np.random.default_rng(2).uniform(0.3, 1.0, (20, 4))
    found = correct(command_joints(model.with_frames(tool=Frame(xyz=[0.05, 0.02, 0.03])), nominal, q))
    assert found.after.position.max() < 1e-9
    assert np.ptp((found.q - q)[:, 1:].sum(1)) < 2e-5  # the pitch is kept
    assert found.after.rotation.min() > 1e-4  # what these joints can't turn is told


def test_a_base_in_the_measuring_frame_and_its_drift_do_not_matter(arms):
    nominal, model, _ = arms["aria"]
    there = Frame.from_pose(generator.turn("z", 1.0) @ generator.move("x", 2.0))
    drifting = model.with_frames(base=there).with_effects(EFFECTS["base-drift"]((), (1e-6,) * 6))
    plain, moved = (correct(command_joints(arm, nominal, arc())) for arm in (model, drifting))
    np.testing.assert_allclose(moved.q, plain.q, atol=1e-9)
    assert any("drift" in note for note in moved.notes)


def test_rows_that_nothing_can_help_are_not_made_worse(arms):
    """Backlash by load where the load changes its sign: either flank misses, some rows keep theirs."""
    nominal = arms["aria"][0]
    play = EFFECTS["backlash"]((1, 2, 3, 4), (5e-4,) * 4)
    q = arc(200)
    found = correct(command_joints(nominal.with_effects(play), nominal, q))
    actual = tool_poses(nominal.with_effects(play), Motion(found.q))
    after = np.linalg.norm(actual[:, :3, 3] - found.commanded.poses[:, :3, 3], axis=1)
    assert (after <= found.before.position + 1e-9).all()
    np.testing.assert_allclose(after, found.after.position, atol=1e-9)
    assert np.median(after) < 1e-9


def test_what_forbids_a_row_is_named(arms):
    nominal, model, _ = arms["aria"]
    high = nominal.limits[:, 1]
    q = arc()
    outside = q.copy()
    outside[7, 2] = high[2] + 0.1
    with refuses(DataError, row=7, joint=2):
        command_joints(model, nominal, outside)
    edge = q.copy()
    edge[9, 1] = high[1]
    offset = nominal.with_values({"joint2.theta": -0.01})
    with refuses(DataError, row=9, joint=1):
        correct(command_joints(offset, nominal, edge))
    knots = tuple(np.linspace(-0.5, 0.5, 5))
    known = nominal.with_effects(EFFECTS["local-joint-error"]((0,), (1e-3,) * 5, knots=knots))
    (note,) = (n for n in correct(command_joints(known, nominal, q)).notes if "-28.65° to 28.65°" in n)
    assert mentions(note, "joint 1")
    home = np.array([[0.2, 0.3, -1.2, 0.3, 0.0, -0.4]])  # joints 4 and 6 in line
    with refuses(DataError, "--positions-only", row=0):
        correct(command_joints(model, nominal, home, time=np.zeros(1)))
    found = correct(command_joints(model, nominal, home))  # a target that no path leads to
    assert found.after.position[0] < 1e-6 < found.before.position[0]
    assert "near a singularity" in found.notes[-1]


def test_a_correction_that_does_not_converge_is_refused(arms):
    """An arm that came out shorter than drawn does not reach what the drawing reaches when stretched."""
    nominal = arms["aria"][0]
    short = nominal.with_values({"joint4.d": 0.336 - 0.02})
    q = np.tile([0.2, 0.3, -1.2, 0.3, 0.4, -0.4], (8, 1))
    q[7, 2] = 0.0  # stretched
    time = np.linspace(0.0, 3.5, 8)
    with refuses(DataError, "3.500 s", row=7):
        correct(command_joints(short, nominal, q, positions_only=True, time=time))
