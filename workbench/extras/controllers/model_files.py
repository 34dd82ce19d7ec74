"""Frames and joints of a URDF or MJCF, as elements whose numbers can be changed.

Sources: the URDF specification of ROS; MuJoCo's XML reference (body, frame, site, joint, default, compiler).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from lxml import etree
from scipy.spatial.transform import Rotation

from workbench.arm.joint import JointKind
from workbench.arm.urdf import KINDS
from workbench.arm.urdf_writer import numbers_text
from workbench.base import se3
from workbench.base.errors import FileError
from workbench.base.toml import MAX_NUMBER
from workbench.base.types import Matrix4, Vector3

FILE = "the file of --into"
Line = tuple[Vector3, Vector3]
"""Point and direction of an axis."""
FIXED: tuple[str, JointKind, Line] = "", JointKind.FIXED, (np.zeros(3), np.array([1.0, 0.0, 0.0]))


@dataclass(frozen=True, eq=False)
class ModelFrame:
    """A link of a URDF; a body, frame or site of an MJCF.

    Args:
        node: The element of its pose.
        parent: The frame that it is given in; None in the root.
        pose: Its pose there with its joint at 0.
        joint: Name of the joint that moves it.
        kind: How; None for what no joint of an arm does.
        line: Axis of the joint, in the frame itself.
    """

    node: Any
    parent: "ModelFrame | None"
    pose: Matrix4
    joint: str
    kind: JointKind | None
    line: Line

    @property
    def upwards(self) -> Iterator["ModelFrame"]:
        """This frame, and those around it."""
        here: ModelFrame | None = self
        while here is not None:
            yield here
            here = here.parent

    @property
    def at_zero(self) -> Matrix4:
        """Its pose in the root."""
        pose = np.eye(4)
        for frame in self.upwards:
            pose = frame.pose @ pose
        return pose

    @property
    def path(self) -> list["ModelFrame"]:
        """Frames with joints, from the root to this one."""
        return [frame for frame in self.upwards if frame.kind is not JointKind.FIXED][::-1]


class ModelFormat(NamedTuple):
    """One kind of file: its name after `--for` and its root's tag, its frames, and how one gets a pose."""

    name: str
    tag: str
    frames_of: Callable[[Any], list[ModelFrame]]
    give: Callable[[Any, Matrix4], None]


def parse(text: str) -> Any:
    """The root element; the parser fetches nothing and expands no entities."""
    try:
        root = etree.fromstring(text.encode(), etree.XMLParser(encoding="utf-8", resolve_entities=False))
    except etree.XMLSyntaxError as error:
        raise FileError(f"is not XML: {error}", path=FILE) from None
    if "\ufffd" in text or root.getroottree().docinfo.doctype:
        raise FileError("is not UTF-8, or has a document type (<!DOCTYPE>): remove it", path=FILE)
    return root


def urdf_frames(root: Any) -> list[ModelFrame]:
    """Links with a joint above them, parents first."""
    joints = {}
    for joint in root.iter("joint"):
        ends = [joint.find(side) for side in ("parent", "child")]
        if None not in ends:  # else it is of a transmission or of ros2_control
            joints[ends[1].get("link")] = ends[0].get("link"), joint
    frames: dict[str, ModelFrame] = {}
    while ready := [link for link, (above, _) in joints.items() if above in frames or above not in joints]:
        for link in ready:
            above, joint = joints.pop(link)
            origin, axis = (joint.find(tag) for tag in ("origin", "axis"))
            xyz, rpy = (numbers(origin, key, "0 0 0") for key in ("xyz", "rpy"))
            kind = KINDS.get(joint.get("type")) if joint.find("mimic") is None else None
            line = np.zeros(3), numbers(axis, "xyz", "1 0 0", is_direction=True)
            pose = se3.pose(se3.rpy_to_matrix(rpy), xyz)
            frames[link] = ModelFrame(joint, frames.get(above), pose, joint.get("name", ""), kind, line)
    if joints:
        raise FileError(f"link '{next(iter(joints))}' hangs on itself", path=FILE)
    return list(frames.values())


def give_urdf(joint: Any, pose: Matrix4) -> None:
    origin = joint.find("origin")
    origin = etree.SubElement(joint, "origin") if origin is None else origin
    origin.set("xyz", numbers_text(pose[:3, 3]))
    origin.set("rpy", numbers_text(se3.matrix_to_rpy(pose[:3, :3])))


