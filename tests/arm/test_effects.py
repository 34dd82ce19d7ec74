"""Every effect of the catalogue: it fits its arm, changes nothing at zero, and has the right derivative."""

from dataclasses import replace

import checks
import generator
import numpy as np
import pytest
from checks import joint_wrenches
from refusals import mentions, refuses
from scipy.optimize import brentq
from slow import slow

from workbench import Motion, Robot, load_robot, read_urdf, write_urdf
from workbench.arm.effects import EFFECTS
from workbench.arm.frame import FRAME_PARTS
from workbench.arm.kinematics import forward
from workbench.arm.statics.deflection import deflect, shift_of
from workbench.arm.statics.load_derivatives import wrench_derivative
from workbench.arm.statics.moments import joint_moments
from workbench.base.errors import DataError, RobotError
from workbench.base.types import Outcome

KNOTS = tuple(np.linspace(-3.2, 3.2, 7))
SIZES = dict.fromkeys(("m", "1", "rad/m"), 1e-3)
SIZES |= {"rad": 2e-3, "rad/(N*m)": 2e-4, "m/N": 1e-5, "1/K": 2e-5, "rad/(N*m*m)": 1e-4}
CATALOGUE = {
    "joint-compliance": EFFECTS["joint-compliance"]((1, 2)),
    "backlash": EFFECTS["backlash"]((1, 2)),
    "backlash of some width": EFFECTS["backlash"]((1, 2), width=0.5),
    "backlash by motion": EFFECTS["backlash"]((0, 3), by="motion"),
    "clearance-tilt": EFFECTS["clearance-tilt"]((2, 0)),
    "bearing-compliance": EFFECTS["bearing-compliance"]((1, 3)),
    "extension-compliance": EFFECTS["extension-compliance"]((1, 3), retracted=-2.5),
    "extension-clearance": EFFECTS["extension-clearance"]((3, 0), retracted=-2.5),
    "joint-harmonic": EFFECTS["joint-harmonic"]((0, 2), order=3),
    "encoder-scale": EFFECTS["encoder-scale"]((1, 2)),
    "joint-coupling": EFFECTS["joint-coupling"]((3, 2)),
    "thermal-growth": EFFECTS["thermal-growth"](reference=18.0),
    "base-drift": EFFECTS["base-drift"](reference=5.0),
    "link-flexure": EFFECTS["link-flexure"]((1, 2)),
    "gravity-sag": EFFECTS["gravity-sag"]((1,), terms="2x 3y payload", gravity=(0.6, 0.0, -0.8)),
    "local-joint-error": EFFECTS["local-joint-error"]((1,), knots=KNOTS),
    "local-joint-error periodic": EFFECTS["local-joint-error"]((2,), knots=KNOTS[1:-1], periodic=True),
    "uneven-compliance": EFFECTS["uneven-compliance"]((1,), load=30.0, range=(-1.5, 1.8)),
    "frame-step": EFFECTS["frame-step"](row=4),
    "tool-step": EFFECTS["tool-step"](row=4, turns=True),
    "zero-step": EFFECTS["zero-step"]((1, 2), row=2, time_s=20.0, is_timed=True),
    "warm-up": EFFECTS["warm-up"]((1,), row=6, begin=1.0, pace=3.0),
    "warm-up of the frame": EFFECTS["warm-up"](row=6, begin=1.0, pace=3.0),
}
ARMS = ("aria", "katana", "sliding", "urdf")


@pytest.fixture(scope="module")
def arms(tmp_path_factory) -> dict[str, Robot]:
    """Arms of several conventions with masses, base and tool."""
    folder = tmp_path_factory.mktemp("arms")
    tool = generator.move("z", 0.13) @ generator.turn("x", 0.4) @ generator.move("y", 0.05)
    base, slides = generator.turn("y", 0.2) @ generator.move("x", 0.3), tuple(j == 3 for j in range(6))
    made = {
        "aria": replace(generator.aria(), base=base, tool=tool),
        "katana": generator.katana(),
        "sliding": replace(generator.aria(), convention="dh", slides=slides, tool=tool, limits=None),
    }
    found = {name: checks.robot_of(arm, folder) for name, arm in made.items()}
    found["urdf"] = read_urdf(write_urdf(found["aria"], folder / "aria.urdf"))
    return found


