"""Robots written as URDF files, with what was identified multiplied into the origins of the joints.

Everything else in the file that a robot was read from (meshes, inertias, other branches) is unchanged. Arms
from tables become URDFs of plain frames.
"""

import os
import xml.etree.ElementTree as ET
from itertools import pairwise
from pathlib import Path

import numpy as np

from workbench.arm.joint import Joint
from workbench.arm.joint_frames import still
from workbench.arm.masses import carried, moved, sphere_inertia
from workbench.arm.robot import Robot
from workbench.arm.urdf import ANY_EFFORT, BASE_LINK, TOOL_LINK, read_urdf, xml_root
from workbench.arm.usable_arm import usable_arm
from workbench.base import se3
from workbench.base.errors import FileError, RobotError
from workbench.base.files import check_ending, write_bytes
from workbench.base.types import Matrix4, Vector3


def write_urdf(robot: Robot, path: Path | str) -> Path:
    """Write a robot as URDF: a calibrated copy of the file it came from, or frames alone.

    The base frame becomes a fixed joint from the link `measuring_frame`, the tool one to `calibrated_tool`,
    unless they are identities; of several sessions' it has the first. A chain that ends at a chosen tip has
    that tool all the same, so that whoever reads the copy finds the chain; other branches stay. A URDF can't
    represent effects: it gets the best geometry without them (`usable_arm`, which also reports the remaining
    error).

    Raises:
        FileError: the file that the robot came from is gone.
        RobotError: the robot has something that a URDF can't represent.
    """
    path = check_ending(path, "a URDF is", ".urdf", ".xml")
    robot = usable_arm(robot, effects=False).robot.in_first_session
    if robot.urdf is not None:
        root = xml_root(robot.urdf.path, wanted="the URDF that the robot was read from")
        _correct_origins(root, robot, robot.urdf.joints)
        _keep_references(root, robot.urdf.path, path)
    else:
        root = _skeleton(robot)
    _add_frames(root, robot)
    ET.indent(root)
    return write_bytes(path, ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")


def _keep_references(root: ET.Element, source: Path, copy: Path) -> None:
    """Make relative mesh and texture paths valid from the folder of the copy."""
    for node in root.iter():
        file = node.get("filename") if node.tag in ("mesh", "texture") else None
        if file is None or "://" in file or Path(file).is_absolute():
            continue
        if (source.parent / file).is_file() and copy.parent.resolve() != source.parent.resolve():
            node.set("filename", os.path.relpath((source.parent / file).resolve(), copy.parent.resolve()))


def _skeleton(robot: Robot) -> ET.Element:
    """A URDF of frames for an arm from a table; links have the frames that they had in a URDF before."""
    root, (parent, tip) = ET.Element("robot", name=robot.name), robot.ends
    places, bodies = moved(robot), carried(robot)
    driven, behind = [robot.elements[i] for i in places], [_link_end(robot, i) for i in places]
    turns = [still(*robot.elements[i + 1 : end]) for i, end in zip(places, behind, strict=True)]
    bounds = pairwise([0, *behind, len(robot.elements)])
    segments = [still(*robot.elements[a:b]) for a, b in bounds]
    names = _names([robot.joints[e.link] for e in driven], parent)
    if tip in (parent, *(link for _, link in names)):  # a moving link, which was the last
        tip = "flange"
    ET.SubElement(root, "link", name=parent)
    leaders = {e.joint: name for e, (name, _) in zip(driven, names, strict=True) if e.joint is not None}
    every = zip(driven, segments[:-1], turns, bodies, names, strict=True)
    for element, segment, turn, (mass, com), (name, child) in every:
        joint = robot.joints[element.link]
        limits = np.array(joint.limits)
        if element.follows is not None:
            limits = np.sort(element.value + element.ratio * robot.limits[element.follows])
        link = ET.SubElement(root, "link", name=child)
        is_limited = bool(np.isfinite(limits).all())
        kind = "prismatic" if not element.axis.turns else "revolute" if is_limited else "continuous"
        if kind == "prismatic" and not is_limited:
            lacks = "is prismatic without limits, which a URDF can't express; give limits"
            raise RobotError(f"{joint.name} {lacks}")
        node = _joint_node(root, name, kind, parent, child, segment)
        ET.SubElement(node, "axis", xyz=numbers_text(turn[element.axis % 3, :3]))
        ends = zip(("lower", "upper"), limits.tolist(), strict=True)
        limit = {end: repr(value) for end, value in ends if kind != "continuous"}
        if limit or joint.max_moment:
            limit |= {"effort": repr(float(joint.max_moment or ANY_EFFORT)), "velocity": "1"}
            ET.SubElement(node, "limit", limit)
        if element.follows is not None:
            factor, offset = repr(float(element.ratio)), repr(float(element.value))
            ET.SubElement(node, "mimic", joint=leaders[element.follows], multiplier=factor, offset=offset)
        _inertial(link, mass, se3.apply(se3.inverse(turn), com))
        parent = child
    ET.SubElement(root, "link", name=tip)
    _joint_node(root, f"{tip}_joint", "fixed", parent, tip, segments[-1])
    return root


def _link_end(robot: Robot, index: int) -> int:
    """Index behind a driven element, and behind what turns its axis back from z as in the URDF it is of."""
    name = robot.elements[index].name.removesuffix(".q") + ".unalign"
    return index + 1 + sum(e.name.startswith(name) for e in robot.elements)


def _names(joints: list[Joint], base: str) -> list[tuple[str, str]]:
    """Names of joints and of the links after them: their own ones, unless some are alike."""
    plain = [(f"joint{k}", f"link{k}") for k in range(1, len(joints) + 1)]
    own = [(j.label or p[0], j.link or p[1]) for j, p in zip(joints, plain, strict=True)]
    taken = {"flange_joint", *(name for name, _ in own)}, {base, "flange", *(link for _, link in own)}
    return own if (len(taken[0]), len(taken[1])) == (len(own) + 1, len(own) + 2) else plain


def _inertial(link: ET.Element, mass: float | None, com: Vector3) -> None:
    """Mass and centre of a body in the frame right after its joint; nothing if it is unknown or none."""
    if not mass:
        return
    node = ET.SubElement(link, "inertial")
    ET.SubElement(node, "origin", xyz=numbers_text(com), rpy="0 0 0")
    ET.SubElement(node, "mass", value=repr(float(mass)))
    own = dict.fromkeys(("ixx", "iyy", "izz"), repr(sphere_inertia(mass)))
    ET.SubElement(node, "inertia", own | dict.fromkeys(("ixy", "ixz", "iyz"), "0"))


def _correct_origins(root: ET.Element, robot: Robot, names: tuple[str, ...]) -> None:
    """Multiply the identified corrections into the origins of the joints of the chain."""
    by_name = {node.get("name"): node for node in root.findall("joint")}
    for link, original in enumerate(names):
        own = (e for e in robot.elements if e.link == link and e.joint is e.follows is None)
        mine = [e for e in own if not e.name.endswith("align")]
        if any(e.value for e in mine):
            _place(by_name[original], still(*mine))


def _add_frames(root: ET.Element, robot: Robot) -> None:
    links = {node.get("name") for node in root.findall("link")}
    first, last = robot.ends[0], robot.ends[1] if robot.urdf else str(root.findall("link")[-1].get("name"))
    for is_base, frame, name in ((True, robot.base, BASE_LINK), (False, robot.tool, TOOL_LINK)):
        if (there := _own_joint(root, is_base, first, last)) is not None:
            _place(there, frame.pose)
            continue
        if np.array_equal(frame.pose, np.eye(4)) and (is_base or _is_usual(robot)):
            continue
        while name in links:
            name += "_"
        ET.SubElement(root, "link", name=name)
        ends = (name, first) if is_base else (last, name)
        _joint_node(root, f"{name}_joint", "fixed", *ends, frame.pose)


def _own_joint(root: ET.Element, is_base: bool, first: str, last: str) -> ET.Element | None:
    """The joint of a base or tool that was added to the file before."""
    for node in root.findall("joint"):
        parent, child = (str(part.get("link")) for end in ("parent", "child") for part in node.findall(end))
        ours = (child, parent.startswith(BASE_LINK)) if is_base else (parent, child.startswith(TOOL_LINK))
        if ours == (first if is_base else last, True):
            return node
    return None


def _is_usual(robot: Robot) -> bool:
    """Whether the chain is the one that is read where no tip is chosen."""
    if robot.urdf is None:
        return True
    try:
        return read_urdf(robot.urdf.path).urdf == robot.urdf
    except FileError:  # several chains
        return False


def _joint_node(root: ET.Element, name: str, kind: str, parent: str, child: str, pose: Matrix4) -> ET.Element:
    node = ET.SubElement(root, "joint", name=name, type=kind)
    ET.SubElement(node, "parent", link=parent)
    ET.SubElement(node, "child", link=child)
    _place(node, pose)
    return node


def _place(joint: ET.Element, pose: Matrix4) -> None:
    if (origin := joint.find("origin")) is None:
        origin = ET.SubElement(joint, "origin")
    origin.attrib.update(xyz=numbers_text(pose[:3, 3]), rpy=numbers_text(se3.matrix_to_rpy(pose[:3, :3])))


def numbers_text(numbers: np.ndarray) -> str:
    """Numbers with all digits, separated by spaces, for XML attributes."""
    return " ".join(repr(float(v)) for v in numbers)
