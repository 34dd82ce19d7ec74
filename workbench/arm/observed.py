"""What the rows of a calibration showed of the tool: asked by everything that applies the calibration.

One reflector shows where a point is and nothing of how the tool is turned: constants that only turn the tool
then fit anything. Where a direction was not measured, or the rows leave it more uncertain than arms are made,
the nominal arm knows it better (`usable.py`).
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

MAX_POSITION, MAX_ROTATION = 2e-3, float(np.deg2rad(0.3))
"""Standard errors of the tool from which on a nominal arm is as good [m], [rad]."""
POSES = 120
"""Measured joint positions that a calibration keeps."""


class Expected(NamedTuple):
    """Expected error of a model at some poses.

    Args:
        position: Root mean square of the position's [m].
        rotation: Of the orientation's [rad].
    """

    position: float
    rotation: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Observed:
    """What the rows showed.

    Args:
        position: How many directions of the tool's position they show, 0 to 3.
        rotation: How many of its orientation.
        tool: How uncertain the constants leave the tool.
        flange: How uncertain they leave the flange.
        q: Some of the measured joint positions, the extremes of every joint among them [rad or m].
    """

    position: int
    rotation: int
    tool: Expected
    flange: Expected
    q: Float[np.ndarray, "poses n"]

    @property
    def sees_position(self) -> bool:
        """Whether positions of the tool are better known than the nominal arm has them."""
        return self.position == 3 and self.tool.position < MAX_POSITION

    @property
    def sees_rotation(self) -> bool:
        return self.rotation == 3 and self.tool.rotation < MAX_ROTATION

    @property
    def missing(self) -> str:
        """What is not known, and why, in words; empty if nothing is missing."""
        pairs = (
            ("positions", self.sees_position, self.position, f"{1e3 * self.tool.position:.2g} mm"),
            ("orientations", self.sees_rotation, self.rotation, f"{np.rad2deg(self.tool.rotation):.2g}°"),
        )
        return " and ".join(
            f"{name} were not measured" if seen < 3 else f"{name} are uncertain by {size}"
            for name, known, seen, size in pairs
            if not known
        )

    def table(self) -> dict[str, Any]:
        """As the robot's file has it; joint positions to 1e-4."""
        return {
            "position": self.position,
            "rotation": self.rotation,
            "tool": list(self.tool),
            "flange": list(self.flange),
            "q": [[round(v, 4) for v in row] for row in self.q.tolist()],
        }


def some_of(q: Float[np.ndarray, "rows n"], maximum: int = POSES) -> np.ndarray:
    """Rows that stand for all of them: those with the extremes of each joint, the others evenly spread."""
    ends = np.concatenate([q.argmin(0), q.argmax(0)])
    even = np.linspace(0, len(q) - 1, min(len(q), maximum)).round().astype(int)
    return np.unique(np.concatenate([ends, even]))