def motion_of(robot: Robot, rows: int = 9) -> Motion:
    rng = np.random.default_rng(0)
    q = rng.uniform(-2.0, 2.0, (rows, robot.dof))
    return Motion(
        q,
        direction=rng.choice([-1.0, 1.0], q.shape),
        time=rng.uniform(0.0, 100.0, rows),
        temperature=rng.uniform(15.0, 35.0, rows),
        payload=rng.uniform(0.0, 2.0, rows),
        wrench=rng.uniform(-5.0, 5.0, (rows, 6)),
    )


def sized(robot: Robot, effect):
    """The effect with coefficients of a usual size."""
    rng = np.random.default_rng(1)
    sizes = [SIZES.get(u, 1e-5) * rng.uniform(0.3, 1.0) for u in effect.units(robot.chain)]
    return replace(effect, coefficients=tuple(sizes))


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("name", CATALOGUE)
def test_zero_coefficients_change_nothing(arms, arm, name):
    robot, effect = arms[arm], CATALOGUE[name]
    motion, deflected = motion_of(robot), robot.with_effects(effect)
    assert not np.any(effect.coefficients)
    law = effect.law(deflected.chain, motion, joint_wrenches(deflected, motion.q))
    assert law.shape == (len(motion), len(effect.elements(deflected.chain)), len(effect.names))
    assert np.isfinite(law).all()
    assert set(deflected.coefficients) == set(deflected.coefficient_units) == set(effect.names)
    np.testing.assert_array_equal(
        forward.tool_poses(deflected, motion), forward.tool_poses(robot, Motion(motion.q))
    )
    np.testing.assert_array_equal(
        forward.link_frames(deflected, motion), forward.link_frames(robot, Motion(motion.q))
    )


@pytest.mark.parametrize("arm", ["aria", "sliding", slow("urdf"), slow("katana")])
@pytest.mark.parametrize("name", CATALOGUE)
def test_the_total_derivative(arms, arm, name):
    """Constants, frames and coefficients, through the fixed point."""
    robot = arms[arm].with_effects(sized(arms[arm], CATALOGUE[name]))
    motion = motion_of(robot)
    frames = tuple(f"{f}.{p}" for f in ("base", "tool") for p in FRAME_PARTS)
    names = (*robot.default_free, *robot.coefficients, *frames)
    known = dict(zip(robot.chain.index, robot.chain.values, strict=True)) | robot.coefficients
    x = np.array([known[n] for n in names])
    poses = lambda x: forward.tool_poses(checks.with_numbers(robot, names, x), motion)  # noqa: E731
    seen, twists = forward.identification_jacobian(robot, motion, names)
    np.testing.assert_allclose(seen, poses(x), atol=1e-13)
    checks.check_jacobian(poses, twists, x, difference=checks.pose_change, tolerance=1e-6)


@pytest.mark.parametrize("arm", ARMS)
def test_the_derivative_of_the_wrenches(arms, arm):
    robot, motion = arms[arm], motion_of(arms[arm])
    columns = np.array([i for i, e in enumerate(robot.chain.elements) if e.matrix is None])
    shift = np.random.default_rng(3).normal(0.0, 0.01, (len(motion), len(robot.chain.elements)))
    loads = {"payload": motion.payload, "wrench": motion.wrench}

    def wrenches(x):
        values = robot.chain.values.copy()
        values[columns] = x
        return joint_wrenches(robot, motion.q, **loads, values=values, shift=shift)

    everything = np.array([(j, i) for j in range(robot.dof) for i in range(6)])
    found = wrench_derivative(robot, Motion(motion.q, **loads), columns, everything, shift=shift)
    found = found.reshape(*motion.q.shape, 6, -1)
    checks.check_jacobian(wrenches, found, robot.chain.values[columns], tolerance=1e-6)


