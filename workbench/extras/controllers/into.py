"""`export --for urdf --into FILE`: the calibrated arm in a URDF of the user's own.

    D_k = X C_k N_k⁻¹ X⁻¹    how far the calibration moved what hangs on joint k (and the flange)
    new pose = (D_parent G_parent)⁻¹ D_own G_own    of every link whose parent moves otherwise

N and C are nominal and calibrated frames at zero, G those of the file, X the arm's base in it. D_k is
then brought exactly onto the calibrated joint's axis, as the file's nominal numbers may be rounded; as
T(q) = Π exp(ξ_k q_k) T(0), axes and flange at zero are all that counts. Comments and all else stay.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, final

import numpy as np
from lxml import etree

from workbench.arm.joint_frames import JointFrame, JointFrames, joint_frames
from workbench.arm.robot import JointKind, Robot
from workbench.arm.urdf import KINDS, with_namespaces
from workbench.arm.urdf_writer import numbers_text
from workbench.base import se3
from workbench.base.errors import FileError, OptionError
from workbench.base.toml import MAX_NUMBER
from workbench.base.types import Matrix4, Vector3, frozen
from workbench.base.wording import in_mm
from workbench.data.readers.headings import number_in
from workbench.exports.export_format import AbstractForm, Job, pose_text

FILE, WAS = "the file of --into", "that was calibrated"
MARK = " calibrated by workbench "
"""Comment in a file that has a calibration."""
FAR, ANGLE = 2e-3, np.deg2rad(0.5)
"""Distance [m] and angle [rad] of an axis from nominal that rounding in a model file explains."""
SAME = 1e-12
"""Change of a pose [m or rad] that is none."""
Line = tuple[Vector3, Vector3]
"""Point and direction of an axis."""


@dataclass(frozen=True, eq=False)
class UrdfLink:
    """A link below a joint.

    Args:
        node: The joint's element.
        parent: The link that it is given in; None for the root.
        at_zero: Its pose in the root with all joints at 0.
        kind: How the joint moves; None for what no joint of an arm does.
        axis: Of the joint, in the link.
    """

    node: Any
    parent: "UrdfLink | None"
    at_zero: Matrix4
    kind: JointKind | None
    axis: Vector3

    @property
    def name(self) -> str:
        """Of its joint."""
        return self.node.get("name", "")

    @property
    def line(self) -> Line:
        """Axis of the joint in the root."""
        return _moved(self.at_zero, (np.zeros(3), self.axis))

    @property
    def path(self) -> list["UrdfLink"]:
        """Links with joints that move, from the root to this one."""
        above = [] if self.parent is None else self.parent.path
        return above + [self] * (self.kind is not JointKind.FIXED)


@dataclass(frozen=True, eq=False)
class Placing:
    """The arm in a file.

    Args:
        root: The file.
        links: All of its links but the root.
        chain: Those that the arm's joints move.
        is_named: Whether they were found by their names.
        base: The arm's base in the file's root.
        moves: What the calibration does before the arm, behind each joint, and to what is fixed to the last;
            all else stays where it is in the link that it hangs on.
    """

    root: Any
    links: list[UrdfLink]
    chain: list[UrdfLink]
    is_named: bool
    base: Matrix4
    moves: list[Matrix4]

    @property
    def ends(self) -> list[UrdfLink]:
        """What is fixed to the last joint's link: it takes the flange's correction."""
        return [link for link in self.links if link.parent is self.chain[-1]]

    @property
    def moved(self) -> Iterable[tuple[UrdfLink, Matrix4, Matrix4]]:
        """Links that may move in their parents, and how the calibration moves them and these."""
        before = zip(self.chain, self.moves[1:], self.moves, strict=False)
        return (*before, *((link, self.moves[-1], self.moves[-2]) for link in self.ends))


@final
class Urdf(AbstractForm):
    """A URDF that gets other numbers."""

    name = "urdf"
    title = "your own URDF with the calibrated numbers (--into FILE)"
    ending = ".urdf"
    needs_source = True

    def write(self, job: Job) -> str:
        placing = _placing(job)
        for link, own, other in placing.moved:
            if np.abs((own - other) @ link.at_zero).max() > SAME:
                around = other if link.parent is None else other @ link.parent.at_zero
                new = se3.inverse(around) @ own @ link.at_zero
                origin = link.node.find("origin")
                origin = etree.SubElement(link.node, "origin") if origin is None else origin
                origin.set("xyz", numbers_text(new[:3, 3]))
                origin.set("rpy", numbers_text(se3.matrix_to_rpy(new[:3, :3])))
        root = placing.root
        mark = etree.Comment(MARK)
        mark.tail = root.text
        root.insert(0, mark)
        is_declared = str(job.source).startswith("<?xml")
        text = etree.tostring(root.getroottree(), encoding="utf-8", xml_declaration=is_declared)
        return text.decode() + "\n"

    def read(self, text: str, job: Job) -> Robot:
        placing, own, new = _placing(job), job.frames, urdf_links(parse(text))
        base, here, joints = se3.inverse(placing.base), np.eye(4), []
        for joint, link in zip(own.joints, placing.chain, strict=True):
            now = new[placing.links.index(link)]
            at = base @ now.at_zero
            joints.append(JointFrame(joint.joint, frozen(se3.inverse(here) @ at), frozen(now.axis)))
            here = at
        flange = own.at_zero[-1]
        for end in placing.ends[:1]:
            nominal = joint_frames(job.required(job.before, self.name, WAS)).at_zero[-1]
            moved = new[placing.links.index(end)].at_zero @ se3.inverse(end.at_zero)
            flange = base @ moved @ placing.base @ nominal
        return JointFrames(tuple(joints), frozen(se3.inverse(here) @ flange)).robot(job.robot)

    def notes(self, job: Job) -> Iterable[str]:
        placing, robot = _placing(job), job.robot
        names = [link.name for link in placing.chain]
        if not placing.is_named:
            yield f"joints matched by their order, as their names differ: {', '.join(names)}"
        if not np.array_equal(placing.base, np.eye(4)):
            yield f"the arm's base is at {pose_text(placing.base)} of the file's root"
        if not np.array_equal(robot.base.pose, np.eye(4)):
            yield "the calibrated base frame is not written: the file's root stays where it is"
        if not placing.ends or not np.allclose(robot.tool.pose, np.eye(4), atol=SAME):
            last = placing.moves[len(names)] @ placing.chain[-1].at_zero
            tool = se3.inverse(last) @ placing.base @ job.frames.at_zero[-1] @ robot.tool.pose
            where = f"in the frame of the file's joint '{names[-1]}' it is at {pose_text(tool)}"
            yield f"the tool is not written; {where}"


def parse(text: str) -> Any:
    """The root element; the parser fetches nothing and expands no entities."""
    parser = etree.XMLParser(encoding="utf-8", resolve_entities=False)
    try:
        root = etree.fromstring(with_namespaces(text.encode()), parser)
    except etree.XMLSyntaxError as error:
        raise FileError(f"is not XML: {error}", path=FILE) from None
    if "\ufffd" in text or root.getroottree().docinfo.doctype:
        raise FileError("is not UTF-8, or has a document type (<!DOCTYPE>): remove it", path=FILE)
    return root


def urdf_links(root: Any) -> list[UrdfLink]:
    """Links with a joint above them, parents first."""
    joints = {}
    for node in root.iter("joint"):
        ends = [node.find(side) for side in ("parent", "child")]
        if None not in ends:  # else it is of a transmission or of ros2_control
            joints[ends[1].get("link")] = ends[0].get("link"), node
    links: dict[str, UrdfLink] = {}
    while ready := [link for link, (above, _) in joints.items() if above in links or above not in joints]:
        for link in ready:
            above, node = joints.pop(link)
            xyz, rpy = (_numbers(node.find("origin"), key, "0 0 0") for key in ("xyz", "rpy"))
            kind = KINDS.get(node.get("type")) if node.find("mimic") is None else None
            turns = None if node.get("type") == "fixed" else node.find("axis")  # xacro writes 0 0 0 there
            axis = _numbers(turns, "xyz", "1 0 0", is_direction=True)
            pose, parent = se3.pose(se3.rpy_to_matrix(rpy), xyz), links.get(above)
            at_zero = pose if parent is None else parent.at_zero @ pose
            links[link] = UrdfLink(node, parent, at_zero, kind, axis / np.linalg.norm(axis))
    if joints:
        raise FileError(f"link '{next(iter(joints))}' hangs on itself", path=FILE)
    return list(links.values())


def _numbers(node: Any, key: str, default: str, *, is_direction: bool = False) -> np.ndarray:
    """Three numbers of an attribute; not all 0 for a direction."""
    text = default if node is None else node.get(key, default)
    found = np.array([number_in(word) for word in text.split()])
    is_sound = len(found) == 3 and bool((np.abs(found) < MAX_NUMBER).all())
    if is_sound and (found.any() or not is_direction):
        return found
    wrong = f"line {node.sourceline} has {key}='{text.strip()[:80]}', where 3 numbers are needed"
    raise FileError(f"{wrong}; write the nominal numbers there", path=FILE)


@lru_cache(maxsize=1)
def _placing(job: Job) -> Placing:
    """The nominal arm in the file of a job, and how the calibration moves it; of the last job."""
    if job.source is None:
        raise OptionError("--for urdf needs --into FILE, the model to update", option="--into")
    nominal, root = joint_frames(job.required(job.before, "urdf", WAS)), parse(job.source)
    if any(joint.joint.kind is not JointKind.REVOLUTE for joint in nominal.joints):
        raise OptionError("--for urdf is for arms of revolute joints; export a new URDF with --urdf")
    if root.tag != "robot":
        raise FileError(f"its root is <{root.tag}>, not <robot>; give a URDF", path=FILE)
    if any(node.text == MARK for node in root.iter(etree.Comment)):
        raise FileError("has a calibration already; give the nominal model", path=FILE)
    links = urdf_links(root)
    chain, is_named = _chain(links, job.robot.joint_names)
    if odd := [link.name for link in chain if link.kind is not JointKind.REVOLUTE]:
        raise FileError(f"joint '{odd[0]}' is not revolute, unlike that of the arm", path=FILE)
    found, own = [link.line for link in chain], _lines(nominal)
    base = _base(own, found)
    far, angle = _apart(base, own, found)
    if max(far.max() / FAR, angle.max() / ANGLE) > 1.0:
        worst = int(np.argmax(np.maximum(far / FAR, angle / ANGLE)))
        text = f"does not match the nominal arm of the calibration: the axis of joint '{chain[worst].name}'"
        off = f"{in_mm(far[worst])} and {np.rad2deg(angle[worst]):.2g}° off"
        limits = f"limits {in_mm(FAR)} and {np.rad2deg(ANGLE):.1g}°"
        raise FileError(f"{text} is {off} ({limits}); give the nominal model", path=FILE)
    steps = zip(job.frames.at_zero, nominal.at_zero, strict=True)
    moves = [base @ c @ se3.inverse(base @ n) for c, n in steps]
    for k, (line, wanted) in enumerate(zip(found, _lines(job.frames), strict=True)):
        moves[k] = _onto(_moved(moves[k], line), _moved(base, wanted)) @ moves[k]
    return Placing(root, links, chain, is_named, base, [np.eye(4), *moves])


def _chain(links: list[UrdfLink], names: Sequence[str]) -> tuple[list[UrdfLink], bool]:
    """The arm's joints from base to flange, by their names or else by their order."""
    found = {link.name: link for link in links if link.kind is not JointKind.FIXED}
    if missing := [name for name in names if name not in found]:
        if len(missing) < len(names):
            raise FileError(f"has no joint '{missing[0]}', which the calibration has", path=FILE)
        arms = [path for link in found.values() if len(path := link.path) == len(names)]
        if len(arms) != 1:
            what = f"{len(arms)} arms of {len(names)} joints in series, and none called {names[0]}"
            raise FileError(f"has {what}; give the model of one arm", path=FILE)
        return arms[0], False
    path = found[names[-1]].path[-len(names) :]
    if [link.name for link in path] != list(names):
        raise FileError(f"has other joints in between, or another order than {', '.join(names)}", path=FILE)
    return path, True


