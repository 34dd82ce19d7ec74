"""Robots from URDF files, with six small corrections per joint.

Each joint on the path from root to tip becomes: its origin (a constant), six corrections named
`jointN.x … jointN.yaw` that are zero until identified, and the driven rotation or translation about the
joint's axis. `urdf_writer.py` multiplies the corrections into the origins again.
"""

import re
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from workbench.arm.chain import Axis, Element
from workbench.arm.frame import FRAME_PARTS, Frame
from workbench.arm.joint import Joint, JointKind
from workbench.arm.masses import side_branches, with_bodies
from workbench.arm.mounting import Mounting
from workbench.arm.plausible_units import is_whole_degrees, with_plausible_units
from workbench.arm.robot import Robot, UrdfSource
from workbench.base import se3
from workbench.base.errors import FileError, RobotError
from workbench.base.files import read_bytes
from workbench.base.types import Freedom, Matrix4, Vector3, frozen
from workbench.base.wording import first_of

if TYPE_CHECKING:
    import yourdfpy

KINDS = {kind.value: kind for kind in JointKind} | {"continuous": JointKind.REVOLUTE}
MAX_FILE_BYTES, MAX_PARTS, ANY_EFFORT = 16 * 2**20, 1000, 1e9
"""Maximum number of bytes, links and joints of a file, and what stands for no effort: at 0 no joint moves."""
BASE_LINK, TOOL_LINK = "measuring_frame", "calibrated_tool"
"""Links before and after the arm in a written file, whose fixed joints are read as its base and tool."""
BEFORE = re.compile(rb"\A\s*(?:<!--.*?-->\s*)*(?=<\?xml)", re.DOTALL)
"""Blank lines and comments before a declaration."""
CORRECTION_AXES = (Axis.TX, Axis.TY, Axis.TZ, Axis.RX, Axis.RY, Axis.RZ)


def read_urdf(path: Path | str, *, tip: str | None = None) -> Robot:
    """Read the longest chain of a URDF, or the one that ends in the link `tip`.

    Raises:
        FileError: no URDF, no such link, several equally long chains, or an unsupported joint.
    """
    path = Path(path)
    with _naming(path):
        return _read(path, tip)


@contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Errors name the file."""
    try:
        yield
    except RobotError as error:
        raise FileError(str(error), path=str(path)) from None


def _read(path: Path, tip: str | None) -> Robot:
    model = _parse(path)
    whole = _chain_to(model, tip)
    joints, mounting = _mounted(whole)
    elements, infos, ends = list[Element](), list[Joint](), list[int]()
    notes, names = list[str](), list[str]()
    beside = side_branches(model, whole, notes)
    for link, joint in enumerate(joints):
        if joint.type not in KINDS:
            why = f"is of type '{joint.type}', which a serial chain can't contain; choose another tip"
            raise RobotError(f"joint '{joint.name}' {why}")
        if joint.child not in model.link_map:
            why = f"leads to link '{joint.child}', which is not declared; add a <link> of that name"
            raise RobotError(f"joint '{joint.name}' {why}")
        turning = KINDS[joint.type]
        kind = turning if joint.mimic is None else JointKind.FIXED  # a follower has no coordinate
        name = f"fixed{link + 1 - len(names)}" if kind is JointKind.FIXED else f"joint{len(names) + 1}"
        elements += origin_elements(name, _origin(joint), link, is_free=turning is not JointKind.FIXED)
        if turning is not JointKind.FIXED:
            drive = driven_elements(name, turning, _unit_axis(joint), len(names), link)
            if kind is JointKind.FIXED:
                drive = [_following(e, joint, names, notes) for e in drive]
            else:
                names.append(joint.name)
            elements += drive
        ends.append(len(elements) - 1)
        info = _joint_info(joint, name, kind, model, notes)
        infos.append(with_bodies(info, beside.get(joint.child, [])))
    moving = ", ".join(j.name for j in joints if j.type != "fixed")
    tips = sorted({j.child for j in model.robot.joints} - {j.parent for j in model.robot.joints})
    moving += f"; the file's chains end at {first_of(tips, 5)} (--tip)" * bool(tips[1:] and tip is None)
    robot = Robot(
        name=model.robot.name or path.stem,
        convention="urdf",
        elements=tuple(elements),
        joints=tuple(infos),
        link_ends=tuple(ends),
        mounting=mounting,
        ends=(joints[0].parent, joints[-1].child),
        urdf=UrdfSource(path, tuple(j.name for j in joints), joints[0].parent),
        notes=(f"chain from link '{joints[0].parent}' to '{joints[-1].child}', joints {moving}", *notes),
    )
    return with_plausible_units(robot)


def _mounted(joints: list) -> tuple[list, Mounting]:
    """The chain without the base and tool that `urdf_writer.py` added, and these."""
    base = tool = Frame(free=Freedom.AUTO)
    if joints[0].type == "fixed" and joints[0].parent.startswith(BASE_LINK):
        base, joints = Frame.from_pose(_origin(joints[0]), Freedom.AUTO), joints[1:]
    if joints[-1].type == "fixed" and joints[-1].child.startswith(TOOL_LINK):
        tool, joints = Frame.from_pose(_origin(joints[-1]), Freedom.AUTO), joints[:-1]
    return joints, Mounting(base=base, tool=tool)


def _origin(joint) -> Matrix4:
    origin = np.eye(4) if joint.origin is None else np.array(joint.origin, float)
    if not np.isfinite(origin).all():
        raise RobotError(f"joint '{joint.name}' has an <origin> that is not a number")
    return origin


def _parse(path: Path) -> "yourdfpy.URDF":
    if not path.is_file():
        raise RobotError("no such file; give a URDF")
    root = xml_root(path)
    if root.tag != "robot":
        raise RobotError(f"is not a URDF: its root is <{root.tag}>, not <robot>")
    if any(map(_is_unexpanded, root.iter())):
        expand = f"'xacro {path.name} > {path.stem}_expanded.urdf' (ROS)"
        raise RobotError(f"is a xacro; expand it first: {expand}")
    if not root.findall("joint"):
        raise RobotError("has no joints; give a URDF that describes an arm")
    for kind in ("joint", "link"):
        names = Counter(str(node.get("name")) for node in root.findall(kind))
        if names.total() > MAX_PARTS:
            raise RobotError(f"has {names.total()} {kind}s; give at most {MAX_PARTS}")
        if double := next((name for name, count in names.items() if count > 1), None):
            raise RobotError(f"has two {kind}s called '{double}'; rename one")
    for joint in root.findall("joint"):
        _check_angles(joint)
    import yourdfpy  # imports trimesh, which most sessions don't need

    try:
        return yourdfpy.URDF.load(BytesIO(ET.tostring(root)), build_scene_graph=False, load_meshes=False)
    except Exception as error:  # yourdfpy raises many types for a malformed file
        why = f"{type(error).__name__}: {error}"
        raise RobotError(f"can't be read as a URDF ({why}); correct the file") from None


def _is_unexpanded(node: ET.Element) -> bool:
    """Whether a node is xacro's, but for a definition of numbers, or uses what one defines."""
    if "/xacro}" in str(node.tag):
        return not str(node.tag).endswith("}property")
    return any("${" in value for value in node.attrib.values())


def _check_angles(joint: ET.Element) -> None:
    """Refuse an origin rotated by degrees; invalid numbers are left to the parser."""
    origin = joint.find("origin")
    rpy = "" if origin is None else origin.get("rpy", "")
    with suppress(ValueError):
        if any(is_whole_degrees(float(v)) for v in rpy.split()):
            looks = f'rpy="{rpy}", which looks like degrees; give radians'
            raise RobotError(f"joint '{joint.get('name')}' has {looks}")


def xml_root(path: Path, *, wanted: str = "a URDF") -> ET.Element:
    """The file's <robot>, comments included; whatever stands before its declaration is ignored, as by ROS."""
    parser = ET.XMLParser(target=ET.TreeBuilder(insert_comments=True))
    content = BEFORE.sub(b"", read_bytes(path, wanted=wanted, maximum=MAX_FILE_BYTES))
    with _naming(path):
        try:
            return ET.fromstring(with_namespaces(content), parser=parser)
        except (ET.ParseError, LookupError, ValueError) as error:  # of an encoding unless of its parts
            more = "" if isinstance(error, ET.ParseError) else "; save it as UTF-8"
            raise RobotError(f"is not a URDF: {error}{more}") from None


