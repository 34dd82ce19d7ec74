"""URDF files in and out: every kind of joint, real arms, calibrated copies, round trips with TOML."""

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest
from checks import DESCRIPTIONS, any_joints, check_forward, holding, joint_wrenches, with_numbers
from generator import rotation
from refusals import refuses

from workbench import Dataset, Frame, Motion, load_robot, read_urdf, tool_poses, write_toml, write_urdf
from workbench.arm.effects.axes import own
from workbench.arm.frame import FRAME_PARTS
from workbench.arm.joint import JointKind
from workbench.arm.robot_toml import read_toml
from workbench.arm.statics.wrenches import motion_wrenches
from workbench.arm.urdf import tip_of
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.base.errors import FileError, ShapeError
from workbench.base.types import Freedom, frozen
from workbench.data.plausibility import checked

LIMIT = '<limit lower="-2" upper="2" effort="10" velocity="1"/>'
# end link of the arm proper, and joints on the way
REAL = {
    "ur_description/urdf/ur5_robot.urdf": ("tool0", 6),
    "ur_description/urdf/ur5_gripper.urdf": (None, 6),
    "panda_description/urdf/panda.urdf": ("panda_link8", 7),
    "z1_description/urdf/z1.urdf": (None, 7),
    "kinova_description/robots/kinova.urdf": ("j2s6s200_link_6", 6),
    "so_arm_description/urdf/so101.urdf": (None, 6),
    "tiago_description/robots/tiago_no_hand.urdf": (None, 8),
    "baxter_description/urdf/baxter.urdf": ("left_gripper_base_link", 7),
}


def urdf(*joints, links="abcdefg", name="r"):
    parts = "".join(f'<link name="{x}"/>' for x in links[: len(joints) + 1])
    return f'<robot name="{name}">{parts}{"".join(joints)}</robot>'


def joint(number, kind="revolute", axis="0 0 1", origin="", limit=LIMIT, inside=""):
    a, b = "abcdefg"[number : number + 2]
    return (
        f'<joint name="j{number}" type="{kind}"><parent link="{a}"/><child link="{b}"/>'
        f'<origin {origin}/><axis xyz="{axis}"/>{limit}{inside}</joint>'
    )


def read(folder, text, **options):
    path = folder / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    return read_urdf(path, **options)


def by_pinocchio(path, robot, q):
    """Poses of the file's tool or tip from its measuring frame or root, by pinocchio's own reader."""
    model = pin.buildModelFromUrdf(str(path))
    pairs = ("measuring_frame", robot.ends[0]), ("calibrated_tool", robot.ends[1])
    ends = [added if model.existFrame(added) else own for added, own in pairs]
    data = model.createData()
    moving = [
        n for n, j in zip(robot.urdf.joints, robot.joints, strict=True) if j.kind is not JointKind.FIXED
    ]
    out = []
    for row in q:
        full = pin.neutral(model)
        for name, value in zip(moving, row, strict=True):
            index = model.joints[model.getJointId(name)]
            if index.nq == 2:  # continuous: cosine and sine
                full[index.idx_q : index.idx_q + 2] = np.cos(value), np.sin(value)
            else:
                full[index.idx_q] = value
        pin.framesForwardKinematics(model, data, full)
        root, tip = (data.oMf[model.getFrameId(link, pin.BODY)] for link in ends)
        out.append((root.inverse() * tip).homogeneous)
    return np.array(out)


@pytest.mark.parametrize("file", REAL)
def test_real_arms_are_read_as_pinocchio_reads_them(file):
    tip, dof = REAL[file]
    path = DESCRIPTIONS / file
    robot = load_robot(path, tip=tip)
    assert robot.dof == dof
    q = any_joints(robot, 20)
    np.testing.assert_allclose(tool_poses(robot, Motion(q)), by_pinocchio(path, robot, q), atol=1e-12)
    check_forward(robot, q)
    assert robot.convention == "urdf"
    assert (robot.base.free, robot.tool.free) == (Freedom.AUTO, Freedom.AUTO)
    assert robot.ends[1] in robot.notes[0]


