"""Manufacturing methods for plates: accuracy, and what to measure afterwards.

| name       | what it is                                                              | targets within     |
|------------|-------------------------------------------------------------------------|--------------------|
| machined   | mitred blocks on a drilled plate, dowels and pins (ARIA Fig. 6)         | ±0.05 mm, ±0.05°   |
| printed    | 3D-printed cones with a magnet, for a steel ball on the tool            | ±0.25 mm, ±0.3°    |
| ball-bar   | three balls on posts, a telescoping bar to a ball on the tool           | anchors ±0.05 mm   |
| breadboard | posts and angle plates on an optical breadboard, M6 holes 25 mm apart   | ±0.30 mm, ±0.3°    |

A printed or bolted target is where it is, only not where it was drawn: measured once it is as good as the
machine that measures it, so that the tolerance stands for plates that are used as they are. Printers of
filament keep 0.1 to 0.3 mm on 100 mm; an M6 screw in its hole of 6.6 mm leaves ±0.3 mm.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from workbench.plate.optimiser.target_blocks import Blocks
from workbench.plate.tolerances import EXACT, Production

IN_THE_AIR = (0.05, 0.35)
"""Heights above the plate of targets that need no block [m]."""
DEGREE = float(np.deg2rad(1.0))


@dataclass(frozen=True, kw_only=True)
class ManufacturingMethod:
    """A manufacturing method.

    Args:
        production: How exact it is; the play of seats comes on top where there are pins.
        reading: What is read at a target.
        afterwards: What to measure when it stands.
        grid: Distance of the holes [m]; 0 for none.
        levels: Heights that can be bought [m]; any if empty.
        tilts: Angles that can be bought [rad]; any if empty.
        turn: Directions are multiples of this [rad]; any if 0.
        heights: Of targets above the plate [m]; as asked if None.
    """

    production: Production
    reading: str
    afterwards: str
    grid: float = 0.0
    levels: tuple[float, ...] = ()
    tilts: tuple[float, ...] = ()
    turn: float = 0.0
    heights: tuple[float, float] | None = None

    def blocks(self, blocks: Blocks) -> Blocks:
        """The blocks that can be had in this way, of those that were asked for."""
        return replace(
            blocks,
            heights=self.heights or blocks.heights,
            grid=self.grid or blocks.grid,
            levels=self.levels or blocks.levels,
            tilts=self.tilts or blocks.tilts,
            turn=self.turn or blocks.turn,
        )


METHODS: Mapping[str, ManufacturingMethod] = MappingProxyType(
    {
        "machined": ManufacturingMethod(
            production=Production(position=5e-5, angle=0.05 * DEGREE),
            reading="seat",
            afterwards="nothing, or the inspection list",
        ),
        "printed": ManufacturingMethod(
            production=Production(position=2.5e-4, angle=0.3 * DEGREE),
            reading="socket",
            afterwards="every ball's centre, to 0.05 mm or better, and again after warm days",
        ),
        "breadboard": ManufacturingMethod(
            production=Production(position=3e-4, angle=0.3 * DEGREE),
            reading="socket",
            afterwards="every ball's centre, to 0.05 mm or better, and after each change of a post",
            grid=0.025,
            levels=(0.05, 0.075, 0.1),
            tilts=(0.0, 30.0 * DEGREE, 45.0 * DEGREE),
            turn=90.0 * DEGREE,
        ),
        "ball-bar": ManufacturingMethod(
            production=EXACT,
            reading="ball-bar",
            afterwards="the three distances between the anchors, to 0.02 mm or better",
            heights=IN_THE_AIR,
        ),
    }
)
"""Every way by name; an outsider's table is `{**METHODS, "mine": ManufacturingMethod(…)}`."""