def test_the_fixed_point_is_one(arms):
    robot = arms["aria"]
    robot = robot.with_effects(*(sized(robot, CATALOGUE[n]) for n in ("joint-compliance", "link-flexure")))
    motion = motion_of(robot)
    deflected = deflect(robot, motion)
    given = {"payload": motion.payload, "wrench": motion.wrench, "shift": deflected.shift}
    again = joint_wrenches(robot, motion.q, **given)
    np.testing.assert_allclose(again, deflected.wrenches, atol=1e-9)
    shift = np.zeros_like(deflected.shift)
    for effect in robot.effects:
        law = effect.law(robot.chain, motion, again)
        shift[:, robot.chain.indices(effect.elements(robot.chain))] += law @ effect.coefficients
    np.testing.assert_allclose(shift, deflected.shift, atol=1e-12)


def test_an_arm_too_soft_for_its_load_has_no_deflection():
    """Upright it has one, and half as soft everywhere."""
    robot = load_robot("ur10").with_effects(EFFECTS["joint-compliance"]((1,), (0.02,)))
    upright = [0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0]
    both = Motion(np.array([upright, [0.3, -1.2, 1.0, -0.5, 0.4, 0.2]]))
    assert (
        deflect(robot.with_effects(EFFECTS["joint-compliance"]((1,), (0.01,))), both).outcome
        is Outcome.CONVERGED
    )
    deflected = deflect(robot, both)
    assert deflected.outcome is Outcome.ITERATION_LIMIT
    for found in (deflected.shift, deflected.wrenches):
        assert np.isfinite(found[0]).all()
        assert np.isnan(found[1]).all()
    for predict in (forward.tool_poses, forward.link_frames, forward.identification_jacobian):
        assert np.isfinite(predict(robot, both.q[0])[0]).all()
        with refuses(DataError, row=1):
            predict(robot, both)


def test_a_joint_that_hangs_within_its_play_rests_at_one_of_its_flanks():
    """Straight down, where the moment changes sign: each flank turns the load to the other one."""
    arm, play = load_robot("ur10"), 1e-3

    def motion(angle):
        return Motion(np.array([[0.0, angle, 0.0, 0.0, 0.0, 0.0]]))

    down = brentq(lambda angle: joint_moments(arm, motion(angle)).about[0, 1], 1.4, 1.8)
    loose = arm.with_effects(
        EFFECTS["backlash"]((1,), (play,)), EFFECTS["joint-compliance"]((1, 2), (1e-5, 1e-5))
    )
    deflected = deflect(loose, motion(down))
    assert deflected.outcome is Outcome.CONVERGED
    assert np.abs(deflected.shift).max() == pytest.approx(play, rel=1e-2)


def test_torques_stand_in_for_masses(arms):
    robot = arms["aria"]
    bare = replace(robot, joints=tuple(replace(j, mass=None) for j in robot.joints))
    bare = bare.with_effects(EFFECTS["joint-compliance"]((1,), (1e-3,)))
    q = motion_of(robot).q
    torque = np.random.default_rng(0).normal(0.0, 10.0, q.shape)
    shift = shift_of(bare, Motion(q, torque=torque))
    np.testing.assert_allclose(shift[:, bare.chain.index["joint2.theta"]], -1e-3 * torque[:, 1])
    names = ("joint2.compliance", "joint1.theta")
    motion = Motion(q, torque=torque)
    _, twists = forward.identification_jacobian(bare, motion, names)
    checks.check_jacobian(
        lambda x: forward.tool_poses(checks.with_numbers(bare, names, x), motion),
        twists,
        np.array([1e-3, 0.0]),
        difference=checks.pose_change,
        tolerance=1e-6,
    )
    with refuses(DataError, "torque1", found="joint-compliance"):
        forward.tool_poses(bare, Motion(q))
    across = bare.with_effects(EFFECTS["bearing-compliance"]((1,), (1e-3,)))
    with refuses(DataError, "mass", found="bearing-compliance"):
        forward.tool_poses(across, motion)


