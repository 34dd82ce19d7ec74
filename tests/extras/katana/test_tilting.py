"""What the thesis prints of a clearance's direction and radius, and why the model does otherwise."""

import numpy as np
import pytest
from scipy.optimize import brentq

from workbench.arm.built_in_arms import load_robot
from workbench.arm.effects import EFFECTS
from workbench.arm.motion import Motion
from workbench.arm.statics.deflection import deflect
from workbench.extras.katana.load_test.joint_tilting_fit import JointTilting, tilting_effects

SHAFT = 0.05
"""Length L of a joint's shaft [m]."""
ANGLE = np.deg2rad(0.024)
"""C of joint 2 in Table 4.3 [rad]."""


def by_angle(radius):
    """Eq. (4.11): C from the clearance's radius and the shaft's length [rad]."""
    return np.arcsin(radius / np.hypot(SHAFT / 2, radius))


def printed_radius(angle):
    """Eq. (5.15) as it is printed."""
    return np.sqrt(1.0 / np.sin(angle) ** 2 - 1.0) / (SHAFT / 2)


def test_equation_5_15_is_printed_upside_down():
    """What (4.11) turns into C is (L/2) tan C, 10 µm for joint 2; the print gives its reciprocal, in 1/m."""
    radius = brentq(lambda r: by_angle(r) - ANGLE, 1e-9, 1e-2, xtol=1e-15)
    assert radius == pytest.approx(SHAFT / 2 * np.tan(ANGLE), rel=1e-9)
    assert radius == pytest.approx(10.5e-6, rel=0.01)
    assert printed_radius(ANGLE) == pytest.approx(1.0 / radius, rel=1e-6)


def printed_tilt(moment):
    """Eqs. (5.16)–(5.18) with the radius as it should be: tilts about x and y [rad]."""
    x, y = moment[..., 0], moment[..., 1]
    gamma = np.abs(x) * np.pi / 2 / (np.abs(x) + np.abs(y))
    radius = SHAFT / 2 * np.tan(ANGLE)
    along, up = radius * np.sin(gamma), radius * np.cos(gamma)
    tilts = [part / np.hypot(SHAFT / 2, part) for part in (along, up)]
    return np.stack([np.sign(x) * tilts[0], np.sign(y) * tilts[1]], axis=-1)


def around(degrees):
    """Unit moments across an axis, by their angle from x."""
    return np.stack([np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))], axis=-1)


def between(a, b):
    """Angle from a to b [deg]."""
    return np.rad2deg(np.arctan2(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], (a * b).sum(-1)))


def test_equation_5_16_strays_from_the_moment_by_four_degrees():
    moment = around(np.linspace(0.5, 89.5, 1781))
    strayed = np.abs(between(moment, printed_tilt(moment)))
    assert strayed.max() == pytest.approx(4.07, abs=0.01)
    np.testing.assert_allclose(strayed[[0, 890, 1780]], 0.0, atol=0.3)


def test_equation_5_16_depends_on_how_the_frame_lies():
    """The same moment seen in axes that are turned by 22.5° about the joint's own."""
    moment, turned = around(np.array(22.5)), around(np.array(0.0))
    here, there = between(moment, printed_tilt(moment)), between(turned, printed_tilt(turned))
    assert abs(here) == pytest.approx(3.86, abs=0.01)
    assert there == pytest.approx(0.0, abs=1e-9)


def test_the_model_tips_along_the_moment_whatever_the_frame():
    robot = load_robot("katana450")
    loose = robot.with_effects(*tilting_effects([JointTilting(4, clearance=ANGLE)]))
    q = np.random.default_rng(0).uniform(-1.5, 1.5, (30, 5))
    deflected = deflect(loose, Motion(q))
    tilt = deflected.shift[:, loose.chain.indices(["joint5.tilt_x", "joint5.tilt_y"])]
    np.testing.assert_allclose(between(-deflected.wrenches[:, 4, 3:5], tilt), 0.0, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(tilt, axis=1), ANGLE)


def test_sizes_become_effects_and_stiffness():
    joints = [JointTilting(1, 1e-4, 2e-4, 2e-5, 0.0, 0.0, 1e-6), JointTilting(3, clearance=3e-4)]
    effects = {e.name: e for e in tilting_effects(joints)}
    assert effects["clearance-tilt"] == EFFECTS["clearance-tilt"]((1, 3), (1e-4, 3e-4))
    assert effects["backlash"] == EFFECTS["backlash"]((1,), (2e-4,))
    assert effects["joint-compliance"] == EFFECTS["joint-compliance"]((1,), (2e-5,))
    assert joints[0].stiffness == pytest.approx(5e4)
    assert joints[0].stiffness_std == pytest.approx(2.5e3)
    assert JointTilting(0, 0.0, 0.0, -1e-6).stiffness == np.inf
