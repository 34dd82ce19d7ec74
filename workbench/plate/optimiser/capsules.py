"""An arm as capsules along its links, for arms that come without meshes.

Every link is a row of capsules between the corner points of its polyline (`arm.kinematics.skeleton`), as
thick as drawn in the app; the end of the last link is the slender probe, which alone may touch the visited
block. Distances of their lines from hulls and from each other are compiled (`segments`); penetration depth is
computed by coal, one pair at a time.

Neighbouring links touch by design. Of two links with a path of length L between them, each is checked only
beyond t = max(0, 3/2 (r₁ + r₂) − L/2) from its end of that path: two neighbours may fold up to about 40°.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple, final

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm.kinematics.skeleton import body_frames, link_paths
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.plate.optimiser.segments import segment_distances
from workbench.plate.optimiser.shapes import (
    MAX_MEASURED_DISTANCE,
    AbstractArmShape,
    Hull,
    Placements,
    line_distances,
    turned_to,
)

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
    """All points within a radius of a line that moves with a body.

    Args:
        body: 0 for the base, k for the link after joint k.
        start: End nearer to the base, in the body's frame [m].
        end: The other end.
        radius: [m].
        probe: Whether it may touch the visited block.
    """

    body: int
    start: np.ndarray
    end: np.ndarray
    radius: float
    probe: bool = False


class CapsulePairs(NamedTuple):
    """Pairs of capsules to be kept apart, each from its own start to its own end [shares of its line]."""

    pairs: Int[np.ndarray, "pairs 2"]
    first: Float[np.ndarray, "pairs 2"]
    second: Float[np.ndarray, "pairs 2"]


@final
@dataclass(frozen=True, eq=False)
class CapsuleArm(AbstractArmShape):
    """An arm's capsules.

    Args:
        capsules: In order from base to tool.
        source: What they are, as a sentence.
    """

    robot: Robot
    capsules: tuple[Capsule, ...]
    source: str = "clearance is computed for capsules along the arm's links"

    @cached_property
    def radii(self) -> Float[np.ndarray, " capsules"]:
        """Radius of each capsule [m]."""
        return np.array([c.radius for c in self.capsules])

    @cached_property
    def bodies(self) -> Int[np.ndarray, " capsules"]:
        return np.array([c.body for c in self.capsules])

    @cached_property
    def probes(self) -> Bool[np.ndarray, " capsules"]:
        return np.array([c.probe for c in self.capsules])

    def placements(self, q: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "rows capsules 2 3"]:
        """Ends of every capsule's line in the robot's base [m]."""
        frames = body_frames(self.robot, q)[:, self.bodies]
        ends = np.array([(c.start, c.end) for c in self.capsules])
        return se3.apply(frames[:, :, None], ends)

    @cached_property
    def checked(self) -> CapsulePairs:
        """Pairs of links that must not touch."""
        lengths = np.array([np.linalg.norm(c.end - c.start) for c in self.capsules])
        along = np.concatenate([[0.0], np.cumsum(lengths)])
        pairs, first, second = [], [], []
        for i in range(len(self.capsules)):
            for j in range(i + 1, len(self.capsules)):
                if self.bodies[i] == self.bodies[j]:
                    continue
                between = along[j] - along[i + 1]
                trim = max(0.0, NEIGHBOUR_DISTANCE * (self.radii[i] + self.radii[j]) - 0.5 * between)
                if trim < min(lengths[i], lengths[j]):
                    pairs.append((i, j))
                    first.append((0.0, 1.0 - trim / lengths[i]))
                    second.append((trim / lengths[j], 1.0))
        shape = (len(pairs), 2)
        return CapsulePairs(
            np.array(pairs, np.int64).reshape(shape),
            np.array(first).reshape(shape),
            np.array(second).reshape(shape),
        )

    def lowest(self, placements: Float[np.ndarray, "rows capsules 2 3"]) -> np.ndarray:
        return placements[..., 2].min(-1) - self.radii

    def own_distances(
        self, placements: Placements, *, far: float = MAX_MEASURED_DISTANCE, minimum: float | None = None
    ) -> Float[np.ndarray, " rows"]:
        checked = self.checked
        if not len(checked.pairs):
            return np.full(len(placements), far)
        one, other = placements[:, checked.pairs[:, 0]], placements[:, checked.pairs[:, 1]]
        gaps = segment_distances(_part(one, checked.first), _part(other, checked.second))
        return np.minimum((gaps - self.radii[checked.pairs].sum(1)).min(1), far)

    def hull_distances(
        self,
        placements: Placements,
        hulls: Sequence[Hull],
        *,
        checked: Bool[np.ndarray, " pieces"],
        far: float = MAX_MEASURED_DISTANCE,
        minimum: float | None = None,
    ) -> Float[np.ndarray, " rows"]:
        gaps = line_distances(placements, hulls, far + self.radii) - self.radii
        gaps[:, ~checked] = far
        for row, capsule in zip(*np.nonzero(np.isneginf(gaps)), strict=True):
            hull = hulls[row if len(hulls) > 1 else 0]
            gaps[row, capsule] = capsule_to_hull(placements[row, capsule], self.radii[capsule], hull)
        return np.minimum(gaps.min(1, initial=far), far)


def _part(lines: np.ndarray, shares: np.ndarray) -> np.ndarray:
    start, along = lines[:, :, :1], lines[:, :, 1:] - lines[:, :, :1]
    return start + shares[None, :, :, None] * along


def capsule_arm(robot: Robot) -> CapsuleArm:
    """Capsules along the links of an arm."""
    radii = robot.reach * np.linspace(FIRST_LINK_RADIUS, LAST_LINK_RADIUS, max(robot.dof, 2))
    capsules: list[Capsule] = []
    for body, points in enumerate(link_paths(robot)):
        radius = float(radii[max(body - 1, 0)])
        for start, end in pairwise(points):
            capsules.append(Capsule(body, start, end, radius))
    return CapsuleArm(robot, (*capsules[:-1], *_with_probe(capsules[-1])))


def _with_probe(last: Capsule) -> tuple[Capsule, ...]:
    """The last part of the arm, and the probe at its end."""
    along = last.end - last.start
    length = float(np.linalg.norm(along))
    slender = min(0.5 * length, PROBE_LENGTH * last.radius)
    stop = last.end - along * (slender / length)
    radius = PROBE_RADIUS * last.radius
    tip = last.end - along * (radius / length)
    return (
        last._replace(end=stop - along * (min(last.radius, 0.5 * (length - slender)) / length)),
        Capsule(last.body, stop, tip, radius, probe=True),
    )


def capsule_to_hull(line: Float[np.ndarray, "2 3"], radius: float, hull: Hull) -> float:
    """Distance of a capsule from a hull; negative penetration depth inside [m]."""
    import coal

    along = line[1] - line[0]
    length = float(np.linalg.norm(along))
    pose, still = coal.Transform3s(), coal.Transform3s()
    if length > 1e-9:
        pose.setRotation(turned_to(along / length))
    pose.setTranslation(0.5 * (line[0] + line[1]))
    capsule = coal.Capsule(float(radius), length)
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    return float(coal.distance(capsule, pose, hull.shape, still, request, result))