def with_namespaces(content: bytes) -> bytes:
    """A URDF that declares the prefixes of its tags, as of Gazebo's `sensor:camera`; ROS needs no such."""
    for prefix in {*re.findall(rb"<(\w+):", content)} - {*re.findall(rb"xmlns:(\w+)", content)}:
        ET.register_namespace(prefix.decode(), prefix.decode())
        content = re.sub(rb"<robot\b", b'<robot xmlns:%b="%b"' % (prefix, prefix), content, count=1)
    return content


def tip_of(robot: Robot, joints: int) -> str | None:
    """Last link of the only chain with so many moving joints in the file of a robot, if there is one."""
    if robot.urdf is None:
        return None
    with _naming(robot.urdf.path):
        every = _chains(_parse(robot.urdf.path))
    alone = (c for c in every.values() if {j.mimic.joint for j in c if j.mimic} <= {j.name for j in c})
    chains = {c[-1].child: c for c in alone if _moving(c) == joints}
    last = {next(j for j in reversed(chain) if _moves(j)).child for chain in chains.values()}
    ends = set(chains) - {chain[-1].parent for chain in chains.values()}
    return None if len(last) != 1 else (ends if len(ends) == 1 else last).pop()


def _moves(joint) -> bool:
    return joint.type != "fixed" and joint.mimic is None


def _moving(chain: list) -> int:
    """Number of joints that move on their own."""
    return sum(map(_moves, chain))


def _chains(model: "yourdfpy.URDF") -> dict[str, list]:
    """Joints from the root to every link."""
    into: dict = {}
    for joint in model.robot.joints:
        if joint.child in into:
            both = f"'{into[joint.child].name}' and '{joint.name}'"
            raise RobotError(f"link '{joint.child}' has two parent joints, {both}; a serial chain is needed")
        into[joint.child] = joint
    chains = {}
    for link in (link.name for link in model.robot.links):
        chain, parent = [], link
        while parent in into:
            chain.append(into[parent])
            parent = into[parent].parent
            if len(chain) > len(into):
                raise RobotError("its joints form a loop; a serial chain is needed")
        chains[link] = chain[::-1]
    return chains


def _chain_to(model: "yourdfpy.URDF", tip: str | None) -> list:
    """Joints from the root to the tip, or to a calibrated tool, or along the most moving joints."""
    chains = _chains(model)
    if tip is not None:
        if tip not in chains:
            raise RobotError(f"has no link '{tip}'; its links are {', '.join(chains)}")
        if not _moving(chains[tip]):
            raise RobotError(f"has no joint that moves on the path to link '{tip}'")
        return chains[tip]
    children = Counter(joint.parent for joint in model.robot.joints)
    ends = [link for link in chains if link not in children]
    if ours := [link for link in ends if link.startswith(TOOL_LINK)]:
        return chains[ours[-1]]
    arms = (_without_gripper(chains[link], model.robot.joints) for link in ends)
    leaves = {arm[-1].child: arm for arm in arms if arm}
    maximum = max(map(_moving, leaves.values()), default=0)
    if maximum == 0:
        raise RobotError("has no joint that moves a link")
    best = [joints for joints in leaves.values() if _moving(joints) == maximum]
    last_moving = [max(i for i, j in enumerate(joints) if j.type != "fixed") for joints in best]
    if len({joints[i].name for joints, i in zip(best, last_moving, strict=True)}) > 1:
        forks = [link for link, count in children.items() if count > 1 and _moving(chains[link])]
        forks.sort(key=lambda link: -_moving(chains[link]))
        tips = first_of([*forks, *(joints[-1].child for joints in best)], 5)
        text = f"has several chains of {maximum} moving joints; choose the arm's last link"
        raise RobotError(f"{text} (--tip LINK): {tips}")
    return best[0] if len(best) == 1 else best[0][: last_moving[0] + 1]  # several tools: up to the flange


def _without_gripper(chain: list, joints: list) -> list:
    """A chain up to the first joint that follows one beside it, or a last one that some beside it follow."""
    own = {j.name for j in chain}
    led = {j.mimic.joint for j in joints if j.mimic and j.name not in own}
    end = next((k for k, j in enumerate(chain) if j.mimic and j.mimic.joint not in own), len(chain))
    last = max((k for k, j in enumerate(chain[:end]) if _moves(j)), default=0)
    arm = chain[: last if chain and chain[last].name in led else end]
    return arm if _moving(arm) else chain


def _unit_axis(joint) -> Vector3:
    axis = np.array(joint.axis, float)
    if axis.shape != (3,) or not np.isfinite(axis).all() or np.linalg.norm(axis) < 1e-9:
        raise RobotError(f"joint '{joint.name}' has the <axis> {axis.tolist()}; give a direction")
    return axis / np.linalg.norm(axis)


