"""URDF (and xacro), MJCF and SDF as frames and joints.

Sources: the URDF specification of ROS; MuJoCo's XML reference (body, frame orientations, default, compiler);
SDFormat's specification of pose frame semantics.
"""

import warnings
from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from workbench.arm.joint import JointKind
from workbench.arm.urdf import KINDS
from workbench.arm.urdf_writer import numbers_text
from workbench.base import se3
from workbench.base.errors import FileError
from workbench.base.types import Matrix4
from workbench.extras.controllers.into.model import ROOT, Edge, GivenFrame, Model
from workbench.extras.controllers.into.xml_bytes import FILE, Edit, XmlElement, parse

ORIENTATIONS = ("quat", "euler", "axisangle", "xyaxes", "zaxis")


def _require(root: XmlElement, tag: str) -> None:
    if root.tag != tag:
        raise FileError(
            f"its root is <{root.tag}>, not <{tag}>; give a file of the format named by --for", path=FILE
        )


def _rpy_values(pose: Matrix4) -> tuple[np.ndarray, np.ndarray]:
    return pose[:3, 3], se3.matrix_to_rpy(pose[:3, :3])


def urdf_model(text: str) -> Model:
    """A URDF or xacro; names may hold expressions, numbers that are needed may not."""
    root = parse(text)
    _require(root, "robot")
    frames, edges = {}, []
    for joint in root.iter("joint"):
        ends = [joint.find(side) for side in ("parent", "child")]
        if None in ends:
            continue  # of a transmission or of ros2_control
        parent, child = (str(e.attrib.get("link")) for e in ends if e is not None)
        if child in frames:
            raise FileError(f"line {joint.line} has a second joint to link '{child}'", path=FILE)
        kind = None if joint.find("mimic") else KINDS.get(joint.attrib.get("type", ""))
        frames[child] = GivenFrame(parent, child, *_urdf_origin(joint))
        edges.append(Edge(joint.attrib.get("name", ""), parent, child, kind, child, _urdf_axis(joint)))
    return Model(frames, edges)


def _urdf_axis(joint: XmlElement) -> Callable:
    def axis():
        node = joint.find("axis")
        return np.zeros(3), np.array([1.0, 0.0, 0.0]) if node is None else node.numbers(
            node.attrib.get("xyz", ""), 3
        )

    return axis


def _urdf_origin(joint: XmlElement) -> tuple[Callable, Callable]:
    node = joint.find("origin")

    def read() -> Matrix4:
        if node is None:
            return np.eye(4)
        xyz, rpy = (node.numbers(node.attrib.get(key, "0 0 0"), 3) for key in ("xyz", "rpy"))
        return se3.pose(se3.rpy_to_matrix(rpy), xyz)

    def write(pose: Matrix4) -> list[Edit]:
        xyz, rpy = _rpy_values(pose)
        if node is None:
            return [joint.with_child(f'<origin xyz="{numbers_text(xyz)}" rpy="{numbers_text(rpy)}"/>')]
        return [node.with_attribute("xyz", xyz), node.with_attribute("rpy", rpy)]

    return read, write


def mjcf_model(text: str) -> Model:
    """An MJCF: bodies in one another; sites and cameras are fixed to theirs."""
    root = parse(text)
    _require(root, "mujoco")
    compiler = {k: v for node in root.iter("compiler") for k, v in node.attrib.items()}
    degrees, sequence = (
        compiler.get("angle", "degree") != "radian",
        compiler.get("eulerseq", "xyz").swapcase(),
    )
    defaults = _defaults(root)
    frames, edges = {}, []
    worlds = [w for w in root.children if w.tag == "worldbody"]
    nodes = [n for w in worlds for n in w.iter("body", "frame", "site", "camera")]
    keys = {id(node): f"{node.tag} {number}" for number, node in enumerate(nodes, start=1)}
    for node in nodes:
        around = next((keys[id(a)] for a in _above(node)[1:] if id(a) in keys), ROOT)
        key, values = keys[id(node)], _with_defaults(node, defaults)
        frames[key] = GivenFrame(around, key, *_mjcf_pose(node, values, degrees, sequence))
        joints = [j for j in node.children if j.tag in ("joint", "freejoint")] if node.tag == "body" else []
        joint = joints[0] if joints else node
        axis = _mjcf_axis(joint, _with_defaults(joint, defaults))
        kind: JointKind | None = JointKind.FIXED
        if joints:
            named = _with_defaults(joint, defaults).get("type", "hinge" if joint.tag == "joint" else "free")
            kind = {"hinge": JointKind.REVOLUTE, "slide": JointKind.PRISMATIC}.get(named)
            kind = kind if len(joints) == 1 else None
        edges.append(Edge(joint.attrib.get("name", ""), around, key, kind, key, axis))
    return Model(frames, edges)


def _above(node: XmlElement) -> list[XmlElement]:
    found: list[XmlElement] = []
    here: XmlElement | None = node
    while here is not None:
        found.append(here)
        here = here.parent
    return found


def _defaults(root: XmlElement) -> dict[tuple[str, str], dict[str, str]]:
    """Attributes by class and element, those of the classes around included."""
    found: dict[tuple[str, str], dict[str, str]] = {}
    for node in root.iter("default"):
        around = [a for a in reversed(_above(node)) if a.tag == "default"]
        name = node.attrib.get("class", "main") if len(around) > 1 else "main"
        for tag in ("joint", "site", "camera"):
            values = [c.attrib for a in around for c in a.children if c.tag == tag]
            merged = {k: v for each in values for k, v in each.items()}
            found[name, tag] = merged
            if len(around) == 1:
                found[node.attrib.get("class", "main"), tag] = merged
    return found


