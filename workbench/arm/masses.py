"""Masses carried by the moving joints: a link after a fixed joint belongs to the body it is bolted to.

Formats with one body per moving joint (URDF frames, `elementary` tables) need this form; links before the
first moving joint belong to the base and are omitted.

If a file lacks a few masses, they are interpolated from neighbouring links with a standard deviation of 100
%: unknowns of a fit with a wide prior, rather than a reason to treat all masses as unknown.
"""

from dataclasses import replace

import numpy as np

from workbench.arm import chain as chains
from workbench.arm.chain import Chain
from workbench.arm.robot import Joint, JointKind, Robot
from workbench.base import se3
from workbench.base.types import Matrix4, Vector3, frozen


def carried(robot: Robot) -> tuple[tuple[float | None, Vector3], ...]:
    """Mass [kg] and centre [m] of the body after each element of `moved`, in the frame right after it.

    The mass is None where that of the moving link itself is unknown.
    """
    driven = moved(robot)
    bodies: list[list[tuple[float, Vector3]]] = [[] for _ in driven]
    unknown = set()
    for joint, end in zip(robot.joints, robot.link_ends, strict=True):
        number = sum(i <= end for i in driven) - 1
        if number < 0:
            continue
        if joint.mass is None:
            unknown |= {number} if joint.kind is not JointKind.FIXED else set()
            continue
        part = robot.elements[driven[number] + 1 : end + 1]
        frame = chains.poses(Chain(part, 0), np.zeros((1, 0)))[0] if part else np.eye(4)
        bodies[number].append((joint.mass, se3.apply(frame, joint.com)))
    return tuple((None, np.zeros(3)) if k in unknown else together(links) for k, links in enumerate(bodies))


def moved(robot: Robot) -> list[int]:
    """Elements of the arm driven by joints or following them: each has its own body."""
    return [i for i, e in enumerate(robot.elements) if e.joint is not None or e.follows is not None]


def together(links: list[tuple[float, Vector3]]) -> tuple[float, Vector3]:
    """Sum of masses, and their common centre."""
    if len(links) == 1:
        return links[0]
    total = sum(mass for mass, _ in links)
    moment = sum((mass * centre for mass, centre in links), np.zeros(3))
    return total, moment / total if total > 0 else np.zeros(3)


MASS_SIGMA = 1.0
"""Relative standard deviation of an assumed mass."""
MIN_LENGTH = 0.05
"""Standard deviation of an assumed centre of mass: half its link's length, at least half of this [m]."""


def with_assumed_masses(robot: Robot, *, otherwise: float | None = None) -> Robot:
    """The robot with assumed masses for links that lack one.

    Args:
        otherwise: Mass of every link if less than half of the moving ones have one [kg]; None: no assumption.
    """
    known = [k for k, j in enumerate(robot.moving) if j.mass]
    if robot.has_masses:
        return robot
    logs = np.log([robot.moving[k].mass or 1.0 for k in known])
    if 2 * len(known) < robot.dof:
        if otherwise is None:
            return robot
        known, logs = [0], np.log([otherwise])
    entries = [i for i, j in enumerate(robot.joints) if j.kind is not JointKind.FIXED]
    joints = list(robot.joints)
    for k, entry in enumerate(entries):
        if joints[entry].mass is None:
            joints[entry] = _assumed(robot, k, entry, float(np.exp(np.interp(k, known, logs))))
    return replace(robot, joints=tuple(joints))


def _assumed(robot: Robot, moving: int, entry: int, mass: float) -> Joint:
    """A link with an assumed mass half-way between its two joints (or its joint and the tool)."""
    elements = robot.elements
    driven = [i for i, e in enumerate(elements) if e.joint is not None]
    last = driven[moving + 1] - 1 if moving + 1 < len(driven) else len(elements) - 1
    places = np.array([driven[moving], robot.link_ends[entry], last])
    start, own, end = chains.frames(Chain(elements, robot.dof), np.zeros((1, robot.dof)), places)[0]
    tip = end[:3, 3] if moving + 1 < len(driven) else end[:3] @ [*robot.tool.xyz, 1.0]
    centre = se3.apply(se3.inverse(own), 0.5 * (start[:3, 3] + tip))
    length = max(float(np.linalg.norm(tip - start[:3, 3])), MIN_LENGTH)
    return replace(
        robot.joints[entry],
        mass=mass,
        com=frozen(centre),
        mass_tolerance=MASS_SIGMA,
        com_tolerance=0.5 * length,
    )


DENSITY = 2700.0
"""Density of aluminium [kg/m³]."""


def sphere_inertia(mass: float) -> float:
    """Moment of inertia of a solid sphere [kg m²]: for formats that don't take a mass without one.

    I = 2/5 m r²,      m = 4/3 π ρ r³
    """
    return 0.4 * mass * (0.75 * mass / (np.pi * DENSITY)) ** (2.0 / 3.0)


Body = tuple[float, Vector3]
"""Mass [kg], and centre [m]."""


def side_branches(model, chain: list, notes: list[str]) -> dict[str, list[Body]]:
    """Bodies in side branches, by the link of the chain that carries them, with all their joints at 0."""
    children: dict[str, list] = {}
    for joint in model.robot.joints:
        children.setdefault(joint.parent, []).append(joint)
    own = {j.name for j in chain}

    def behind(link: str, pose: Matrix4) -> list[Body]:
        bodies = []
        for joint in children.get(link, []):
            if joint.name not in own:
                there = pose if joint.origin is None else pose @ joint.origin
                inertial = model.link_map[joint.child].inertial if joint.child in model.link_map else None
                if inertial is not None and inertial.mass:
                    centre = np.zeros(3) if inertial.origin is None else inertial.origin[:3, 3]
                    bodies.append((float(inertial.mass), se3.apply(there, np.array(centre, float))))
                bodies += behind(joint.child, there)
        return bodies

    found = {j.child: bodies for j in chain if (bodies := behind(j.child, np.eye(4)))}
    for link, bodies in found.items():
        weight = sum(mass for mass, _ in bodies)
        notes.append(f"link '{link}' carries {weight:.3g} kg in side branches, assumed with joints at 0")
    return found


def with_bodies(joint: Joint, bodies: list[Body]) -> Joint:
    """A joint's link combined with its side branches."""
    if not bodies:
        return joint
    mass, com = together([*([] if joint.mass is None else [(joint.mass, joint.com)]), *bodies])
    return replace(joint, mass=mass, com=frozen(com))
