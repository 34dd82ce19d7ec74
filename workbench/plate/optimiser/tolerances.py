"""Making: how well the places of targets are known when holes are drilled and blocks are milled to tolerance.

A hole may lie off by ±a in each coordinate and a block may lean or turn by ±b, evenly within these bounds, so
with standard deviations a/√3 and b/√3. A block turns about its foot, which moves a face at height h: two of
the three turns move it by h each, so that per axis

    σ_p² = a²/3 + (2/3) h² b²/3,      σ_r² = b²/3.

This belongs to the target, not to its visits: measuring it again does not help, a measuring machine does.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.base.errors import OptionError


@dataclass(frozen=True, kw_only=True)
class Making:
    """Tolerances of the making.

    Args:
        position: Greatest error of a hole's place along each axis [m].
        angle: Greatest error of a block's angle about each axis [rad].

    Raises:
        OptionError: a negative tolerance.
    """

    position: float = 0.0
    angle: float = 0.0

    def __post_init__(self):
        if self.position < 0.0 or self.angle < 0.0:
            raise OptionError(
                f"a making tolerance of ±{1e3 * self.position:g} mm, ±{np.rad2deg(self.angle):g}° can't be "
                "negative; give 0 for a plate that is taken as true"
            )

    def sigma(self, heights: Float[np.ndarray, " rows"]) -> Float[np.ndarray, "rows 2"]:
        """Standard deviations of targets at such heights above the plate: position [m], rotation [rad]."""
        place, turn = self.position / np.sqrt(3.0), self.angle / np.sqrt(3.0)
        return np.column_stack(
            [np.sqrt(place**2 + 2.0 / 3.0 * (heights * turn) ** 2), np.full(len(heights), turn)]
        )
