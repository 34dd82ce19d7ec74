"""What the thesis prints of a clearance's direction and radius, and why the model does otherwise."""

import numpy as np
import pytest

from workbench.arm.built_in_arms import load_robot
from workbench.arm.effects import EFFECTS
from workbench.arm.motion import Motion
from workbench.arm.statics.deflection import deflect
from workbench.extras.katana.load_test.joint_tilting_fit import JointTilting, tilting_effects

ANGLE = np.deg2rad(0.024)
"""C of joint 2 in Table 4.3 [rad]."""


def between(a, b):
    """Angle from a to b [deg]."""
    return np.rad2deg(np.arctan2(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], (a * b).sum(-1)))


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
