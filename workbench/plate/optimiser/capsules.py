"""The arm as capsules: what must keep clear of plate, blocks, table and of the arm itself.

Every link is a row of capsules along its way (`arm.kinematics.skeleton`), as thick as the app draws it; the
end of the last link is the probe, slender and alone allowed to touch the block that it visits.

Neighbouring links touch by design. Of two links with a path of length L between them, each is looked at only
beyond t = max(0, 3/2 (r₁ + r₂) − L/2) from its end of that path: two neighbours may fold up to about 40°.

Distances between lines, for many rows at once.

Source: Ericson, Real-Time Collision Detection (2005), §5.1.9 (closest points of two segments).
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple, no_type_check

import numpy as np
from jaxtyping import Float, Int
from numba import njit

from workbench.arm.kinematics.skeleton import body_frames, link_ways
from workbench.arm.robot import Robot
from workbench.base import se3

THICK, THIN = 0.035, 0.021
"""Radius of the first and of the last link, as a share of the arm's reach."""
PROBE_LENGTH, PROBE_RADIUS = 4.0, 0.3
"""Length and radius of the probe in radii of the last link; it is at most half that link."""
FOLD = 1.5
"""Neighbouring links are looked at beyond so many times the sum of their radii."""
ON_THE_TABLE = 1
"""Bodies up to this one stand on the table: the base's post and the link after the first joint."""


class Capsule(NamedTuple):
    """All points within a radius of a line that moves with a body.

    Args:
        body: 0 for the base, k for the link after joint k.
        start: End nearer to the base, in the body's frame [m].
        end: The other end.
        radius: [m].
        name: For people.
        probe: Whether it may touch the block that it visits.
    """

    body: int
    start: np.ndarray
    end: np.ndarray
    radius: float
    name: str
    probe: bool = False


class Apart(NamedTuple):
    """Pairs of capsules to be kept apart, each from its own start to its own end [shares of its line]."""

    pairs: Int[np.ndarray, "pairs 2"]
    first: Float[np.ndarray, "pairs 2"]
    second: Float[np.ndarray, "pairs 2"]


@dataclass(frozen=True, eq=False)
class ArmShape:
    """An arm's capsules.

    Args:
        robot: Whose they are.
        capsules: In order from base to tool.
    """

    robot: Robot
    capsules: tuple[Capsule, ...]

    @cached_property
    def radii(self) -> Float[np.ndarray, " capsules"]:
        """Radius of each capsule [m]."""
        return np.array([c.radius for c in self.capsules])

    @cached_property
    def bodies(self) -> Int[np.ndarray, " capsules"]:
        """Body of each capsule."""
        return np.array([c.body for c in self.capsules])

    @cached_property
    def probes(self) -> np.ndarray:
        """Which capsules are the probe."""
        return np.array([c.probe for c in self.capsules])

    def lines(self, q: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "rows capsules 2 3"]:
        """Ends of every capsule's line in the robot's base [m]."""
        frames = body_frames(self.robot, q)[:, self.bodies]
        ends = np.array([(c.start, c.end) for c in self.capsules])
        return se3.apply(frames[:, :, None], ends)

    @cached_property
    def apart(self) -> Apart:
        """Pairs of links that must not touch."""
        lengths = np.array([np.linalg.norm(c.end - c.start) for c in self.capsules])
        along = np.concatenate([[0.0], np.cumsum(lengths)])
        pairs, first, second = [], [], []
        for i in range(len(self.capsules)):
            for j in range(i + 1, len(self.capsules)):
                if self.bodies[i] == self.bodies[j]:
                    continue
                between = along[j] - along[i + 1]
                trim = max(0.0, FOLD * (self.radii[i] + self.radii[j]) - 0.5 * between)
                if trim < min(lengths[i], lengths[j]):
                    pairs.append((i, j))
                    first.append((0.0, 1.0 - trim / lengths[i]))
                    second.append((trim / lengths[j], 1.0))
        shape = (len(pairs), 2)
        return Apart(
            np.array(pairs, np.int64).reshape(shape),
            np.array(first).reshape(shape),
            np.array(second).reshape(shape),
        )

    def own_distances(self, lines: Float[np.ndarray, "rows capsules 2 3"]) -> Float[np.ndarray, "rows pairs"]:
        """Distance between the links of each pair that must not touch [m]; negative where they overlap."""
        apart = self.apart
        one, other = lines[:, apart.pairs[:, 0]], lines[:, apart.pairs[:, 1]]
        gaps = segment_distances(_part(one, apart.first), _part(other, apart.second))
        return gaps - self.radii[apart.pairs].sum(1)