def mjcf_frames(root: Any) -> list[ModelFrame]:
    """Bodies, frames and sites, parents first."""
    compiler = {key: value for node in root.iter("compiler") for key, value in node.attrib.items()}
    defaults: dict[str, dict[str, str]] = {}
    for node in root.iterchildren("default"):
        _collect_defaults(node, {}, defaults)
    found: list[ModelFrame] = []

    def walk(node: Any, parent: ModelFrame | None, outer: str) -> None:
        for child in node.iterchildren("body", "frame", "site"):
            inner, moves = child.get("childclass", outer), list(child.iterchildren("joint", "freejoint"))
            joint = _mjcf_joint(moves, inner, defaults) if moves and child.tag == "body" else FIXED
            found.append(ModelFrame(child, parent, _mjcf_pose(child, compiler), *joint))
            walk(child, found[-1], inner)

    for world in root.iterchildren("worldbody"):
        walk(world, None, world.get("childclass", "main"))
    return found


def _collect_defaults(node: Any, outer: dict[str, str], found: dict[str, dict[str, str]]) -> None:
    """Attributes of joints by class, those of the classes around included."""
    own = {**outer, **{k: v for joint in node.iterchildren("joint") for k, v in joint.attrib.items()}}
    found[node.get("class", "main")] = own
    for child in node.iterchildren("default"):
        _collect_defaults(child, own, found)


def _mjcf_joint(nodes: list[Any], around: str, defaults: dict) -> tuple[str, JointKind | None, Line]:
    joint = nodes[0]
    values = {**defaults.get(joint.get("class", around), {}), **joint.attrib}
    kinds = {"hinge": JointKind.REVOLUTE, "slide": JointKind.PRISMATIC}
    kind = kinds.get(values.get("type", "hinge")) if len(nodes) == 1 and joint.tag == "joint" else None
    if numbers(joint, "ref", "0", values=values)[0] != 0.0:
        raise FileError(f"line {joint.sourceline}: the joint has a ref other than 0", path=FILE)
    point = numbers(joint, "pos", "0 0 0", values=values)
    return (
        values.get("name", ""),
        kind,
        (point, numbers(joint, "axis", "0 0 1", values=values, is_direction=True)),
    )


def _mjcf_pose(node: Any, compiler: dict[str, str]) -> Matrix4:
    if odd := {"axisangle", "xyaxes", "zaxis"} & set(node.attrib):
        line, other = node.sourceline, odd.pop()
        raise FileError(f"line {line} has an orientation as {other}; write it as quat or euler", path=FILE)
    pos, degrees = numbers(node, "pos", "0 0 0"), compiler.get("angle", "degree") != "radian"
    if "euler" not in node.attrib:
        return se3.pose(se3.quaternion_to_matrix(numbers(node, "quat", "1 0 0 0", is_direction=True)), pos)
    sequence = compiler.get("eulerseq", "xyz").swapcase()  # MuJoCo's small letters are scipy's capitals
    try:
        turn = Rotation.from_euler(sequence, numbers(node, "euler", "0 0 0"), degrees=degrees).as_matrix()
    except ValueError:
        raise FileError(
            f"has the eulerseq '{sequence.swapcase()[:20]}'; write xyz or alike", path=FILE
        ) from None
    return se3.pose(turn, pos)


def give_mjcf(node: Any, pose: Matrix4) -> None:
    node.attrib.pop("euler", None)
    node.set("pos", numbers_text(pose[:3, 3]))
    node.set("quat", numbers_text(se3.matrix_to_quaternion(pose[:3, :3])))


def numbers(
    node: Any, key: str, default: str, *, values: dict[str, str] | None = None, is_direction: bool = False
) -> np.ndarray:
    """Numbers of an attribute, as many as its default has; not all 0 for a direction."""
    text = default if node is None else (node.attrib if values is None else values).get(key, default)
    try:
        found = np.array([float(v) for v in text.split()])
        is_sound = len(found) == len(default.split()) and bool((np.abs(found) < MAX_NUMBER).all())
        if is_sound and (np.linalg.norm(found) > 0.0 or not is_direction):
            return found
    except ValueError:
        pass
    raise FileError(
        f"line {node.sourceline} has {key}='{text.strip()[:80]}', where {len(default.split())} numbers are "
        "needed; write the nominal numbers there",
        path=FILE,
    )


URDF = ModelFormat("urdf", "robot", urdf_frames, give_urdf)
MJCF = ModelFormat("mjcf", "mujoco", mjcf_frames, give_mjcf)
