"""Robots in millimetres, inches or degrees are refused at the door; sane arms of any size never are."""

import numpy as np
import pytest
from generator import three_parallel
from refusals import refuses

from workbench import Frame, Robot, load_robot, write_toml
from workbench.base.assets import built_in_robots
from workbench.base.errors import DataError, FileError

H = np.pi / 2
UR5 = three_parallel().table[:, :4]
DEGREES = np.degrees(UR5[:, 3])


def scaled(length: float) -> np.ndarray:
    return UR5 * [1, length, length, 1]


@pytest.mark.parametrize(("table", "expected"), [
    (scaled(1000.0), ["in mm", "joint2.a", "-425"]),
    (scaled(100.0), ["in cm", "joint2.a", "-0.425"]),
    (np.column_stack([UR5[:, :3], DEGREES]), ["joint1.alpha", "90", "degrees", "1.5708"]),
    (np.column_stack([[0, -90, 0, 0, 0, 0], UR5[:, 1:]]), ["joint2.theta", "-90", "degrees"]),
])  # fmt: skip
def test_a_table_in_other_units_is_refused_with_joint_unit_and_remedy(table, expected):
    for convention in ("dh", "craig", "hayati"):
        with pytest.raises(FileError) as error:
            Robot.from_dh(table, convention)
        assert all(text in str(error.value) for text in expected)


def test_files_are_checked_by_the_same_rule(tmp_path):
    good = write_toml(Robot.from_dh(UR5), tmp_path / "good.toml").read_text()
    for old, new, expected in (
        ("d = 0.089159", "d = 89159.0", "joint1.d"),
        ("xyz = [\n    0.0,\n    0.0,\n    0.0,\n]", "xyz = [0.0, 0.0, 150.0]", "tool"),
        ("rpy = [\n    0.0,\n    -0.0,\n    0.0,\n]", "rpy = [0.0, 90.0, 0.0]", "degrees"),
    ):
        assert old in good
        path = tmp_path / "bad.toml"
        path.write_text(new.join(good.rsplit(old, 1)))
        with pytest.raises(FileError, match=expected):
            load_robot(path)
    joint = (
        '<joint name="{0}" type="continuous"><parent link="{0}"/><child link="{1}"/>'
        '<axis xyz="0 0 1"/>{2}</joint>'
    )
    links = "".join(f'<link name="{name}"/>' for name in "abc")
    for origin, expected in (('<origin xyz="0 0 900"/>', "in mm"), ('<origin rpy="0 90 0"/>', "degrees")):
        joints = joint.format("a", "b", origin) + joint.format("b", "c", '<origin xyz="0.1 0 0"/>')
        path = tmp_path / "bad.urdf"
        path.write_text(f'<robot name="r">{links}{joints}</robot>')
        with pytest.raises(FileError, match=expected):
            load_robot(path)


def test_travel_in_no_unit_is_named():
    rail = {"type": "prismatic", "theta": 0, "d": 0, "a": 0, "alpha": 0, "limits": [-999999, 999999]}
    with refuses(FileError, "limit", "joint1", "-999999"):
        Robot.from_dh([rail, dict(zip(("theta", "d", "a", "alpha"), UR5[0].tolist(), strict=True))])


def test_sane_arms_are_never_refused():
    for name in built_in_robots():
        assert not any("check that" in note for note in load_robot(name).notes)
    rail = {"type": "prismatic", "theta": 0.0, "d": 0.0, "a": 0.0, "alpha": -H, "limits": [0.0, 12.0]}
    rest = [dict(zip(("theta", "d", "a", "alpha"), row, strict=True)) for row in UR5.tolist()]
    assert Robot.from_dh([rail, *rest]).notes == ()
    assert Robot.from_dh(scaled(0.05)).notes == ()
    for theta in (2 * np.pi, -2 * np.pi, 4 * np.pi, 7.0 * np.pi, np.pi, 6.28, -5.0, 6.0):
        turned = UR5.copy()
        turned[2, 0] = theta
        assert Robot.from_dh(turned).notes == ()
    near = UR5.copy()  # as UR's own calibrations: d of axes that are parallel but for 1e-5 rad
    near[1, 1], near[2, 1], near[1, 3] = 700.0, -700.0, 1e-5
    assert Robot.from_dh(near).notes == ()
    moved = Robot.from_dh(UR5).with_frames(base=Frame(np.array([120.0, 0.0, 0.0])))  # far from the tracker
    assert moved.notes == ()


def test_degrees_for_joints_are_refused_where_the_limits_tell():
    arm = Robot.from_dh(UR5)
    for robot in (arm, load_robot("ur5")):
        with refuses(DataError, "degrees", joint=1, found=90.0):
            robot.predict([0, -90, 90, 0, 90, 0])
        np.testing.assert_allclose(
            robot.predict([0, -H, H + 4 * np.pi, 0, H, 0]), robot.predict([0, -H, H, 0, H, 0]), atol=1e-12
        )


def test_a_xacro_is_never_run(tmp_path):
    path = tmp_path / "arm.urdf.xacro"
    path.write_text("<robot")
    with refuses(FileError, "xacro arm.urdf.xacro > arm.urdf"):
        load_robot(path)
    half = tmp_path / "half.urdf"
    text = '<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:{} name="b"/></robot>'
    for kind, fact in (("macro", "expand it first"), ("property", "has no joints")):
        half.write_text(text.format(kind))
        with refuses(FileError, fact):
            load_robot(half)
