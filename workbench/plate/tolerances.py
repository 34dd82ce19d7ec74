"""Making: how exactly a plate's targets are made, and how much play the probe has in them.

Holes are drilled and blocks are milled to tolerance: a hole may lie off by ±a in each coordinate and a block
may lean or turn by ±b, evenly within these bounds, so with standard deviations a/√3 and b/√3. A block turns
about its foot, which moves a face at height h: two of the three turns move it by h each, so that per axis

    σ_p² = a²/3 + (2/3) h² b²/3,      σ_r² = b²/3.

This belongs to the target, not to its visits: measuring it again does not help, a measuring machine does.

A pin in its bore has clearance: the probe may shift by ±c along two axes of the face and turn by ±t about its
normal, t = (c + c_i)/r with the index pin's c_i at the distance r. Again per axis, averaged over the three,

    σ_p² = (2/3) c²/3,      σ_r² = (1/3) t²/3.

Limits of H7 and g6: ISO 286-2:2010, tables 6 and 23.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from jaxtyping import Float

from workbench.base.arguments import LengthAndAngle, Reads, admit

SEAT_PIN, INDEX_PIN, INDEX_OFFSET = 0.006, 0.003, 0.015
"""Diameters of the probe's pins in a seat's centre and in its index hole, and their distance [m]."""
SEAT_CLEARANCE, INDEX_CLEARANCE = 12e-6 + 12e-6, 10e-6 + 8e-6
"""Maximum clearance of the two: largest H7 hole above nominal and smallest g6 pin below it [m]."""
PIN_PLAY = (0.5 * SEAT_CLEARANCE, (0.5 * SEAT_CLEARANCE + 0.5 * INDEX_CLEARANCE) / INDEX_OFFSET)
"""Maximum shift [m] and turn [rad] of the probe in a seat."""
PLAYS = {"pins": PIN_PLAY, "none": (0.0, 0.0)}
Play = Annotated[
    LengthAndAngle,
    Reads("", lambda value, given: PLAYS.get(value, value) if isinstance(value, str) else value),
]


@dataclass(frozen=True, kw_only=True)
class Production:
    """Tolerances of production.

    Args:
        tolerance: Maximum error of a hole's place along each axis [m], and of a block's angle about each
            axis [rad].
        play: Maximum shift [m] and turn [rad] of the probe in a seat; `pins` have that of the drawing.
    """

    tolerance: LengthAndAngle = (0.0, 0.0)
    play: Play = (0.0, 0.0)

    def __post_init__(self):
        admit(self)

    def sigma(self, heights: Float[np.ndarray, " rows"]) -> Float[np.ndarray, "rows 2"]:
        """Standard deviations of targets at such heights above the plate: position [m], rotation [rad]."""
        place, turn = np.array(self.tolerance) / np.sqrt(3.0)
        there = np.sqrt(place**2 + 2.0 / 3.0 * (heights * turn) ** 2)
        return np.column_stack([there, np.full(len(heights), turn)])

    @property
    def play_sigma(self) -> Float[np.ndarray, "2"]:
        """Standard deviations of the probe in a seat, from its play: position [m], rotation [rad]."""
        shift, turn = self.play
        return np.array([np.sqrt(2.0) * shift / 3.0, turn / 3.0])

    @property
    def text(self) -> tuple[str, str]:
        """For people: what was assumed of the making, and of the play in the seats."""
        made = f"within {_bounds(*self.tolerance)}" if any(self.tolerance) else "exactly"
        played = f"seat play {_bounds(*self.play)}" if any(self.play) else "no play in the seats"
        return f"targets made {made}", played


def _bounds(length: float, angle: float) -> str:
    return f"±{1e3 * length:.3g} mm, ±{np.rad2deg(angle):.2g}°"


EXACT = Production()
"""No tolerances."""
USUAL = Production(tolerance=(5e-5, float(np.deg2rad(0.05))))
"""Tolerances of a jig borer or a good machining centre, if the plate's file states none."""