def _lines(frames: JointFrames) -> list[Line]:
    """Every joint's axis at zero, in the arm's base."""
    pairs = zip(frames.at_zero, frames.joints, strict=False)
    return [_moved(pose, (np.zeros(3), joint.axis)) for pose, joint in pairs]


def _moved(pose: Matrix4, line: Line) -> Line:
    point, axis = line
    return se3.apply(pose, point), pose[:3, :3] @ axis


def _onto(old: Line, new: Line) -> Matrix4:
    """The smallest motion that brings one axis onto another."""
    normal = np.cross(old[1], new[1])
    sine = float(np.linalg.norm(normal))
    turn = se3.rotvec_to_matrix(normal * (np.arctan2(sine, old[1] @ new[1]) / max(sine, 1e-300)))
    across = np.cross(new[1], np.cross(new[0] - old[0], new[1]))
    return se3.pose(turn, old[0] + across - turn @ old[0])


def _apart(base: Matrix4, own: list[Line], found: list[Line]) -> tuple[np.ndarray, np.ndarray]:
    """Distances and angles between the axes of the arm at a place and those of the file [m], [rad]."""
    pairs = [(*_moved(base, line), *other) for line, other in zip(own, found, strict=True)]
    far = np.array([np.linalg.norm(np.cross(axis, point - p)) for p, _, point, axis in pairs])
    angle = [np.arctan2(np.linalg.norm(np.cross(u, axis)), u @ axis) for _, u, _, axis in pairs]
    return far, np.array(angle)


def _base(own: list[Line], found: list[Line]) -> Matrix4:
    """The place of the arm's base at which its axes are nearest to the file's; the root if they are there."""
    far, angle = _apart(np.eye(4), own, found)
    if far.max() <= FAR and angle.max() <= ANGLE:
        return np.eye(4)
    return se3.best_fit(_marks(own), _marks(found))


def _marks(lines: list[Line]) -> np.ndarray:
    """Points that move with an arm: the one nearest to its axes, its feet on them, and these along them."""
    points, axes = map(np.array, zip(*lines, strict=True))
    across = np.eye(3) - axes[:, :, None] * axes[:, None]
    middle = np.linalg.lstsq(across.sum(0), np.einsum("kij,kj->i", across, points), rcond=1e-9)[0]
    feet = middle + np.einsum("kij,kj->ki", across, points - middle)
    return np.vstack([middle, feet, feet + axes])