def origin_elements(name: str, origin: Matrix4, link: int, *, is_free: bool = True) -> list[Element]:
    """The constant frame of a joint, and its six corrections."""
    pairs = zip(CORRECTION_AXES, FRAME_PARTS, strict=True) if is_free else ()
    corrections = [Element(axis, f"{name}.{part}", free=True, link=link) for axis, part in pairs]
    return [Element(Axis.CONSTANT, f"{name}.origin", link=link, matrix=frozen(origin)), *corrections]


def driven_elements(name: str, kind: JointKind, axis: Vector3, joint: int, link: int) -> list[Element]:
    """The driven element, between constants that rotate its axis onto x, y or z if needed."""
    first = Axis.RX if kind is JointKind.REVOLUTE else Axis.TX
    main = int(np.argmax(axis))
    if axis[main] > 1.0 - 1e-12:
        return [Element(Axis(first + main), f"{name}.q", joint=joint, link=link)]
    cross = np.cross([0.0, 0.0, 1.0], axis)
    sine, cosine = np.linalg.norm(cross), axis[2]
    flat = np.diag([1.0, np.sign(cosine), np.sign(cosine)])
    turn = flat if sine < 1e-12 else se3.rotvec_to_matrix(cross / sine * np.arctan2(sine, cosine))
    there = se3.pose(turn, np.zeros(3))
    return [
        Element(Axis.CONSTANT, f"{name}.align", link=link, matrix=frozen(there)),
        Element(Axis(first + 2), f"{name}.q", joint=joint, link=link),
        Element(Axis.CONSTANT, f"{name}.unalign", link=link, matrix=frozen(se3.inverse(there))),
    ]


def _following(element: Element, joint, names: list[str], notes: list[str]) -> Element:
    """The driven element of a mimic joint, which follows a joint nearer to the root; others unchanged."""
    if element.joint is None:
        return element
    if joint.mimic.joint not in names:
        why = "which isn't a moving joint before it in the chain; choose another tip"
        raise RobotError(f"joint '{joint.name}' follows '{joint.mimic.joint}', {why}")
    ratio = 1.0 if joint.mimic.multiplier is None else float(joint.mimic.multiplier)
    offset = 0.0 if joint.mimic.offset is None else float(joint.mimic.offset)
    how = f"{ratio:g} times its position {offset:+g}"
    notes.append(f"joint '{joint.name}' follows '{joint.mimic.joint}': {how}")
    follows = names.index(joint.mimic.joint)
    return replace(element, joint=None, follows=follows, ratio=ratio, value=offset)


def _joint_info(joint, name: str, kind: JointKind, model, notes: list[str]) -> Joint:
    limits = (-np.inf, np.inf)
    if kind is not JointKind.FIXED and joint.type != "continuous":
        lower, upper = (getattr(joint.limit, end, None) for end in ("lower", "upper"))
        if lower is None or upper is None or not lower < upper:  # SolidWorks writes 0 and 0 for none
            how = "make its type 'continuous' if it can turn without end, 'fixed' if it is locked"
            said = f"has the limits {lower} and {upper}; give <limit lower=… upper=…/>, or {how}"
            raise RobotError(f"joint '{joint.name}' {said}")
        limits = float(lower), float(upper)
    elif kind is not JointKind.FIXED:
        notes.append(f"joint '{joint.name}' is continuous: searches use half a turn either way")
    inertial = model.link_map[joint.child].inertial
    mass, com = None, np.zeros(3)
    if inertial is not None and inertial.mass is not None:
        mass = float(inertial.mass)
        com = np.zeros(3) if inertial.origin is None else np.array(inertial.origin[:3, 3], float)
        if not (mass >= 0.0 and np.isfinite([mass, *com]).all()):
            wrong = f"the mass {mass} at {com.tolist()}; correct its <inertial>"
            raise RobotError(f"link '{joint.child}' has {wrong}")
    effort = float(joint.limit.effort or 0.0) if joint.limit is not None else 0.0
    return Joint(
        name=name,
        label=joint.name,
        link=joint.child,
        kind=kind,
        limits=limits,
        mass=mass,
        com=frozen(com),
        max_moment=effort if 0.0 < effort < ANY_EFFORT else None,
    )
