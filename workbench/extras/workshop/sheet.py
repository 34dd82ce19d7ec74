"""A page about a plate: its drawing, table of blocks and expected accuracy, as HTML."""

from dataclasses import dataclass, field

import numpy as np
from markupsafe import Markup

from workbench.base.wording import capital
from workbench.extras.workshop.csv_lists import MM
from workbench.extras.workshop.drawing import svg_of
from workbench.extras.workshop.drawing_set import drawings_of
from workbench.extras.workshop.parts import Fixture
from workbench.plate.plate_score import PlateScore
from workbench.plate.target_readings import assumptions
from workbench.report.html import page_template
from workbench.report.numbers import short

HEADINGS = ("block", "x", "y", "height", "tilt", "turn", "branch")
UNITS = ("", "", "mm", "mm", "mm", "°", "°", "")
LISTED = 40
"""Maximum number of blocks in the table; the rest is in the list of blocks."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PlateSheet:
    """Everything on the page.

    Args:
        score: What a calibration on the plate is worth as it is drawn; None if no robot was named.
        as_stated: The same as the plate's file and the page have it; None where that is no other.
        towards: Orientations about which those lie for which errors are predicted.
        notes: What else must be known.
    """

    fixture: Fixture
    score: PlateScore | None = None
    as_stated: PlateScore | None = None
    towards: str = "the targets'"
    notes: tuple[str, ...] = field(default=())

    @property
    def facts(self) -> tuple[str, ...]:
        size = " × ".join(f"{MM * edge:.1f}" for edge in self.fixture.slab.size)
        shapes = ", ".join(
            f"{len(s.numbers)} × {s.letter} ({np.rad2deg(s.block.tilt):.3f}°)" for s in self.fixture.shapes
        )
        return (
            f"Plate {size} mm, {len(self.fixture.slab.bores)} through holes; positions from the lower left "
            "corner of its top face.",
            f"Blocks of square bar {MM * self.fixture.blocks[0].side:.0f} mm, mitred: {shapes}. Every shape "
            "has its own drawing.",
            f"Drawn for {self.fixture.tolerances.note}; {self.production}",
        )

    @property
    def production(self) -> str:
        """What the shapes of the blocks mean for their price."""
        shapes, blocks = len(self.fixture.shapes), len(self.fixture.blocks)
        if shapes <= max(3, blocks // 3):
            return f"{shapes} shape{'s' * (shapes > 1)} for {blocks} blocks."
        return (
            f"{shapes} different shapes for {blocks} blocks: plate optimise --shapes 3 finds a plate that is "
            "cheaper to make and says what that costs in accuracy."
        )

    @property
    def expected(self) -> tuple[str, ...]:
        """The accuracy to expect; nothing if no robot was named."""
        if self.score is None:
            return ()
        measured = self.score.measured
        error = measured.error
        turns = (
            f" and {short(np.rad2deg(error.rotation_rms))}°"
            if np.isfinite(error.rotation_rms)
            else " (its orientation stays open)"
        )
        first = (
            f"{self.score.robot.name}, each target measured once: in the region, in any branch, with "
            f"orientations within 60° of {self.towards}, the calibrated arm is expected to miss by "
            f"{short(MM * error.position_rms)} mm{turns} rms (position {short(MM * error.position_mean)} mm "
            f"on average). This includes: {assumptions(self.score.plate, self.score.sigma)}; effects that "
            "the model lacks come on top."
        )
        if self.score.left_out:
            first += f" {capital(self.score.left_out)}."
        second = (
            f"The targets determine {measured.rank} of {measured.visible} combinations of constants that "
            f"measurements can show; observability index O {measured.indices['O']:.3g} (ARIA eq. 17)."
        )
        return first, *(f"{capital(text)}." for text in self.difference), second

    @property
    def difference(self) -> tuple[str, ...]:
        """What the drawings' tolerances cost against the plate as its file states it."""
        if self.score is None or self.as_stated is None:
            return ()
        drawn, stated = (MM * s.measured.error.position_rms for s in (self.score, self.as_stated))
        return (
            f"made as drawn ({self.score.plate.assumptions}), the plate is expected to leave "
            f"{short(drawn)} mm rms; by its file alone ({self.as_stated.plate.assumptions}), "
            f"{short(stated)} mm rms",
        )

    def rows(self) -> list[tuple[str, ...]]:
        lines = []
        for i, block in enumerate(self.fixture.blocks[:LISTED]):
            places = self.fixture.from_corner(block.pose[:3, 3])
            angles = np.rad2deg([block.tilt, block.azimuth]) + 0.0
            numbers = (
                *(f"{v:z.3f}" for v in places),
                f"{MM * block.height:.3f}",
                *(f"{a:z.3f}" for a in angles),
            )
            branch = self.score.measured.branches[i] if self.score and self.branched else ""
            lines.append((f"{block.number}", self.fixture.letter(block.number), *numbers, branch))
        return lines

    @property
    def branched(self) -> bool:
        """Whether the table says in which branch each block is met; the anchors of a ball-bar are not."""
        return self.score is not None and not self.fixture.anchored

    @property
    def headings(self) -> tuple[str, ...]:
        """Of the table's columns."""
        first = "anchor" if self.fixture.anchored else "target"
        return (first, *HEADINGS[: 7 if self.branched else 6])

    @property
    def unlisted(self) -> int:
        return max(len(self.fixture.blocks) - LISTED, 0)

    def html(self) -> str:
        heads = [
            f"{name} [{unit}]" if unit else name for name, unit in zip(self.headings, UNITS, strict=False)
        ]
        return page_template("plate_sheet.html", package="workbench.extras.workshop").render(
            sheet=self,
            headings=heads,
            rows=[row[: len(heads)] for row in self.rows()],
            picture=Markup(svg_of(drawings_of(self.fixture)["plate"], "plate")),
        )