def _with_defaults(node: XmlElement, defaults: dict[tuple[str, str], dict[str, str]]) -> dict[str, str]:
    around = (a.attrib.get("childclass") for a in _above(node)[1:])
    name = node.attrib.get("class") or next((c for c in around if c), "main")
    return {**defaults.get((name, node.tag), {}), **node.attrib}


def _mjcf_axis(joint: XmlElement, values: dict[str, str]) -> Callable:
    def axis():
        if joint.numbers(values.get("ref", "0"), 1)[0] != 0.0:
            raise FileError(
                f"line {joint.line}: joint '{values.get('name')}' has a ref other than 0", path=FILE
            )
        return joint.numbers(values.get("pos", "0 0 0"), 3), joint.numbers(values.get("axis", "0 0 1"), 3)

    return axis


def _mjcf_pose(
    node: XmlElement, values: dict[str, str], degrees: bool, sequence: str
) -> tuple[Callable, Callable]:
    how = next((key for key in ORIENTATIONS if key in values), "quat")

    def read() -> Matrix4:
        pos = node.numbers(values.get("pos", "0 0 0"), 3)
        text = values.get(how, "1 0 0 0")
        if how == "quat":
            return se3.pose(se3.quaternion_to_matrix(node.numbers(text, 4)), pos)
        if how == "euler":
            turn = Rotation.from_euler(sequence, node.numbers(text, 3), degrees=degrees)
        else:
            raise FileError(
                f"line {node.line} has an orientation as {how}; write it as quat or euler", path=FILE
            )
        return se3.pose(turn.as_matrix(), pos)

    def write(pose: Matrix4) -> list[Edit]:
        numbers = se3.matrix_to_quaternion(pose[:3, :3])
        if how == "euler":
            turn = Rotation.from_matrix(pose[:3, :3])
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # where two angles turn about one axis, the last is 0
                numbers = turn.as_euler(sequence, degrees=degrees)
        return [node.with_attribute("pos", pose[:3, 3]), node.with_attribute(how, numbers)]

    return read, write


def sdf_model(text: str) -> Model:
    """An SDF of one model: links, joints and frames, each relative to another or to the model."""
    root = parse(text)
    _require(root, "sdf")
    models = list(root.iter("model"))
    if len(models) != 1:
        raise FileError(f"has {len(models)} models; give a file of the arm alone", path=FILE)
    frames, edges = {}, []
    for node in models[0].children:
        name = node.attrib.get("name", "")
        if node.tag == "joint":
            ends = [node.find(side) for side in ("parent", "child")]
            parent, child = ("" if e is None else e.text for e in ends)
            frames[name] = GivenFrame(_relative_to(node, child), child, *_sdf_pose(node))
            edges.append(
                Edge(name, parent, child, KINDS.get(node.attrib.get("type", "")), name, _sdf_axis(node))
            )
        elif node.tag == "link":
            frames[name] = GivenFrame(_relative_to(node, ROOT), name, *_sdf_pose(node))
        elif node.tag == "frame":
            held = node.attrib.get("attached_to", ROOT)
            frames[name] = GivenFrame(_relative_to(node, held), name, *_sdf_pose(node))
            edges.append(Edge("", held, name, JointKind.FIXED, name, _sdf_axis(node)))
    return Model(frames, edges)


def _relative_to(node: XmlElement, default: str) -> str:
    pose = node.find("pose")
    named = "" if pose is None else pose.attrib.get("relative_to", "")
    return ROOT if named == "__model__" else named or default


def _sdf_axis(joint: XmlElement) -> Callable:
    def axis():
        node = joint.find("axis")
        xyz = None if node is None else node.find("xyz")
        if xyz is None:
            return np.zeros(3), np.array([0.0, 0.0, 1.0])
        if xyz.attrib.get("expressed_in", "") not in ("", joint.attrib.get("name")):
            raise FileError(
                f"line {xyz.line} has an axis expressed in a frame other than its joint's", path=FILE
            )
        return np.zeros(3), xyz.numbers(xyz.text, 3)

    return axis


def _sdf_pose(owner: XmlElement) -> tuple[Callable, Callable]:
    node = owner.find("pose")
    attrib = {} if node is None else node.attrib
    is_quaternion = attrib.get("rotation_format") == "quat_xyzw"
    unit = np.pi / 180.0 if attrib.get("degrees") in ("true", "1") else 1.0

    def read() -> Matrix4:
        if node is None or not node.text:
            return np.eye(4)
        values = node.numbers(node.text, 7 if is_quaternion else 6)
        turn = values[[6, 3, 4, 5]] if is_quaternion else values[3:] * unit
        return se3.pose((se3.quaternion_to_matrix if is_quaternion else se3.rpy_to_matrix)(turn), values[:3])

    def write(pose: Matrix4) -> list[Edit]:
        xyz, rpy = _rpy_values(pose)
        turn = se3.matrix_to_quaternion(pose[:3, :3])[[1, 2, 3, 0]] if is_quaternion else rpy / unit
        values = np.concatenate([xyz, turn])
        return [
            owner.with_child(f"<pose>{numbers_text(values)}</pose>")
            if node is None
            else node.with_text(values)
        ]

    return read, write
