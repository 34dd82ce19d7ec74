"""The calibrated numbers in a file of the user's own, read by other code; nothing else of it changes."""

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest
import yourdfpy
from lxml import etree
from refusals import refuses
from round_trip import rotated

from tests.exports.readers import origin
from tests.exports.test_exports import EXACT, calibrated, flanges, joints
from workbench.arm.joint_frames import joint_frames
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.base.errors import FileError, OptionError
from workbench.exports import FORMS, Exported, Job, export_robot
from workbench.extras.controllers.into import MARK

MICRON = 1e-6
POSE = ("xyz", "rpy", "pos", "quat", "euler")
STAND = origin(0.3, -0.2, 0.7, 0.0, 0.0, np.pi / 2)
"""Where the files have the arm's base in their root."""
Chain = list[tuple[np.ndarray, np.ndarray, bool]]


def text(numbers) -> str:
    return " ".join(repr(float(v)) for v in np.ravel(numbers))


def rpy(pose: np.ndarray) -> np.ndarray:
    return se3.matrix_to_rpy(pose[:3, :3])


def chain_of(robot: Robot, *, digits: int | None = None) -> tuple[Chain, np.ndarray]:
    """Frames of a file in its root, turned about and moved along their axes as meshes like; and its flange.

    With rounded numbers the arm's base is the root, and frames are the joints' own.
    """
    frames, rng = joint_frames(robot), np.random.default_rng(3)
    stand = STAND if digits is None else np.eye(4)
    found = []
    for pose, joint in zip(frames.at_zero, frames.joints, strict=False):
        turn = se3.rotvec_to_matrix(joint.axis * rng.uniform(-2, 2)) if digits is None else np.eye(3)
        place = stand @ pose @ se3.pose(turn, joint.axis * (0.03 if digits is None else 0.0))
        if digits is not None:
            place[:3, 3] = place[:3, 3].round(digits)
        found.append((place, joint.axis, joint.joint.kind == "revolute"))
    return found, stand @ frames.at_zero[-1]


def steps(chain: Chain, flange: np.ndarray) -> list[np.ndarray]:
    poses = [np.eye(4), *(pose for pose, *_ in chain), flange]
    return [np.linalg.inv(a) @ b for a, b in pairwise(poses)]


def urdf(chain: Chain, flange: np.ndarray) -> str:
    out = "<?xml version='1.0'?>\r\n<robot name='mine'><!-- as bought: é -->\n"
    out += "".join(f"<link name='l{k}'/>\t\n" for k in range(len(chain) + 2)) + "<link name='lamp'/>\n"
    out += "<joint name='of_lamp' type='fixed'><parent link='l0'/><child link='lamp'/>"
    out += "<origin xyz='1 2 3.00'/></joint>"
    for k, step in enumerate(steps(chain, flange)):
        kind, axis = "fixed", np.array([1.0, 0.0, 0.0])
        if k < len(chain):
            kind, axis = "continuous" if chain[k][2] else "prismatic", chain[k][1]
        out += f"""
  <joint type="{kind}"   name="axis{k}">
     <parent link='l{k}'/> <child link='l{k + 1}'/> <limit lower='-9' upper="9" effort='1' velocity='1'/>
     <origin rpy = '{text(rpy(step))}'
             xyz="{text(step[:3, 3])}" /> <!-- <origin xyz="7 7 7"/> -->
     <axis xyz='{text(axis)}'/>
  </joint>"""
    return out + "\n</robot>\n"