@pytest.mark.parametrize("name", [*REAL, *built_in_robots()])
def test_arms_round_trip_through_toml_and_urdf(name, tmp_path):
    robot = load_robot(DESCRIPTIONS / name, tip=REAL[name][0]) if name in REAL else load_robot(name)
    tool = Frame(frozen(np.array([0.1, 0, 0.2])), frozen(rotation([0.3, 2, 1])))
    robot = robot.with_effects().with_frames(tool=tool)
    q = any_joints(robot, 5)
    table = read_toml(write_toml(robot, tmp_path / "arm.toml"))
    path = write_urdf(table, tmp_path / "arm.urdf")
    np.testing.assert_allclose(
        by_pinocchio(path, read_urdf(path), q), tool_poses(robot, Motion(q)), atol=1e-9
    )
    for again in (table, read_urdf(path)):
        np.testing.assert_allclose(tool_poses(again, Motion(q)), tool_poses(robot, Motion(q)), atol=1e-9)
        np.testing.assert_array_equal(again.limits, robot.limits)
        assert again.joint_names == robot.joint_names
        assert again.ends == robot.ends or robot.ends[1] == robot.joints[-1].link
        assert [j.max_moment for j in again.moving] == [j.max_moment for j in robot.moving]
        if robot.has_masses:
            expected = holding(joint_wrenches(robot, q), robot)
            np.testing.assert_allclose(holding(joint_wrenches(again, q), again), expected, atol=1e-9)


def corrected(robot, seed=0, size=0.02):
    """Random corrections on every joint, and a base and a tool."""
    rng = np.random.default_rng(seed)
    names = [e.name for e in robot.elements if e.name.split(".")[-1] in FRAME_PARTS]
    robot = with_numbers(robot, names, rng.uniform(-size, size, len(names)))
    turns = (frozen(rotation(rng.normal(size=3))) for _ in range(2))
    base, tool = (Frame(frozen(rng.normal(size=3)), turn) for turn in turns)
    return robot.with_frames(base=base, tool=tool)


@pytest.mark.parametrize("file", REAL)
def test_calibrated_copies_are_read_back_exactly(file, tmp_path):
    robot = load_robot(DESCRIPTIONS / file, tip=REAL[file][0])
    actual = corrected(robot)
    q = any_joints(robot, 5)
    assert np.abs(tool_poses(actual, Motion(q)) - tool_poses(robot, Motion(q))).max() > 1e-3
    path = write_urdf(actual, tmp_path / "calibrated.urdf")
    again = load_robot(path)
    np.testing.assert_allclose(tool_poses(again, Motion(q)), tool_poses(actual, Motion(q)), atol=1e-12)
    np.testing.assert_allclose(by_pinocchio(path, again, q), tool_poses(actual, Motion(q)), atol=1e-12)
    # the copy is nominal now: nothing is left to be corrected, and it can be calibrated again
    assert not again.values([e.name for e in again.elements if e.name.split(".")[-1] in FRAME_PARTS]).any()
    for read, written in ((again.base, actual.base), (again.tool, actual.tool)):
        np.testing.assert_allclose(read.pose, written.pose, atol=1e-12)
    twice = corrected(again, seed=1)
    path = write_urdf(twice, tmp_path / "twice.urdf")
    assert tool_poses(load_robot(path), Motion(q)) == pytest.approx(tool_poses(twice, Motion(q)), abs=1e-12)


@pytest.mark.parametrize("file", ["ur_description/urdf/ur5_robot.urdf", "panda_description/urdf/panda.urdf"])
def test_calibrated_copies_keep_everything_else(file, tmp_path):
    path = DESCRIPTIONS / file
    robot = load_robot(path, tip=REAL[file][0])
    actual = corrected(robot).with_frames(base=Frame(), tool=Frame())
    copy = write_urdf(actual, tmp_path / "calibrated.urdf")

    def strip(root):
        """A file's content without the origins of the joints that may change."""
        for node in root.iter():
            node.tail = node.text = None
        for node in root.findall("joint"):
            if node.get("name") in robot.urdf.joints:
                node.remove(node.find("origin"))
        return list(map(ET.tostring, root))

    before, after = (strip(ET.parse(p).getroot()) for p in (path, copy))
    assert before == after[: len(before)]
    assert all(b"calibrated_tool" in added for added in after[len(before) :])
    meshes = [[n.get("filename") for n in ET.parse(p).getroot().iter("mesh")] for p in (path, copy)]
    assert meshes[0] == meshes[1]
    assert meshes[0]


