"""Masses carried by the moving joints: a link behind a fixed joint belongs to the body it is bolted to.

Files that have one body per moving joint (URDF frames, `elementary` tables) need this form; links before
the first moving joint are carried by the base and drop out.
"""

import numpy as np

from workbench.arm import chain as chains
from workbench.arm.chain import Chain
from workbench.arm.robot import JointKind, Robot
from workbench.base import se3
from workbench.base.types import Vector3


def carried(robot: Robot) -> tuple[tuple[float | None, Vector3], ...]:
    """Mass [kg] and centre [m] of the body after each moving joint, in the frame right after what it drives.

    The mass is None where that of the moving link itself is unknown.
    """
    driven = [i for i, e in enumerate(robot.elements) if e.joint is not None]
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
    return tuple(
        (None, np.zeros(3)) if number in unknown else _together(links) for number, links in enumerate(bodies)
    )


def _together(links: list[tuple[float, Vector3]]) -> tuple[float, Vector3]:
    """Sum of masses, and their common centre."""
    if len(links) == 1:
        return links[0]
    total = sum(mass for mass, _ in links)
    moment = sum((mass * centre for mass, centre in links), np.zeros(3))
    return total, moment / total if total > 0 else np.zeros(3)