def mjcf(chain: Chain, flange: np.ndarray) -> str:
    """Every other body by Euler angles in degrees; axes beside the body's frame, of a class."""
    out = '<mujoco model="mine"><default><joint axis="1 0 0"/>'
    out += '<default class="z"><joint axis="0 0 1"/></default></default>\n'
    out += "<worldbody>\n"
    before = np.eye(4)
    for k, (pose, axis, turns) in enumerate(chain):
        aside = se3.pose(np.eye(3), np.array([0.02, -0.01, 0.03]))
        body = pose @ aside
        step = np.linalg.inv(before) @ body
        quat = se3.matrix_to_quaternion(step[:3, :3])
        turn = f"quat='{text(2.0 * quat)}'" if k % 2 else f'euler="{text(np.rad2deg(euler(step)))}"'
        shown = "class='z'" if np.array_equal(axis, [0, 0, 1]) else f"axis='{text(axis)}'"
        kind = "hinge" if turns else "slide"
        out += f"""<body name='b{k}' {turn} pos="{text(step[:3, 3])}" >
        <geom mesh='m{k}' pos="0 0 .1"/>
        <joint name="axis{k}" {shown} type='{kind}' pos='{text(-aside[:3, 3])}'/>\n"""
        before = body
    end = np.linalg.inv(before) @ flange
    quat = text(se3.matrix_to_quaternion(end[:3, :3]))
    out += f'<site name="flange" pos="{text(end[:3, 3])}" quat="{quat}"/>' + "</body>" * len(chain)
    return out + "</worldbody><!-- end --></mujoco>"


def euler(pose: np.ndarray) -> np.ndarray:
    """MuJoCo's xyz: Rx Ry Rz, about axes that turn with the body."""
    r = pose[:3, :3]
    if abs(r[0, 2]) > 1.0 - 1e-12:
        return np.array([np.arctan2(r[2, 1], r[1, 1]), np.arcsin(np.clip(r[0, 2], -1, 1)), 0.0])
    return np.array([np.arctan2(-r[1, 2], r[2, 2]), np.arcsin(r[0, 2]), np.arctan2(-r[0, 1], r[0, 0])])


def moved(axis: np.ndarray, turns: bool, q: float) -> np.ndarray:
    axis = axis / np.linalg.norm(axis)
    return se3.pose(se3.rotvec_to_matrix(axis * q), 0 * axis) if turns else se3.pose(np.eye(3), axis * q)


def urdf_flanges(path: Path, q: np.ndarray) -> np.ndarray:
    model = yourdfpy.URDF.load(path, load_meshes=False, build_scene_graph=True)
    out = []
    for row in q:
        model.update_cfg(row)
        out.append(model.get_transform(f"l{q.shape[1] + 1}", "l0"))
    return np.array(out)


def mjcf_flanges(path: Path, q: np.ndarray) -> np.ndarray:
    def pose(node):
        out, at = np.eye(4), node.get("pos").split()
        if node.get("quat"):
            quat = np.array(node.get("quat").split(), float)
            out[:3, :3] = rotated(*(quat / np.linalg.norm(quat)))
        else:
            x, y, z = np.deg2rad(np.array(node.get("euler").split(), float))
            out = origin(0, 0, 0, x, 0, 0) @ origin(0, 0, 0, 0, y, 0) @ origin(0, 0, 0, 0, 0, z)
        out[:3, 3] = np.array(at, float)
        return out

    out = []
    for row in q:
        node, here = ET.parse(path).find("worldbody"), np.eye(4)
        for value in row:
            node = node.find("body")
            joint = node.find("joint")
            at = se3.pose(np.eye(3), np.array(joint.get("pos").split(), float))
            axis = np.array((joint.get("axis") or "0 0 1").split(), float)
            here = (
                here @ pose(node) @ at @ moved(axis, joint.get("type") == "hinge", value) @ np.linalg.inv(at)
            )
        out.append(here @ pose(node.find("site")))
    return np.array(out)


FILES: dict[str, tuple[Callable, Callable]] = {
    "urdf": (urdf, urdf_flanges), "mjcf": (mjcf, mjcf_flanges),
}  # fmt: skip


def written(form: str, source: str, arm: Robot, nominal: Robot, folder: Path) -> Exported:
    path = folder / f"out{FORMS[form].ending}"
    return export_robot(FORMS[form], path, Job(robot=arm, nominal=nominal, source=source), rows=20)


def content(text: str) -> list:
    """All of a file but the numbers of poses: elements, comments, other attributes, in order."""
    nodes = etree.fromstring(text.encode()).iter()
    return [
        (n.text, n.tail) if n.tag is etree.Comment else (n.tag, {k: v for k, v in n.items() if k not in POSE})
        for n in nodes
    ]


