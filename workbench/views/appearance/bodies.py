"""Bodies for an arm without meshes, generated from its chain and therefore independent of the convention.

The link after joint k is drawn along the path that the chain takes from that joint's axis to the next one;
a cylinder marks each axis. All parts of a link move with the frame right after the joint's own element.
They lie within the capsules that are checked for clearance: what seems to touch is refused.
"""

import itertools
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Float

from workbench.arm import chain as chains
from workbench.arm.kinematics import skeleton
from workbench.arm.kinematics.forward import link_frames
from workbench.arm.motion import Motion
from workbench.arm.robot import JointKind, Robot
from workbench.base import se3
from workbench.plate.optimiser.capsules import FIRST_LINK_RADIUS, LAST_LINK_RADIUS, PROBE_LENGTH, PROBE_RADIUS
from workbench.views.appearance.colours import JOINT, LINK, PROBE
from workbench.views.appearance.shapes import Solid, along, ball, cylinder, merged, tube

SLIM = 0.73
"""Radius of a drawn link in radii of its capsule, whose round end holds the housing of a joint with it."""


@dataclass(frozen=True, eq=False)
class Part:
    """A solid of one colour."""

    solid: Solid
    colour: tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class Body:
    """A body that moves with one frame: the base, or the link after a joint."""

    parts: tuple[Part, ...]

    @cached_property
    def solid(self) -> Solid | None:
        """All parts as one; None where there is nothing to see."""
        return merged([p.solid for p in self.parts]) if self.parts else None


@lru_cache(maxsize=16)
def make_bodies(
    robot: Robot, *, swell: float = 1.0, is_plain: bool = False, has_foot: bool = True
) -> tuple[Body, ...]:
    """The base's body, empty without a foot, and one per joint, each in its own frame of `body_frames`.

    Those of the robot's file; generated ones, thicker by `swell`, where it has none or all is to be plain.
    """
    if not is_plain and (given := file_bodies(robot)):
        return given if has_foot else (Body(()), *given[1:])
    drivers = robot.chain.driven
    order = np.argsort(drivers)
    paths = skeleton.link_paths(robot)
    radii = swell * robot.reach * np.linspace(FIRST_LINK_RADIUS, LAST_LINK_RADIUS, max(len(order), 2))
    bodies: list[Body | None] = [None] * len(order)
    for i, k in enumerate(order):
        axis, wide = np.eye(3)[robot.chain.elements[drivers[k]].axis % 3], SLIM * float(radii[i])
        housing = cylinder(1.16 * wide, -wide if i else 0.0, wide, bevel=0.3 * wide)  # not into the ground
        housing = housing.moved(along(axis, np.zeros(3)))
        bodies[k] = _link(paths[k + 1], float(radii[i]), housing, last=i == len(order) - 1)
    foot = _foot(robot, paths[0], float(radii[0])) if has_foot else Body(())
    return (foot, *(b for b in bodies if b is not None))


def file_bodies(robot: Robot) -> tuple[Body, ...]:
    """Bodies as the robot's URDF shows them, in the frames of `body_frames`; none without meshes."""
    if robot.urdf is None:
        return ()
    from workbench.arm.meshes import link_meshes

    still = np.zeros(robot.dof)
    links = link_frames(robot, Motion(still[None]))[0]
    into = se3.inverse(robot.base.pose @ body_frames(robot, still))
    moving = np.cumsum([0, *(joint.kind is not JointKind.FIXED for joint in robot.joints)])
    parts: list[list[Part]] = [[] for _ in range(robot.dof + 1)]
    for piece in link_meshes(robot):
        body = int(moving[piece.entry])
        solid = Solid(piece.vertices, piece.faces).moved(into[body] @ links[piece.entry])
        parts[body].append(Part(solid, piece.colour))
    return tuple(Body(tuple(p)) for p in parts) if any(parts) else ()


def body_frames(
    robot: Robot, q: Float[np.ndarray, " n"], *, shift: Float[np.ndarray, "_ _"] = chains.NO_SHIFT
) -> Float[np.ndarray, "bodies 4 4"]:
    """Where each body stands at joint positions [rad or m], in the frame of the robot's base.

    `shift` is added to the elements of the chain, one row [rad or m]; nothing if empty.
    """
    return skeleton.body_frames(robot, q[None], shift=shift)[0]


def _link(path: Float[np.ndarray, "points 3"], radius: float, housing: Solid, *, last: bool) -> Body:
    """A tube along the path, a housing about the axis, and the probe at the end of the last link.

    All lie in capsules of that radius. Balls round the bends off; housings hide the other ends but the last.
    """
    probe: list[Solid] = []
    if last and len(path) > 1:
        stop, probe = _probe(path[-2], path[-1], radius)
        path = np.array([*path[:-1], stop])
    shell = [tube(start, end, SLIM * radius) for start, end in itertools.pairwise(path)]
    shell += [ball(SLIM * radius, bend) for bend in (path[1:] if last else path[1:-1])]
    parts = [Part(housing, JOINT)]
    if shell:
        parts.append(Part(merged(shell), LINK))
    if probe:
        parts.append(Part(merged(probe), PROBE))
    return Body(tuple(parts))


def _probe(start: np.ndarray, end: np.ndarray, radius: float) -> tuple[np.ndarray, list[Solid]]:
    """Where the last tube stops, and a slender probe from there to the tool's origin."""
    length = float(np.linalg.norm(end - start))
    if length < radius:
        return end, []
    direction = (end - start) / length
    link = length - min(0.5 * length, PROBE_LENGTH * radius)
    stop = start + direction * (link - min(radius, 0.5 * link))
    neck, slender = stop + direction * 0.55 * radius, PROBE_RADIUS * radius
    tip = end - direction * 2.0 * slender
    flange = cylinder(0.58 * radius, 0.0, 0.25 * radius, bevel=0.05 * radius)
    solids = [
        flange.moved(along(direction, neck)),
        tube(neck, tip, slender),
        tube(tip, end, slender, 0.02 * radius),
    ]
    return stop, solids


def _foot(robot: Robot, path: Float[np.ndarray, "points 3"], radius: float) -> Body:
    """A foot on the floor, a stand up to the arm's first frame, and a post where its first axis lies away."""
    height = skeleton.height_above_floor(robot)
    parts = [Part(cylinder(2.0 * radius, -height, 0.45 * radius - height, bevel=0.12 * radius), JOINT)]
    if height > 0.0:
        parts.append(Part(cylinder(1.1 * radius, -height, 0.0), LINK))
    post = [tube(a, b, radius) for a, b in itertools.pairwise(path)]
    if post:
        parts.append(Part(merged([*post, *(ball(radius, p) for p in path[1:])]), LINK))
    return Body(tuple(parts))
