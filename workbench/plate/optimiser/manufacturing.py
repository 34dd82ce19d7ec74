"""Manufacturing methods for plates: accuracy, and what to measure afterwards.

| name       | what it is                                                              | targets within     |
|------------|-------------------------------------------------------------------------|--------------------|
| machined   | mitred blocks on a drilled plate, dowels and pins (ARIA Fig. 6)         | ±0.05 mm, ±0.05°   |
| printed    | 3D-printed cones with a magnet, for a steel ball on the tool            | ±0.25 mm, ±0.3°    |
| ball-bar   | three balls on posts, a telescoping bar to a ball on the tool           | anchors ±0.05 mm   |
| breadboard | posts and angle plates on an optical breadboard, M6 holes 25 mm apart   | ±0.30 mm, ±0.3°    |

A printed or bolted target is stable but displaced: once measured it is as accurate as the measuring machine,
so the tolerance applies to plates used without measuring. Filament printers keep 0.1 to 0.3 mm on 100 mm; an
M6 screw in its 6.6 mm hole allows ±0.3 mm.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from workbench.plate.optimiser.target_blocks import Blocks
from workbench.plate.tolerances import EXACT, Production

IN_THE_AIR = (0.05, 0.35)
"""Heights above the plate of targets without blocks [m]."""
DEGREE = float(np.deg2rad(1.0))


@dataclass(frozen=True, kw_only=True)
class ManufacturingMethod:
    """A manufacturing method.

    Args:
        production: Its tolerances; the play of seats is added if there are pins.
        reading: Reading at a target.
        afterwards: What to measure after assembly.
        grid: Pitch of the holes [m]; 0 for none.
        levels: Available heights [m]; any if empty.
        tilts: Available angles [rad]; any if empty.
        turn: Directions are multiples of this [rad]; any if 0.
        heights: Of targets above the plate [m]; as requested if None.
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
        """The available blocks among the requested ones."""
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
"""All methods by name; an external table is `{**METHODS, "mine": ManufacturingMethod(…)}`."""
