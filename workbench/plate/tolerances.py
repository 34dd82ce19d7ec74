"""Making: how exactly a plate's targets are made, and how much play the probe has in them.

Holes are drilled and blocks are milled to tolerance: a hole may lie off by ±a in each coordinate and a block
may lean or turn by ±b, evenly within these bounds, so with standard deviations a/√3 and b/√3. A block turns
about its foot, which moves a face at height h: two of the three turns move it by h each, so that per axis

    σ_p² = a²/3 + (2/3) h² b²/3,      σ_r² = b²/3.

This belongs to the target, not to its visits: measuring it again does not help, a measuring machine does.

A pin in its bore has clearance: the probe may shift by ±c along two axes of the face and turn by ±t about its
normal, t = (c + c_i)/r with the index pin's c_i at the distance r. Again per axis, averaged over the three,

    σ_p² = (2/3) c²/3,      σ_r² = (1/3) t²/3.

Limits of H7 and g6: ISO 286-2:2010, tables 6 and 23 (nominal sizes up to 18 mm).

Tolerances of the drawings share these bounds where errors add up:

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
from jaxtyping import Float

from workbench.base.arguments import admit
from workbench.base.errors import OptionError

LIMITS = ((3e-3, 10e-6, -8e-6), (6e-3, 12e-6, -12e-6), (10e-3, 15e-6, -14e-6), (18e-3, 18e-6, -17e-6))
"""Up to which diameter [m], the largest H7 hole above it and the smallest g6 pin below it [m]."""


def max_clearance(diameter: float) -> float:
    """Maximum clearance of a g6 pin in an H7 hole [m]."""
    for up_to, hole, pin in LIMITS:
        if 0.0 < diameter <= up_to + 1e-9:
            return hole - pin
    raise OptionError(
        f"a pin's diameter must be above 0 and at most {1e3 * LIMITS[-1][0]:g} mm, got {1e3 * diameter:g} mm",
        option="diameter",
        found=diameter,
    )


def pin_play(seat: float, index: float, offset: float) -> tuple[float, float]:
    """Maximum shift [m] and turn [rad] of a probe on two g6 pins in H7 holes.

    Args:
        seat: Diameter of the pin at the face's centre [m].
        index: Diameter of the index pin [m].
        offset: Distance of the two [m].
    """
    shift, other = 0.5 * max_clearance(seat), 0.5 * max_clearance(index)
    return shift, (shift + other) / offset


@dataclass(frozen=True, kw_only=True)
class Production:
    """Tolerances of production.

    Args:
        position: Maximum error of a hole's place along each axis [m].
        angle: Maximum error of a block's angle about each axis [rad].
        play: Maximum shift [m] and turn [rad] of the probe in a seat.
    """

    position: float = 0.0
    angle: float = 0.0
    play: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self):
        admit(self)
        if self.position < 0.0 or self.angle < 0.0:
            raise OptionError(
                f"tolerances can't be negative, got ±{1e3 * self.position:g} mm, "
                f"±{np.rad2deg(self.angle):g}°",
                option="position" if self.position < 0.0 else "angle",
            )
        if min(self.play) < 0.0:
            raise OptionError(
                f"the play of the probe can't be negative, got ±{1e3 * self.play[0]:g} mm, "
                f"±{np.rad2deg(self.play[1]):g}°"
            )

    def sigma(self, heights: Float[np.ndarray, " rows"]) -> Float[np.ndarray, "rows 2"]:
        """Standard deviations of targets at such heights above the plate: position [m], rotation [rad]."""
        place, turn = self.position / np.sqrt(3.0), self.angle / np.sqrt(3.0)
        return np.column_stack(
            [np.sqrt(place**2 + 2.0 / 3.0 * (heights * turn) ** 2), np.full(len(heights), turn)]
        )

    @property
    def play_sigma(self) -> Float[np.ndarray, "2"]:
        """Standard deviations of the probe in a seat, from its play: position [m], rotation [rad]."""
        shift, turn = self.play
        return np.array([np.sqrt(2.0) * shift / 3.0, turn / 3.0])

    @property
    def text(self) -> tuple[str, str]:
        """For people: what was assumed of the making, and of the play in the seats."""
        made = "targets made exactly"
        if self.position or self.angle:
            made = f"targets made within {_bounds(self.position, self.angle)}"
        return made, f"seat play {_bounds(*self.play)}" if any(self.play) else "no play in the seats"


def _bounds(length: float, angle: float) -> str:
    return f"±{1e3 * length:.3g} mm, ±{np.rad2deg(angle):.2g}°"


EXACT = Production()
"""No tolerances."""


USUAL = Production(position=5e-5, angle=float(np.deg2rad(0.05)))
"""Tolerances of a jig borer or a good machining centre, if the plate's file states none."""
GENERAL = "ISO 2768-mK"
"""General tolerances for everything else."""


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """What stands on the drawings; lengths in metres, angles in radians.

    Args:
        dowels: Distance of each dowel from the screw.
        assumed: Whether the bounds are the usual ones, as the plate's file says nothing.
    """

    production: Production
    dowels: float
    assumed: bool = False

    @property
    def height(self) -> float:
        return self.production.position

    @property
    def place(self) -> float:
        """± of a hole in the plate, and of a seat in its block, along each axis."""
        return 0.5 * self.production.position

    @property
    def mitre(self) -> float:
        return self.production.angle

    @property
    def turn(self) -> float:
        return 0.5 * self.production.angle

    @property
    def pair(self) -> float:
        """Diameter of the cylinder in which one dowel hole lies, seen from the other."""
        return 2.0 * self.dowels * self.turn

    @property
    def note(self) -> str:
        """What they come from, for people."""
        bounds = f"±{1e3 * self.production.position:.3g} mm, ±{np.rad2deg(self.production.angle):.3g}°"
        source = (
            "typical ones, as none are stated for this plate" if self.assumed else "as stated for this plate"
        )
        return f"each seat within {bounds} ({source})"


def tolerances_of(production: Production, dowels: float) -> Tolerances:
    """The tolerances of a plate's drawings: its own, or usual ones where it states none."""
    assumed = not (production.position or production.angle)
    return Tolerances(production=USUAL if assumed else production, dowels=dowels, assumed=assumed)