def test_relative_meshes_are_found_from_another_folder(tmp_path):
    home = tmp_path / "home"
    (home / "meshes").mkdir(parents=True)
    (home / "meshes" / "arm.stl").write_bytes(b"solid")
    mesh = '<visual><geometry><mesh filename="{}"/></geometry></visual>'
    text = urdf(joint(0)).replace(
        '<link name="b"/>', f'<link name="b">{mesh.format("meshes/arm.stl")}</link>'
    )
    text = text.replace('<link name="a"/>', f'<link name="a">{mesh.format("package://arm/a.stl")}</link>')
    robot = read(home, text)
    away = write_urdf(robot, tmp_path / "away" / "deep" / "copy.urdf")
    files = [n.get("filename") for n in ET.parse(away).getroot().iter("mesh")]
    assert files[0] == "package://arm/a.stl"
    assert (away.parent / files[1]).resolve() == (home / "meshes" / "arm.stl").resolve()
    near = write_urdf(robot, home / "copy.urdf")
    assert [n.get("filename") for n in ET.parse(near).getroot().iter("mesh")][1] == "meshes/arm.stl"


@pytest.mark.parametrize("kind", ["revolute", "prismatic", "continuous"])
@pytest.mark.parametrize(
    "axis",
    ["1 0 0", "0 1 0", "0 0 1", "-1 0 0", "0 -1 0", "0 0 -1", "1 2 3", "-0.6 0 0.8", "0 0 5", "0 1e-7 -1"],
)
def test_any_axis(kind, axis, tmp_path):
    robot = read(tmp_path, urdf(joint(0, kind, axis, 'xyz="1 2 3" rpy="0.1 0.2 0.3"')))
    direction = np.array([float(v) for v in axis.split()])
    direction /= np.linalg.norm(direction)
    origin = se3.pose(se3.rpy_to_matrix(np.array([0.1, 0.2, 0.3])), np.array([1.0, 2, 3]))
    for value in (-1.3, 0.0, 0.7):
        step = np.eye(4)
        if kind == "prismatic":
            step[:3, 3] = direction * value
        else:
            step[:3, :3] = rotation(direction * value)
        found = tool_poses(robot, Motion(np.array([[value]])))[0]
        np.testing.assert_allclose(found, origin @ step, atol=1e-12)
    assert robot.dof == 1


def test_kinds_limits_and_notes(tmp_path):
    text = urdf(
        joint(0, "fixed", limit=""),
        joint(1, "continuous", limit=""),
        joint(2, "prismatic", limit='<limit lower="0" upper="0.3" effort="5" velocity="1"/>'),
        joint(3, "fixed", origin='xyz="0 0 1"', limit=""),
        joint(4, limit='<limit lower="-1" upper="2" effort="0" velocity="0"/>'),
    )
    robot = read(tmp_path, text)
    assert [j.name for j in robot.joints] == ["fixed1", "joint1", "joint2", "fixed2", "joint3"]
    np.testing.assert_array_equal(robot.limits, [[-np.inf, np.inf], [0, 0.3], [-1, 2]])
    assert [j.max_moment for j in robot.moving] == [None, 5.0, None]
    assert any("j1" in note and "continuous" in note for note in robot.notes)
    assert len(robot.default_free) == 18
    q = any_joints(robot, 5)
    np.testing.assert_allclose(
        tool_poses(robot, Motion(q)), by_pinocchio(tmp_path / "robot.urdf", robot, q), atol=1e-12
    )