def _part(lines: np.ndarray, shares: np.ndarray) -> np.ndarray:
    start, way = lines[:, :, :1], lines[:, :, 1:] - lines[:, :, :1]
    return start + shares[None, :, :, None] * way


def arm_shape(robot: Robot) -> ArmShape:
    """Capsules along the links of an arm."""
    ways = link_ways(robot)
    radii = robot.reach * np.linspace(THICK, THIN, max(robot.dof, 2))
    capsules: list[Capsule] = []
    for body, way in enumerate(ways):
        radius = float(radii[max(body - 1, 0)])
        name = "the base" if body == 0 else f"link {body}"
        for start, end in pairwise(way):
            capsules.append(Capsule(body, start, end, radius, name))
    return ArmShape(robot, (*capsules[:-1], *_with_probe(capsules[-1])))


def _with_probe(last: Capsule) -> tuple[Capsule, ...]:
    """The last part of the arm, and the probe that it ends in."""
    way = last.end - last.start
    length = float(np.linalg.norm(way))
    slender = min(0.5 * length, PROBE_LENGTH * last.radius)
    stop = last.end - way * (slender / length)
    radius = PROBE_RADIUS * last.radius
    tip = last.end - way * (radius / length)
    return (
        last._replace(end=stop - way * (min(last.radius, 0.5 * (length - slender)) / length)),
        Capsule(last.body, stop, tip, radius, "the probe", probe=True),
    )


def segment_distances(
    first: Float[np.ndarray, "rows pairs 2 3"], second: Float[np.ndarray, "rows pairs 2 3"]
) -> Float[np.ndarray, "rows pairs"]:
    """Least distance of two segments, given by their ends [m]."""
    shape = first.shape[:2]
    one, other = first.reshape(-1, 2, 3), second.reshape(-1, 2, 3)
    return _distances(np.ascontiguousarray(one), np.ascontiguousarray(other)).reshape(shape)


@njit(cache=True)
@no_type_check
def _distances(first, second):
    result = np.empty(len(first))
    for k in range(len(first)):
        a = e = f = b = c = 0.0
        for i in range(3):
            d1 = first[k, 1, i] - first[k, 0, i]
            d2 = second[k, 1, i] - second[k, 0, i]
            r = first[k, 0, i] - second[k, 0, i]
            a += d1 * d1
            e += d2 * d2
            f += d2 * r
            b += d1 * d2
            c += d1 * r
        denominator = a * e - b * b
        s = 0.0
        if denominator > 1e-12 * a * e:
            s = min(max((b * f - c * e) / denominator, 0.0), 1.0)
        t = (b * s + f) / e if e > 0.0 else 0.0
        if t < 0.0 or e <= 0.0:
            t = 0.0
            s = min(max(-c / a, 0.0), 1.0) if a > 0.0 else 0.0
        elif t > 1.0:
            t = 1.0
            s = min(max((b - c) / a, 0.0), 1.0) if a > 0.0 else 0.0
        square = 0.0
        for i in range(3):
            p = first[k, 0, i] + s * (first[k, 1, i] - first[k, 0, i])
            p -= second[k, 0, i] + t * (second[k, 1, i] - second[k, 0, i])
            square += p * p
        result[k] = np.sqrt(square)
    return result
