"""Poses against pinocchio, and every column of every identification Jacobian against central differences."""

import numpy as np
import pytest
from checks import check_forward, check_jacobian, pose_change

from workbench import Frame, Motion, identification_jacobian, load_robot, tool_poses
from workbench.arm.chain import Axis
from workbench.arm.kinematics.forward import geometric_jacobian
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.base.types import frozen

CONVENTIONS = ["hayati", "dh", "craig", "craig-hayati", "three-rotation xyz", "three-rotation zyx"]

URDF_JOINT = """<joint name="j{i}" type="{kind}"><parent link="l{i}"/><child link="l{j}"/>
<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>"""


def text(numbers):
    return " ".join(repr(float(v)) for v in numbers)


def framed(robot, rng):
    """The robot on a base and with a tool in general position, also turned a little further."""

    def frame():
        return Frame(frozen(rng.normal(size=3)), frozen(se3.rotvec_to_matrix(rng.normal(size=3))))

    return robot.with_frames(base=frame(), tool=frame())


def table_arm(convention, folder, seed, number=5):
    rng = np.random.default_rng(seed)
    name, _, order = convention.partition(" ")
    lines = [f'convention = "{name}"']
    for i in range(number):
        kind = rng.choice(["revolute", "revolute", "prismatic"]) if i else ["revolute", "prismatic"][seed % 2]
        lines += ["[[joint]]", f'type = "{kind}"', f'order = "{order}"' if order else ""]
        lines += [f"{c} = {float(rng.uniform(-1, 1))!r}" for c in ("theta", "d", "a", "alpha", "beta")]
    path = folder / "arm.toml"
    path.write_text("\n".join(lines))
    return framed(load_robot(path), rng)


def elementary_arm(folder, seed, number=14):
    rng = np.random.default_rng(seed)
    lines, joint = ['convention = "elementary"'], 0
    for i in range(number):
        axis = rng.choice(["rx", "ry", "rz", "tx", "ty", "tz"])
        lines += ["[[element]]", f'axis = "{axis}"', f"value = {float(rng.uniform(-1, 1))!r}"]
        if i % 3 == 1:
            joint += 1
            lines.append(f"joint = {joint}")
    path = folder / "arm.toml"
    path.write_text("\n".join(lines))
    return framed(load_robot(path), rng)


def urdf_arm(folder, seed, number=5):
    rng = np.random.default_rng(seed)
    parts = ["<robot name='r'>", *(f"<link name='l{i}'/>" for i in range(number + 1))]
    axes = [*np.eye(3), *-np.eye(3), *rng.normal(size=(3, 3))]
    for i in range(number):
        parts.append(
            URDF_JOINT.format(
                i=i,
                j=i + 1,
                kind=rng.choice(["revolute", "revolute", "prismatic"]),
                xyz=text(rng.uniform(-1, 1, 3)),
                rpy=text(rng.uniform(-3, 3, 3)),
                axis=text(axes[rng.integers(len(axes))]),
            )
        )
    path = folder / "arm.urdf"
    path.write_text("\n".join([*parts, "</robot>"]))
    return framed(load_robot(path), rng)


def arms(folder, seeds=range(4)):
    for seed in seeds:
        for convention in CONVENTIONS:
            yield table_arm(convention, folder, seed)
        yield elementary_arm(folder, seed)
        yield urdf_arm(folder, seed)


def rows(robot, number=3, seed=0):
    low, high = robot.search_limits.T
    return np.random.default_rng(seed).uniform(np.maximum(low, -3), np.minimum(high, 3), (number, robot.dof))


def check_columns(robot, q):
    """Every constant of the full chain, base and tool included, by differences of the whole robot."""
    names = tuple(e.name for e in robot.chain.elements if e.axis is not Axis.CONSTANT)
    poses, twists = identification_jacobian(robot, Motion(q), names)
    np.testing.assert_allclose(poses, tool_poses(robot, Motion(q)), atol=1e-13)

    def moved(values):
        return tool_poses(robot.with_values(dict(zip(names, values, strict=True))), Motion(q))

    return check_jacobian(moved, twists, robot.values(names), difference=pose_change)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("convention", CONVENTIONS)
def test_every_column_of_every_table_convention(convention, seed, tmp_path):
    robot = table_arm(convention, tmp_path, seed)
    assert check_columns(robot, rows(robot)) < 1e-7


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("make", [elementary_arm, urdf_arm])
def test_every_column_of_elementary_and_urdf_arms(make, seed, tmp_path):
    robot = make(tmp_path, seed)
    assert check_columns(robot, rows(robot)) < 1e-7


@pytest.mark.parametrize("name", built_in_robots())
def test_every_column_of_the_built_in_arms(name):
    robot = framed(load_robot(name).with_effects(), np.random.default_rng(1))
    assert check_columns(robot, rows(robot)) < 1e-7


@pytest.mark.parametrize("name", built_in_robots())
def test_built_in_arms_agree_with_pinocchio(name):
    robot = load_robot(name).with_effects()
    assert check_forward(robot, rows(robot, 50)) < 1e-12
    assert check_forward(framed(robot, np.random.default_rng(2)), rows(robot, 50)) < 1e-12


def test_random_arms_agree_with_pinocchio(tmp_path):
    for robot in arms(tmp_path):
        check_forward(robot, rows(robot, 20))


def test_joint_columns_are_the_derivative_by_the_joints(tmp_path):
    for robot in arms(tmp_path, seeds=[5]):
        q = rows(robot)
        jacobian = geometric_jacobian(robot, q)
        for row in range(len(q)):
            check_jacobian(
                lambda x: tool_poses(robot, Motion(x[None])),  # noqa: B023
                jacobian[row][None],
                q[row].copy(),
                difference=pose_change,
            )
        assert [robot.chain.elements[k].joint for k in robot.chain.driven] == list(range(robot.dof))