@pytest.mark.parametrize(
    "effect",
    [
        EFFECTS["local-joint-error"]((1,), (2e-3, 1e-3, 3e-3), knots=(-1.0, 0.0, 1.0), range=(-0.9, 0.8)),
        EFFECTS["local-joint-error"]((1,), (2e-3, 1e-3, 3e-3), knots=(-0.9, 0.0, 0.8)),
        EFFECTS["joint-harmonic"]((1,), (1e-3, 2e-3, 1e-3, -2e-3), order=(3, 7), range=(-0.9, 0.8)),
    ],
)
def test_a_map_fades_smoothly_beyond_its_range(arms, effect):
    """It refused; or, for a band of harmonics, went on as if it had been learned all round."""
    robot = arms["aria"].with_effects(effect)
    step = 1e-4
    q = np.zeros((int(8.0 / step), 6))
    q[:, 1] = np.arange(-4.0, 4.0 - step / 2, step)
    size = effect.increments(robot.chain, Motion(q))[:, 0]
    slope = np.diff(size) / step
    assert np.abs(slope).max() < 0.05
    assert np.abs(np.diff(slope)).max() < 100.0 * step**2 * 100.0
    inside = (q[:, 1] > -0.9) & (q[:, 1] < 0.8)
    assert np.abs(size[inside]).max() > 1e-3
    assert (size[np.abs(q[:, 1]) > 3.9] == 0.0).all()
    (note,) = robot.extrapolation_warnings(q[[0, 40_000, 49_000]], np.array([7, 8, 9]))
    assert mentions(note, "-51.57° to 45.84°", "2 of 3")
    assert mentions(note, "row 7", "-229.2°")
    assert robot.extrapolation_warnings(q[inside]) == []


@pytest.mark.parametrize(
    ("name", "arguments", "text"),
    [
        ("joint-compliance", {"joints": (6,)}, "joint 7.*1 … 6"),
        ("joint-compliance", {"joints": (1, 1)}, "twice"),
        ("joint-compliance", {"joints": (1,), "coefficients": (1.0, 2.0)}, "2 coefficients but needs 1"),
        ("joint-compliance", {"joints": (1,), "coefficients": (np.nan,)}, "finite"),
        ("joint-compliance", {}, "needs joints"),
        ("joint-harmonic", {"joints": (1,), "order": 0}, "order"),
        ("joint-coupling", {"joints": (1,)}, "two"),
        ("backlash", {"joints": (1,), "by": "magic"}, "moment and motion"),
        ("backlash", {"joints": (1,), "width": -1.0}, "width = -1"),
        ("backlash", {"joints": (1,), "by": "motion", "width": 1.0}, "by = 'motion'"),
        ("thermal-growth", {"joints": (1,)}, "whole arm"),
        ("base-drift", {"joints": (1,)}, "omit joints"),
        ("local-joint-error", {"joints": (1,), "knots": (0.0, 1.0)}, "three"),
        ("local-joint-error", {"joints": (1, 2), "knots": (0.0, 1.0, 2.0)}, "needs one"),
        ("local-joint-error", {"joints": (1,), "knots": (0.0, 1.0, 2.0), "range": (0.0, 3.0)}, "beyond"),
        ("joint-harmonic", {"joints": (1,), "order": (1, 2), "range": (1.0, 1.0)}, "range = "),
        ("joint-harmonic", {"joints": (1, 2), "order": (1, 2), "range": (0.0, 1.0)}, "2 joints"),
        ("local-joint-error", {"joints": (1,), "knots": (0.0, 1.0, 7.0), "periodic": True}, "turn"),
    ],
)
def test_an_arm_refuses_effects_without_sense(arms, name, arguments, text):
    with pytest.raises(RobotError, match=text):
        arms["aria"].with_effects(EFFECTS[name](**arguments))
