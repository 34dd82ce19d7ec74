"""Gravity's direction and tilts beside positions as unknowns: derivatives, recovery, files."""

from dataclasses import replace

import numpy as np
import pytest
from checks import check_jacobian
from generator import move, turn
from slow import slow

from workbench import Dataset, Frame, Motion, Noise, identify, load_robot, tool_poses, write_toml
from workbench.arm.effects.joint_compliance import JointCompliance
from workbench.arm.frame import FRAME_PARTS
from workbench.arm.gravity import GRAVITY, angles_between, tilted
from workbench.arm.kinematics.forward import watched_poses
from workbench.arm.robot_toml import read_toml, robot_to_table
from workbench.arm.statics.wrenches import TrialArm, load_regressor, masses, motion_wrenches
from workbench.data.observations.tilt import reading, seen_from
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.problem import FrameFreedom, Problem

SOFT = JointCompliance((1, 2), (3e-4, 5e-4))
ODD = np.array([1.2, -0.7, -9.6])
NOISE = Noise(1e-4, 1e-4, tilt=1e-4)


def arm(gravity=ODD):
    robot = load_robot("aria").with_effects(SOFT)
    return robot.under(gravity).with_frames(base=Frame.from_pose(move("x", 0.4) @ turn("y", 0.1)))


def rows(robot, number=30, seed=0, links=(0, 2, 5)):
    """Positions, and tilts of some links, of a robot as it stands; exact."""
    q = np.random.default_rng(seed).uniform(-2.0, 2.0, (number, robot.dof))
    motion = Motion(q)
    tilt = {k: reading(seen_from(watched_poses(robot, motion, k)[:, :3, :3])) for k in links}
    return Dataset(q, tool_poses(robot, motion)[:, :3, 3], tilt=tilt or None)


def test_gravity_turns_about_the_axes_across_it():
    upright = np.array([0.0, 0.0, -9.81])
    a = 0.02
    expected = 9.81 * np.array([0.0, np.sin(a), -np.cos(a)])
    assert tilted(upright, np.array([a, 0.0])) == pytest.approx(expected, rel=1e-7, abs=1e-14)
    assert angles_between(ODD, tilted(ODD, np.array([0.2, -0.1]))) == pytest.approx([0.2, -0.1], abs=1e-12)
    assert tilted(ODD, np.array([0.01, -0.02])) @ ODD == pytest.approx(
        (ODD @ ODD) * np.cos(np.hypot(0.01, 0.02))
    )


@pytest.mark.parametrize(
    ("gravity", "at", "tolerance"),
    [(ODD, (0.0, 0.0), 1e-7), (np.array([0.0, 0.1, 9.81]), (0.05, -0.05), 0.1)],
)
def test_wrenches_by_the_angles_of_gravity(gravity, at, tolerance):
    """Also where an arm hangs: the axes of the gravity that was found flip about there; fits got stuck."""
    robot = arm(gravity)
    motion = Motion(np.random.default_rng(1).uniform(-2, 2, (6, 6)), payload=np.linspace(0.0, 2.0, 6))
    here = TrialArm(robot, robot.chain, (), replace(masses(robot), gravity=tilted(gravity, np.array(at))))
    check_jacobian(
        lambda a: motion_wrenches(robot.under(tilted(gravity, a)), motion),
        load_regressor(here, motion, len(robot.inertia) + np.arange(2)),
        np.array(at),
        tolerance=tolerance,
    )


