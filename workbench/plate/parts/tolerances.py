"""Tolerances of the drawings, from what the plate's making is allowed to be off by.

A target may be off by ±a along each axis and ±b about each (`plate.making`). What adds up shares the bound:

| error of the target       | made of                                                    | each          |
|---------------------------|------------------------------------------------------------|---------------|
| x, y                      | place of the foot's holes in the plate, of the seat in the block | ±a/2     |
| z                         | height of the block                                        | ±a            |
| tilt                      | mitre of the block                                         | ±b            |
| turn about the normal     | line of the dowels in the plate, index pin in the block    | ±b/2          |

A position tolerance is a cylinder: ±t along each of two axes is drawn as one of diameter 2t, which it holds.
The line of two dowels at the distance 2r turns by b/2 when one moves across it by r b against the other.
"""

from dataclasses import dataclass

import numpy as np

from workbench.plate.making import Making

USUAL = Making(position=5e-5, angle=float(np.deg2rad(0.05)))
"""What a jig borer or a good machining centre keeps, where the plate's file says nothing."""
GENERAL = "ISO 2768-mK"
"""General tolerances of everything else."""


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """What stands on the drawings; lengths in metres, angles in radians.

    Args:
        dowels: Distance of each dowel from the screw.
        assumed: Whether the bounds are the usual ones, as the plate's file says nothing.
    """

    making: Making
    dowels: float
    assumed: bool = False

    @property
    def height(self) -> float:
        """± of a block's height at its centre."""
        return self.making.position

    @property
    def place(self) -> float:
        """± of a hole in the plate, and of a seat in its block, along each axis."""
        return 0.5 * self.making.position

    @property
    def mitre(self) -> float:
        """± of a block's mitre."""
        return self.making.angle

    @property
    def turn(self) -> float:
        """± of the index pin's direction, and of the line of two dowels."""
        return 0.5 * self.making.angle

    @property
    def pair(self) -> float:
        """Diameter of the cylinder in which one dowel hole lies, seen from the other."""
        return 2.0 * self.dowels * self.turn

    @property
    def note(self) -> str:
        """What they come from, for people."""
        bounds = f"±{1e3 * self.making.position:.3g} mm, ±{np.rad2deg(self.making.angle):.3g}°"
        source = (
            "usual ones, as the plate's file states none" if self.assumed else "as the plate's file states"
        )
        return f"each seat within {bounds} ({source})"


def tolerances_of(making: Making, dowels: float) -> Tolerances:
    """The tolerances of a plate's drawings: its own, or usual ones where it states none."""
    assumed = not (making.position or making.angle)
    return Tolerances(making=USUAL if assumed else making, dowels=dowels, assumed=assumed)