@pytest.mark.parametrize(("name", "form"), list(product(built_in_robots(), FILES)))
def test_a_file_of_ones_own_becomes_the_calibrated_arm_and_nothing_else_of_it_changes(name, form, tmp_path):
    nominal, arm = calibrated(name)
    write, read = FILES[form]
    source = write(*chain_of(nominal))
    done = written(form, source, arm, nominal, tmp_path)
    found, q = done.path.read_bytes().decode(), joints(arm)
    assert [c for c in content(found) if c[0] != MARK] == content(source)
    wanted = STAND @ flanges(arm, q)
    (tmp_path / "nominal").write_text(source)
    assert np.abs(read(tmp_path / "nominal", q) - wanted).max() > 1e-4
    np.testing.assert_allclose(read(done.path, q), wanted, rtol=0.0, atol=MICRON)
    assert max(done.position, done.rotation) < MICRON
    assert any("order" in note and "a" in note for note in done.notes)


@pytest.mark.parametrize("form", FILES)
def test_a_file_with_rounded_numbers_gets_the_calibrated_axes_exactly(form, tmp_path):
    """What is left is a constant at the flange: rounding there can't be told from another flange."""
    nominal, arm = calibrated("ur5e")
    write, read = FILES[form]
    done = written(form, write(*chain_of(nominal, digits=3)), arm, nominal, tmp_path)
    q = joints(arm)
    left = np.linalg.inv(flanges(arm, q)) @ read(done.path, q)
    np.testing.assert_allclose(left, np.broadcast_to(left[0], left.shape), rtol=0.0, atol=EXACT)
    assert np.abs(left[0] - np.eye(4)).max() < 2e-3


def test_joints_are_matched_by_name_where_the_calibration_has_names(tmp_path):
    """A rail before the arm stays what it is."""
    nominal, arm = calibrated("ur5")
    chain, flange = chain_of(nominal)
    rail = (np.eye(4), np.array([0.0, 1.0, 0.0]), False)
    names = iter(["rail", *(f"joint{k}" for k in range(1, 7)), "end"])
    source = re.sub(r'"axis\d"', lambda _: f'"{next(names)}"', urdf([rail, *chain], flange))
    done = written("urdf", source, arm, nominal, tmp_path)
    q = joints(arm)
    found = urdf_flanges(done.path, np.column_stack([np.full(len(q), 0.4), q]))
    wanted = se3.pose(np.eye(3), np.array([0.0, 0.4, 0.0])) @ STAND @ flanges(arm, q)
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=MICRON)
    assert not any("order" in note for note in done.notes)


def test_a_file_that_ends_at_the_last_joint_says_where_the_flange_is(tmp_path):
    nominal, arm = calibrated("ur5e")
    source = mjcf(*chain_of(nominal))
    source = re.sub("<site[^>]*>", "", source)
    done = written("mjcf", source, arm, nominal, tmp_path)
    assert max(done.position, done.rotation) < EXACT
    note = next(n for n in done.notes if "'axis5'" in n and "tool" in n)
    xyz, turn = (
        np.array(part.split(", "), float) for part in re.findall(r"(-?[\d.]+, -?[\d.]+, -?[\d.]+)", note)
    )
    tool = se3.pose(se3.rotvec_to_matrix(turn), xyz / 1e3)
    q = joints(arm)
    shown = done.path.read_text().replace("</body>", '<site pos="0 0 0" quat="1 0 0 0"/></body>', 1)
    done.path.write_text(shown)
    wanted = STAND @ flanges(arm, q) @ arm.tool.pose
    np.testing.assert_allclose(mjcf_flanges(done.path, q) @ tool, wanted, rtol=0.0, atol=1e-6)


def swapped(old: str, new: str, form: str) -> str:
    source = FILES[form][0](*chain_of(calibrated("ur5")[0]))
    assert old in source
    return source.replace(old, new, 1)