@pytest.mark.parametrize(("sessions", "levelled", "inertia"), [(0, 1, 0), (1, 1, 1), slow(0, 0, 1)])
@pytest.mark.parametrize("links", [(), (0, 2, 5)])
def test_residuals_by_all_unknowns(links, inertia, levelled, sessions):
    """With loads and without free masses, with tilts or without, of one placement or of two."""
    robot = arm()
    data = rows(robot, 12, links=links)
    names = np.where(np.arange(12) % 2, "a", "b")
    if sessions:
        base, gravity = Frame.from_pose(turn("z", 0.4)), tilted(ODD, np.array([0.1, 0.0]))
        other = replace(robot.mounting, base=base, gravity=gravity)
        robot = replace(robot, sessions={"a": robot.mounting, "b": other})
        data = replace(data, session=names)
    problem = Problem.build(
        robot,
        data,
        effects=SOFT.names,
        inertia=inertia,
        noise=NOISE,
        frames=FrameFreedom(FRAME_PARTS, (), base_per_session=sessions, levelled=levelled),
    )
    angles = [n for n in problem.names if n.startswith("gravity")]
    assert len(angles) == (2 * (1 + sessions) if links or inertia else 0)
    x = problem.start + np.random.default_rng(3).normal(0.0, 1e-6, len(problem.start))
    check_jacobian(lambda x: -problem.residual(x), problem.evaluate(x).jacobian, x, tolerance=2e-5, step=1e-5)


def test_how_the_arm_stands_is_read_from_its_base(tmp_path):
    """Tilts find gravity and how askew inclinometers are mounted; the file then deflects as the arm does."""
    standing = tilted(ODD, np.array([0.010, -0.006]))
    actual = arm(standing)
    data = rows(actual, 60)
    rng = np.random.default_rng(5)
    askew = {0: np.zeros(2), 2: np.array([4e-3, -2e-3]), 5: np.array([-1e-3, 3e-3])}
    tilt = {k: t + askew[k] + rng.normal(0.0, 2e-5, t.shape) for k, t in data.tilt.items()}
    data = replace(data, tilt=tilt, position=data.position + rng.normal(0.0, 2e-5, data.position.shape))
    problem = Problem.build(arm(), data, free=(), noise=Noise(2e-5, 1e-4, tilt=2e-5))
    found = problem.robot_at(Opt2(limit=60).search(problem).x)
    assert np.degrees(np.arccos(found.gravity @ standing / (ODD @ ODD))) < 0.01
    write_toml(found, tmp_path / "arm.toml")
    back = read_toml(tmp_path / "arm.toml")
    np.testing.assert_allclose(back.gravity, found.gravity)
    np.testing.assert_allclose(tool_poses(back, Motion(data.q))[:, :3, 3], data.position, atol=2e-4)


def test_sessions_keep_their_gravity_in_the_file(tmp_path):
    robot = arm()
    common = replace(robot.mounting, gravity_tolerance=1e-3)
    other = replace(common, gravity=tilted(ODD, np.array([0.1, 0.0])))
    robot = replace(robot, mounting=common, sessions={"b": other, "c": common})
    write_toml(robot, tmp_path / "arm.toml")
    back = read_toml(tmp_path / "arm.toml")
    assert back.mounting.gravity_tolerance == 1e-3
    for each in (robot, back):
        assert ["gravity" in table for table in robot_to_table(each)["session"]] == [True, False]
    np.testing.assert_allclose(back.in_session("b").gravity, other.gravity)
    np.testing.assert_allclose(back.in_session("a").gravity, ODD)
    moved = robot.with_values(dict(zip(GRAVITY, (0.01, 0.0), strict=True)))
    assert moved.gravity[1] != ODD[1]
    assert moved.in_session("c").gravity is moved.gravity
    assert moved.in_session("b").gravity is other.gravity


def test_the_noise_of_tilts_is_estimated_beside_a_given_one():
    """Their usual 0.02° weighed 0.5° as if it were exact, and the arm became eight times worse."""
    rng, robot = np.random.default_rng(3), load_robot("ur5e")
    data = rows(robot, 60, links=(2,))
    tilt = {k: t + rng.normal(0.0, 8e-3, t.shape) for k, t in data.tilt.items()}
    data = replace(data, tilt=tilt, position=data.position + rng.normal(0.0, 1e-4, data.position.shape))
    assert identify(robot, data, noise="0.1mm,0.02deg").noise.tilt == pytest.approx(8e-3, rel=0.4)