@pytest.mark.parametrize("tip", [None, "finger", "lens"])
def test_whatever_tip_is_chosen_all_tools_of_a_flange_weigh(tmp_path, tip):
    """A gripper and a camera hang on one flange: torques at rest are Pinocchio's, which takes every body."""

    def body(name, parent, mass, xyz):
        inertia = 'ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"'
        weighs = f'<inertial><origin xyz="0 0 0.05"/><mass value="{mass}"/><inertia {inertia}/></inertial>'
        return (
            f'<link name="{name}">{weighs if mass else ""}</link><joint name="to_{name}" type="fixed">'
            f'<parent link="{parent}"/><child link="{name}"/><origin xyz="{xyz}"/></joint>'
        )

    tools = body("gripper", "c", 0.8, "0 0 0.1") + body("finger", "gripper", 0.0, "0 0.02 0.1")
    tools += body("camera", "c", 0.3, "0.1 0 0") + body("lens", "camera", 0.0, "0 0 0.05")
    links = urdf(joint(0, origin='xyz="0 0 1"'), joint(1, origin='xyz="0.3 0 0.2" rpy="0.4 1 0"'))
    inertial = body("x", "x", 2.0, "0 0 0").partition("</link>")[0].partition(">")[2]
    for name in "bc":
        links = links.replace(f'<link name="{name}"/>', f'<link name="{name}">{inertial}</link>')
    robot = read(tmp_path, links.replace("</robot>", f"{tools}</robot>"), tip=tip)
    assert robot.has_masses
    model, q = pin.buildModelFromUrdf(str(tmp_path / "robot.urdf")), any_joints(robot, 5)
    found = own(robot.chain, [0, 1], motion_wrenches(robot, Motion(q)))
    data = model.createData()
    expected = [pin.computeGeneralizedGravity(model, data, row).copy() for row in q]
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert np.abs(found[:, 1]).max() > 0.1


def test_a_gripper_beside_the_arm_and_a_mimic_finger(tmp_path):
    ends = '<parent link="c"/><child link="x"/>'
    fork = '<link name="x"/><joint name="k" type="prismatic">' + ends + "{}{}</joint></robot>"
    mimic = '<mimic joint="j1"/>'
    text = urdf(joint(0), joint(1), joint(2)).replace("</robot>", fork.format(LIMIT, mimic))
    assert [read(tmp_path, text.replace(mimic, f'<mimic joint="j{k}"/>')).dof for k in (1, 2)] == [3, 2]
    assert read(tmp_path, text, tip="x").dof == 2
    with refuses(FileError, "c, d, x"):  # the flange before its fingers
        read(tmp_path, text.replace(mimic, ""))


def test_what_stands_before_the_declaration_and_undeclared_prefixes_are_ignored(tmp_path):
    text = '\n<!-- of CAD -->\n<?xml version="1.0"?>\n' + urdf(joint(0), joint(1, axis="0 1 0"))
    robot = read(tmp_path, text.replace("</robot>", "<gazebo><sensor:camera/></gazebo></robot>"))
    path = write_urdf(robot, tmp_path / "copy.urdf")
    assert (robot.dof, read_urdf(path).dof, "<sensor:camera" in path.read_text()) == (2, 2, True)


def test_an_effort_below_nil_is_none_and_the_table_is_read_again(tmp_path):
    robot = read(tmp_path, urdf(joint(0, limit=LIMIT.replace('"10"', '"-1"')), joint(1)))
    assert [j.max_moment for j in robot.moving] == [None, 10.0]
    table = read_toml(write_toml(robot, tmp_path / "r.toml"))
    again = read_urdf(write_urdf(table, tmp_path / "again.urdf"))
    assert (table.dof, [j.max_moment for j in again.moving]) == (2, [None, 10.0])
    assert 'effort="0' not in (tmp_path / "again.urdf").read_text()


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_limits_without_range_are_refused_with_what_to_do(tmp_path, kind):
    with refuses(FileError, "j0", "0.0", "<limit", "'continuous'", "'fixed'"):
        read(tmp_path, urdf(joint(0, kind, limit=LIMIT.replace("-2", "0").replace('"2"', '"0"'))))


