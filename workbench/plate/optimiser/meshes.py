"""The shape of an arm for clearance: the meshes of its URDF, which hold on the real machine, or capsules.

Pinocchio reads the file's collision geometry (the visual one where there is none): meshes and primitives with
their scales and placements, as coal bodies. Their frames come from the arm's own chain rather than from
Pinocchio's model, since the chain has the calibrated corrections, computes all postures at once, and is what
everything else is computed with. Capsules (`capsules`) remain for arms that come as tables.

Neighbouring bodies are never checked against each other. Neither are two bodies that no posture brings apart
by more than the clearance that is asked for, such as links beside the one joint that connects them.
"""

import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import combinations

import coal
import numpy as np

from workbench.arm.meshes import find_mesh
from workbench.arm.robot import JointKind, Robot, UrdfSource
from workbench.arm.urdf import xml_root
from workbench.base import se3
from workbench.base.types import frozen
from workbench.plate.optimiser.capsules import LAST_LINK_RADIUS, PROBE_RADIUS, capsule_arm
from workbench.plate.optimiser.shapes import ArmShape, Collider, Piece, turned_to

SAMPLED = 200
"""Random postures that tell which pairs of bodies can be apart."""
AT_THE_TOOL = 0.005
"""A body of the last link that comes this near to the tool's origin is the probe [m]."""


def arm_shape(robot: Robot, clearance: float) -> ArmShape:
    """The meshes of an arm's URDF, or where it has none that can be read capsules along its links.

    Args:
        clearance: Required distance [m].
    """
    found, capsules = mesh_arm(robot, clearance), capsule_arm(robot)
    if found is not None or robot.urdf is None:
        return found or capsules
    why = f"{robot.urdf.path.name} has no meshes that can be found and read"
    return replace(capsules, source=f"{capsules.source}: {why}")


def mesh_arm(robot: Robot, clearance: float) -> ArmShape | None:
    """The meshes of an arm's URDF; None if it has none, or if one of them can't be read.

    Args:
        clearance: Distance that will be asked for [m]; pairs that are never so far apart are left out.
    """
    if robot.urdf is None or not robot.urdf.path.is_file():
        return None
    try:
        pieces, kind = _pieces(robot, robot.urdf)
        usable = [piece.solid.hull for piece in pieces]
    except Exception:  # Pinocchio, its mesh reader and qhull raise many kinds for files that they can't use
        return None
    if not usable:
        return None
    pieces = _with_probe(robot, pieces)
    source = f"clearance is that of the {kind} meshes of {robot.urdf.path.name}"
    apart = tuple((a, b) for a, b in combinations(pieces, 2) if abs(a.body - b.body) > 1)
    arm = ArmShape(robot, pieces, apart, source)
    low, high = robot.search_limits.T
    frames = arm.placements(np.random.default_rng(0).uniform(low, high, (SAMPLED, robot.dof)))
    alone = ((pair, replace(arm, pairs=(pair,))) for pair in apart)
    kept = (  # those that some posture brings apart by the clearance
        pair
        for pair, one in alone
        if any(one.own_distances(row[None], minimum=clearance)[0] >= clearance for row in frames)
    )
    return replace(arm, pairs=tuple(kept))


def _pieces(robot: Robot, source: UrdfSource) -> tuple[tuple[Piece, ...], str]:
    """Bodies of the chain's links, and whether they are the file's collision or visual ones."""
    import pinocchio as pin  # a second to import: only for arms with a URDF

    root = xml_root(source.path)
    joints = {joint.get("name"): joint for joint in root.findall("joint")}
    links = [source.root, *(joints[name].find("child").get("link") for name in source.joints)]  # type: ignore[union-attr]
    kind = "visual"
    for link in root.findall("link"):
        if link.get("name") in links:
            kind = "collision" if link.find("collision") is not None else kind
        else:
            for shape in (*link.findall("collision"), *link.findall("visual")):
                link.remove(shape)
    for mesh in root.iter("mesh"):
        mesh.set("filename", find_mesh(str(mesh.get("filename")), source.path))
    text = ET.tostring(root, encoding="unicode")
    model = pin.buildModelFromXML(text)
    geometry = pin.buildGeomFromUrdfString(model, text, getattr(pin.GeometryType, kind.upper()))
    moving = np.cumsum([0, *(joint.kind is not JointKind.FIXED for joint in robot.joints)])
    pieces = []
    for found in geometry.geometryObjects:
        frame = model.frames[found.parentFrame]
        entry = links.index(frame.name)
        pose = (frame.placement.inverse() * found.placement).homogeneous
        pieces.append(Piece(int(moving[entry]), entry, frozen(pose), Collider(found.geometry)))
    return tuple(sorted(pieces, key=lambda piece: piece.frame)), kind


def _with_probe(robot: Robot, pieces: tuple[Piece, ...]) -> tuple[Piece, ...]:
    """The pieces, the probe among them: what is at the tool's origin, or a slender rod to it."""
    point = Piece(robot.dof, -1, np.eye(4), Collider(coal.Sphere(1e-6)))
    pairs = [(replace(piece, solid=Collider(piece.solid.hull)), point) for piece in pieces]
    alone = [ArmShape(robot, pieces, (pair,), "") for pair in pairs]
    placements = alone[0].placements(np.zeros((1, robot.dof)))
    near = [bool(one.own_distances(placements)[0] < AT_THE_TOOL) for one in alone]
    own = zip(pieces, near, strict=True)
    marked = tuple(replace(piece, probe=at and piece.body == robot.dof) for piece, at in own)
    if any(piece.probe for piece in marked):
        return marked
    frames, last = placements[0], len(robot.joints)
    tip = (se3.inverse(frames[last]) @ frames[-1])[:3, 3]
    length, radius = float(np.linalg.norm(tip)), PROBE_RADIUS * LAST_LINK_RADIUS * robot.reach
    inside = max(length - radius, radius)
    along = tip / length if length > 0.0 else np.array([0.0, 0.0, 1.0])  # the tool is at the flange
    pose = se3.pose(turned_to(along), 0.5 * inside * along)
    return (*marked, Piece(robot.dof, last, pose, Collider(coal.Capsule(radius, inside)), probe=True))
