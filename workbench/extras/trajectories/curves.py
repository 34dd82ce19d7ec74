"""Curves for a tool, and their timing: circles, straight lines, a smooth start and stop.

    circle      c + r (cos φ a + sin φ b),      φ = 0 … 2π
    line        p + s (p′ − p),                 s = 0 … 1
    share done  10 τ³ − 15 τ⁴ + 6 τ⁵,           τ = t / T

The share has zero speed and acceleration at both ends (minimum jerk: Flash and Hogan, J. Neurosci. 5(7),
1985); at half time it is 15/8 of the mean speed. Libraries for trajectory timing (ruckig, toppra) find the
fastest motion within joint limits, which is a different task.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.base.circles import fit_circle
from workbench.base.errors import OptionError
from workbench.base.types import Positions, Vector3, frozen

FLAT = 1e-3
"""Ratio of the second to the first principal spread below which points are collinear."""
MIN_LENGTH = 1e-6
"""Minimum length of a curve [m]."""

Shares = Float[np.ndarray, " rows"]


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Circle:
    """A full turn about a centre [m].

    Args:
        along: Unit vector from the centre to the start.
        across: Unit vector from the centre to the point after a quarter turn.
    """

    centre: Vector3
    along: Vector3
    across: Vector3
    radius: float

    @property
    def normal(self) -> Vector3:
        """Axis of its positive rotation."""
        return np.cross(self.along, self.across)

    def points(self, shares: Shares) -> Positions:
        angle = 2.0 * np.pi * shares[:, None]
        return self.centre + self.radius * (np.cos(angle) * self.along + np.sin(angle) * self.across)


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class StraightLine:
    """A straight line from start to end [m]."""

    start: Vector3
    end: Vector3

    @property
    def along(self) -> Vector3:
        return (self.end - self.start) / float(np.linalg.norm(self.end - self.start))

    def points(self, shares: Shares) -> Positions:
        return self.start + shares[:, None] * (self.end - self.start)


Curve = Circle | StraightLine
"""A curve for a tool: unit tangent at its start or along it, points."""


def circle_through(points: Float[np.ndarray, "points 3"]) -> Circle:
    """The circle that best fits three points or more: it starts at the first, towards the second."""
    if len(points) < 3:
        text = f"a circle needs at least 3 points, got {len(points)}"
        raise OptionError(text, option="points", found=len(points))
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if spread[0] < MIN_LENGTH or spread[1] < FLAT * spread[0]:
        text = "the points of the circle are collinear or coincide; give three that are not"
        raise OptionError(text, option="points")
    fitted = fit_circle(points)
    (first, second), normal = points[:2] - fitted.centre, fitted.axes[2]
    normal = normal * np.where(np.cross(first, second) @ normal < 0.0, -1.0, 1.0)
    along = first - (first @ normal) * normal
    along = frozen(along / np.linalg.norm(along))
    across = frozen(np.cross(normal, along))
    return Circle(centre=fitted.centre, along=along, across=across, radius=fitted.radius)


def line(start: Vector3, end: Vector3) -> StraightLine:
    """The straight line between two points [m]."""
    if np.linalg.norm(end - start) < MIN_LENGTH:
        raise OptionError("the two ends of the line are the same point; give different ones", option="end")
    return StraightLine(start=frozen(np.array(start, float)), end=frozen(np.array(end, float)))


def smooth_shares(time: Shares) -> Shares:
    """Share of the length done at every time, from rest to rest (module docstring)."""
    t = (time - time[0]) / (time[-1] - time[0])
    return t**3 * (10.0 - 15.0 * t + 6.0 * t**2)