def test_links_keep_their_frames_through_a_table(tmp_path):
    """A URDF of a TOML of a URDF has links of the same names: Pinocchio finds them at the same poses."""
    axes = ("0 0 1", "0 -1 0", "0.6 0 0.8", "-1 0 0")
    text = urdf(*(joint(k, axis=axis, origin='xyz="0.1 0.2 0.3"') for k, axis in enumerate(axes)))
    body = '<inertial><origin xyz="0.1 0.02 0.03"/><mass value="2"/></inertial>'
    robot = read(tmp_path, text.replace('<link name="c"/>', f'<link name="c">{body}</link>'))
    table = read_toml(write_toml(robot, tmp_path / "r.toml"))
    again = write_urdf(table, tmp_path / "again.urdf")
    q = any_joints(robot, 3)
    poses = []
    for path in (tmp_path / "robot.urdf", again):
        model = pin.buildModelFromUrdf(str(path))
        data = model.createData()
        poses.append([])
        for row in q:
            pin.framesForwardKinematics(model, data, row)
            poses[-1] += [data.oMf[model.getFrameId(name)].homogeneous.copy() for name in "bcde"]
    np.testing.assert_allclose(poses[1], poses[0], atol=1e-12)
    com = ET.parse(again).find("link[@name='c']/inertial/origin").get("xyz").split()
    np.testing.assert_allclose([float(v) for v in com], [0.1, 0.02, 0.03], atol=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        "",
        '<robot name="r"/>',
        urdf(joint(0, "planar"), joint(1)),
        urdf(joint(0), joint(1, inside='<mimic joint="j0"/>')) + "x",
        urdf(joint(0, limit="")),
        urdf(joint(0, limit='<limit lower="2" upper="1" effort="1" velocity="1"/>')),
        urdf(joint(0, limit='<limit lower="nan" upper="1" effort="1" velocity="1"/>')),
        urdf(joint(0, axis="0 0 0")),
        urdf(joint(0, origin='xyz="nan 0 0"')),
        urdf(joint(0), joint(1)).replace("j1", "j0"),
        urdf(joint(0), joint(1)).replace('<link name="b"/>', ""),
        urdf(joint(0)).replace('<child link="b"/>', ""),
        urdf(joint(0)).replace(
            '<link name="b"/>', '<link name="b"><inertial><mass value="-1"/></inertial></link>'
        ),
    ],
)
def test_each_mistake_is_one_file_error(text, tmp_path):
    with refuses(FileError, path=str(tmp_path / "robot.urdf")):
        read(tmp_path, text)


def with_jaw(tmp_path):
    """Two joints of an arm, a tip, and a jaw that makes another chain longer."""
    joints = [
        f'<joint name="q{k}" type="revolute"><parent link="{a}"/><child link="{b}"/><origin xyz="0.1 0 {z}"/>'
        f'<axis xyz="0 {y} {1 - y}"/>{LIMIT}</joint>'
        for k, (a, b, z, y) in enumerate((("a", "b", 0.3, 0), ("b", "c", 0.2, 1), ("c", "d", 0.1, 0)), 1)
    ]
    tip = '<joint name="tip" type="fixed"><parent link="c"/><child link="e"/><origin xyz="0 0 0.09"/></joint>'
    finger = joints[2].replace('"q3"', '"finger"').replace('"c"', '"e"').replace('"d"', '"f"')
    path = tmp_path / "jaw.urdf"
    path.write_text(urdf(*joints, tip, finger.replace(LIMIT, f'{LIMIT}<mimic joint="q3"/>')))
    return path


def test_a_chosen_tip_holds_in_the_copy(tmp_path):
    arm = read_urdf(with_jaw(tmp_path), tip="e")
    assert tip_of(read_urdf(with_jaw(tmp_path)), 2) == "e"
    assert [tip_of(arm, count) for count in (3, 5)] == ["d", None]
    with refuses(ShapeError, "3 joints, the robot 2", "--tip d"):
        checked(arm, Dataset(q=np.zeros((4, 3)), position=np.zeros((4, 3))))
    copy = read_urdf(write_urdf(arm, tmp_path / "copy.urdf"))
    assert (arm.dof, copy.dof) == (2, 2)
    q = np.array([[0.3, -0.4]])
    assert tool_poses(copy, Motion(q)) == pytest.approx(tool_poses(arm, Motion(q)))
    again = write_urdf(copy, tmp_path / "again.urdf")
    before, after = (path.read_text().count("calibrated_tool") for path in (tmp_path / "copy.urdf", again))
    assert before == after
    assert {node.get("name") for node in ET.parse(again).findall("link")} >= {"d", "e"}
