"""Joint wrenches by hand, against pinocchio, and as derivatives of the potential energy."""

import numpy as np
import pinocchio as pin
import pytest
from checks import any_joints, joint_wrenches
from rigid_body import rigid_body

from workbench import Frame, Motion, load_robot
from workbench.arm.chain import Axis
from workbench.arm.statics.moments import joint_moments
from workbench.arm.statics.wrenches import load_regressor
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.base.types import frozen

HEAVY = [name for name in built_in_robots() if load_robot(name).has_masses]

MIXED = """
convention = "elementary"
gravity = [1.0, -2.0, -9.0]
joint = [{mass = 2.0, com = [0.1, 0.2, 0.3]}, {mass = 1.0, com = [0.0, 0.1, 0.0]},
         {mass = 3.0, com = [-0.1, 0.0, 0.2]}, {mass = 0.5}]
element = [
    {axis = "tz", value = 0.3}, {axis = "rx", joint = 1, value = 0.2}, {axis = "ry", value = 0.4},
    {axis = "ty", joint = 2, value = 0.1}, {axis = "rz", value = -0.6}, {axis = "ry", joint = 3},
    {axis = "tx", value = 0.5}, {axis = "rz", value = 1.0}, {axis = "tz", joint = 4},
    {axis = "rx", value = 0.3},
]
"""


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    path = tmp_path_factory.mktemp("mixed") / "mixed.toml"
    path.write_text(MIXED)
    robot = load_robot(path)
    base = Frame(frozen(np.array([1.0, 2.0, 3.0])), frozen(se3.rotvec_to_matrix(np.array([0.3, 0.5, -0.7]))))
    tool = Frame(frozen(np.array([0.1, 0.0, 0.3])), frozen(se3.rotvec_to_matrix(np.array([1.3, 0.5, 0.2]))))
    return robot.with_frames(base=base, tool=tool)


def check_against_pinocchio(robot):
    q, speed, change = (any_joints(robot, 10, s) for s in range(3))
    body = rigid_body(robot)
    np.testing.assert_allclose(joint_wrenches(robot, q), body.wrenches(q), atol=1e-10)
    for moving in ({"velocity": speed, "acceleration": change}, {"velocity": speed}):
        whole = body.wrenches(q, **moving)
        np.testing.assert_allclose(joint_wrenches(robot, q, **moving), whole, atol=1e-10)
        if all(robot.chain.elements[k].axis is Axis.RZ for k in robot.chain.driven):
            found = joint_moments(robot.with_effects(), Motion(q, **moving))
            np.testing.assert_allclose(found.about, whole[:, :, 5], atol=1e-10)
            np.testing.assert_allclose(found.across, whole[:, :, 3:5], atol=1e-10)
            np.testing.assert_allclose(found.tipping, np.hypot(*whole[:, :, 3:5].T).T, atol=1e-10)


@pytest.mark.parametrize("name", HEAVY)
def test_built_in_arms_agree_with_pinocchio(name):
    check_against_pinocchio(load_robot(name))


def test_sliding_and_turning_about_every_axis_agree_with_pinocchio(mixed):
    check_against_pinocchio(mixed)


def test_level_arm_by_hand(tmp_path):
    path = tmp_path / "level.toml"
    path.write_text(
        'convention = "hayati"\n'
        "[[joint]]\nalpha = 1.5707963267948966\nmass = 1.0\n"
        "[[joint]]\na = 0.5\nmass = 2.0\ncom = [-0.2, 0.0, 0.0]\n"
    )
    found = joint_wrenches(load_robot(path), np.zeros((1, 2)))[0]
    # joint 2's axes: x out, y up, z to the right: 2 kg held up at 0.3 m take a moment about +z
    np.testing.assert_allclose(found[1], [0, 2 * 9.81, 0, 0, 0, 2 * 9.81 * 0.3], atol=1e-12)
    # joint 1's axes are the base's; z to the right is −y there
    np.testing.assert_allclose(found[0], [0, 0, 3 * 9.81, 0, -2 * 9.81 * 0.3, 0], atol=1e-12)


def test_masses_of_fixed_links_count(tmp_path):
    def arm(tail):
        path = tmp_path / "arm.toml"
        path.write_text(
            'convention = "hayati"\n[[joint]]\nmass = 1.0\ncom = [0.2, 0.0, 0.0]\nalpha = 1.0\n' + tail
        )
        return load_robot(path)

    q = np.array([[0.4]])
    fixed = arm('[[joint]]\ntype = "fixed"\ntheta = 0.3\na = 0.7\nmass = 2.0\ncom = [0.1, 0.0, 0.0]\n')
    bare = arm('[[joint]]\ntype = "fixed"\ntheta = 0.3\na = 0.7\n')
    held = bare.with_frames(tool=Frame(np.array([0.1, 0.0, 0.0])))
    loaded = joint_wrenches(held, q, payload=np.array([2.0]))
    np.testing.assert_allclose(joint_wrenches(fixed, q), loaded, atol=1e-13)
    check_against_pinocchio(fixed)


def test_shift_is_the_same_as_other_constants(mixed):
    q = any_joints(mixed, 10)
    change = np.random.default_rng(3).uniform(-0.1, 0.1, len(mixed.chain.elements))
    change[mixed.chain.axes == 6] = 0.0
    shifted = joint_wrenches(mixed, q, shift=np.tile(change, (len(q), 1)))
    found = joint_wrenches(mixed, q, values=mixed.chain.values + change)
    np.testing.assert_allclose(found, shifted, atol=1e-12)


def test_the_inertia_regressor_is_how_pinocchio_s_wrenches_change(mixed):
    """By every mass and centre, also of rows that move; of each weight alone, as wrenches add up."""
    q, speed, change = (any_joints(mixed, 10, s) for s in range(3))
    motion = Motion(q, velocity=speed, acceleration=change)
    found = load_regressor(mixed, motion, np.arange(len(mixed.inertia)))
    step = 1e-3
    for column, (name, value) in enumerate(mixed.inertia.items()):
        ends = (rigid_body(mixed.with_values({name: value + s})) for s in (step, -step))
        up, down = (body.wrenches(q, velocity=speed, acceleration=change) for body in ends)
        np.testing.assert_allclose(found[..., column], (up - down) / (2.0 * step), atol=1e-8)


def test_a_wrench_at_the_tool_is_held_by_the_transposed_jacobian(katana):
    """pinocchio's Jacobian of the tool, in the measuring frame's axes; the Katana's base is not turned."""
    q, body = any_joints(katana, 12), rigid_body(katana)
    wrench = np.random.default_rng(5).uniform(-20.0, 20.0, (12, 6))
    found = joint_moments(katana, Motion(q, wrench=wrench)).about - joint_moments(katana, Motion(q)).about
    data, axes = body.model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    for row, held, pull in zip(q, found, wrench, strict=True):
        jacobian = pin.computeFrameJacobian(body.model, data, row, body.tool, axes)
        np.testing.assert_allclose(held, -jacobian.T @ pull, atol=1e-10)