@pytest.mark.parametrize(("form", "old", "new", "message"), [
    ("urdf", 'xyz="', 'xyz="${d1} ', r"line 16 .*\$\{d1\}"),
    ("urdf", 'xyz="', 'xyz="1e999 ', "line 16 "),
    ("urdf", "<axis xyz='", "<axis xyz='0 0 0' was='", "line 17 "),
    ("urdf", "<robot", "<arm", "XML"),
    ("urdf", "<robot", "<robot><!-- calibrated by workbench --></robot><robot", "XML"),
    ("urdf", "<link", "<!-- calibrated by workbench --><link", "calibration already"),
    ("urdf", "<link", "<!-- \ufffd --><link", "UTF-8"),
    ("urdf", "<?xml version='1.0'?>", "<!DOCTYPE robot [<!ENTITY a 'b'>]>", "DOCTYPE"),
    ("urdf", "<child link='l1'", "<child link='l6'", "l"),
    ("urdf", "<parent link='l0'/><child link='lamp'", "<parent link='lamp'/><child link='lamp'", "lamp"),
    ("urdf", "continuous", "planar", "axis0"),
    ("urdf", "continuous", "fixed", "6 joints"),
    ("urdf", "axis2", "joint2", "joint1"),
    ("mjcf", "pos='", "ref='5' pos='", "ref"),
    ("mjcf", "quat='", "quat='0 0 0 0' was='", "quat"),
    ("mjcf", "euler=", "xyaxes='1 0 0 0 1 0' was=", "xyaxes"),
    ("mjcf", "<worldbody>", "<compiler eulerseq='abc'/><worldbody>", "eulerseq"),
])  # fmt: skip
def test_what_can_not_be_written_is_refused_and_said(form, old, new, message, tmp_path):
    nominal, arm = calibrated("ur5")
    with pytest.raises(FileError, match=message):
        written(form, swapped(old, new, form), arm, nominal, tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("form", FILES)
@pytest.mark.parametrize(("name", "other"), [("ur5e", "ur5"), ("ur10e", "ur10"), ("iiwa14", "iiwa7")])
def test_a_file_of_another_arm_is_refused_with_how_far_it_is(form, name, other, tmp_path):
    nominal, arm = calibrated(name)
    source = FILES[form][0](*chain_of(calibrated(other)[0]))
    with pytest.raises(FileError, match=r"nominal arm.* \d+\.?\d* mm and .* off"):
        written(form, source, arm, nominal, tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_file_and_the_arm_before_its_calibration_are_needed(tmp_path):
    nominal, arm = calibrated("ur5")
    with refuses(OptionError, option="--into"):
        export_robot(FORMS["urdf"], tmp_path / "o", Job(robot=arm, nominal=nominal))
    with refuses(OptionError, option="--nominal"):
        export_robot(FORMS["urdf"], tmp_path / "o", Job(robot=arm, source=urdf(*chain_of(nominal))))


def test_the_command_leaves_the_file_as_it_is_and_lists_forms_without_an_arm(run, refused, tmp_path):
    rows, toml, mine, out = (tmp_path / n for n in ("rows.csv", "c.toml", "mine.urdf", "out.urdf"))
    assert run("simulate", "--robot", "ur5", "--poses", 40, "--seed", 1, "--out", rows)[0] == 0
    run("identify", rows, "--robot", "ur5", "--save", toml)
    source = urdf(*chain_of(calibrated("ur5")[0]))
    mine.write_bytes(source.encode())
    code, message, _ = run("export", toml, "--for", "urdf", "--into", mine, "--out", out)
    assert code == 0
    assert str(out) in message
    assert mine.read_bytes() == source.encode() != out.read_bytes()
    mine.write_bytes(b"<robot name='\xe9'/>")
    out.unlink()
    refused([], "export", toml, "--for", "urdf", "--into", mine, "--out", out)
    code, message, _ = run("export", "--for", "list")
    assert code == 0
    assert all(name in message for name in FORMS)
    refused(["robot"], "export", "--for", "urdf", "--out", out, status=64)
