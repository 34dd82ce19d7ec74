"""An arm as capsules along its links, for arms that come without meshes.

Every link is a row of capsules between the corner points of its polyline (`arm.kinematics.skeleton`), as
thick as drawn in the app; the end of the last link is the slender probe, which alone may touch the visited
block.

Neighbouring links touch by design. Of two links with a path of length L between them, each is checked only
beyond t = max(0, 3/2 (r₁ + r₂) − L/2) from its end of that path: two neighbours may fold up to about 40°.
"""

from dataclasses import replace
from itertools import combinations, pairwise
from typing import NamedTuple

import coal
import numpy as np

from workbench.arm.kinematics.forward import link_frames
from workbench.arm.kinematics.skeleton import body_frames, link_paths
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.plate.optimiser.shapes import ArmShape, Collider, Piece, turned_to

FIRST_LINK_RADIUS = 0.035
"""Radius of the first link, as a share of the arm's reach."""
LAST_LINK_RADIUS = 0.021
"""Radius of the last link, as a share of the arm's reach."""
PROBE_LENGTH = 4.0
"""Length of the probe in radii of the last link; it is at most half that link."""
PROBE_RADIUS = 0.3
"""Radius of the probe in radii of the last link."""
NEIGHBOUR_DISTANCE = 1.5
"""Neighbouring links are checked beyond this multiple of the sum of their radii."""


class Capsule(NamedTuple):
    """All points within a radius of a line, fixed to a body and frame as a `Piece` is.

    Args:
        start: End nearer to the base, in that frame [m].
        end: The other end.
        radius: [m].
    """

    body: int
    frame: int
    start: np.ndarray
    end: np.ndarray
    radius: float

    @property
    def length(self) -> float:
        return float(np.linalg.norm(self.end - self.start))

    def part(self, first: float, last: float) -> "Capsule":
        """From one to the other distance from its start [m]."""
        along = (self.end - self.start) / self.length
        return self._replace(start=self.start + first * along, end=self.start + last * along)

    @property
    def piece(self) -> Piece:
        along = turned_to((self.end - self.start) / self.length)
        solid = Collider(coal.Capsule(float(self.radius), self.length))
        return Piece(self.body, self.frame, se3.pose(along, 0.5 * (self.start + self.end)), solid)


def capsule_arm(robot: Robot) -> ArmShape:
    """Capsules along the links of an arm."""
    radii = robot.reach * np.linspace(FIRST_LINK_RADIUS, LAST_LINK_RADIUS, max(robot.dof, 2))
    frames = [0, *(np.searchsorted(robot.chain_ends, robot.chain.driven) + 1)]
    q = np.zeros((1, robot.dof))
    own = se3.inverse(robot.base.pose) @ link_frames(robot, Motion(q))[0, frames]
    paths = zip(frames, se3.inverse(own) @ body_frames(robot, q)[0], link_paths(robot), strict=True)
    *links, last = [
        Capsule(body, int(frame), start, end, float(radii[max(body - 1, 0)]))
        for body, (frame, into, points) in enumerate(paths)
        for start, end in pairwise(se3.apply(into, points))
    ]
    capsules = [*links, *_with_probe(last)]
    *pieces, probe = [capsule.piece for capsule in capsules]
    source = "clearance is computed for capsules along the arm's links"
    return ArmShape(robot, (*pieces, replace(probe, probe=True)), _kept_apart(capsules), source)


def _with_probe(last: Capsule) -> tuple[Capsule, Capsule]:
    """The last part of the arm, and the probe at its end."""
    slender = min(0.5 * last.length, PROBE_LENGTH * last.radius)
    stop, radius = last.length - slender, PROBE_RADIUS * last.radius
    probe = last.part(stop, last.length - radius)._replace(radius=radius)
    return last.part(0.0, stop - min(last.radius, 0.5 * stop)), probe


def _kept_apart(capsules: list[Capsule]) -> tuple[tuple[Piece, Piece], ...]:
    """The parts of links that must not touch."""
    along = np.cumsum([0.0, *(c.length for c in capsules)])
    found = []
    for (i, first), (j, second) in combinations(enumerate(capsules), 2):
        trim = max(0.0, NEIGHBOUR_DISTANCE * (first.radius + second.radius) - 0.5 * (along[j] - along[i + 1]))
        if first.body != second.body and trim < min(first.length, second.length):
            found.append((first.part(0.0, first.length - trim).piece, second.part(trim, second.length).piece))
    return tuple(found)
