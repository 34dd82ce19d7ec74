"""One page about a plate: picture, block shapes, table of blocks, expected accuracy; as HTML and as PDF."""

import io
from dataclasses import dataclass, field
from textwrap import wrap

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from workbench.plate.parts.lists import from_corner
from workbench.plate.parts.parts import Fixture
from workbench.plate.parts.picture import MOST_SHAPES, draw_fixture, draw_shape
from workbench.plate.score import PlateScore
from workbench.report.drawing import INK, look, new_figure, svg
from workbench.report.html import page_template
from workbench.report.numbers import short

HEADINGS = ("target", "block", "x", "y", "height", "tilt", "turn", "branch")
UNITS = ("", "", "mm", "mm", "mm", "°", "°", "")
LISTED = 40
"""Greatest number of blocks in the table; the rest is in the list of blocks."""
MM = 1e3
A4 = (8.27, 11.69)


@dataclass(frozen=True, eq=False, kw_only=True)
class PlateSheet:
    """Everything on the page.

    Args:
        fixture: The parts.
        files: Names of the files that lie beside the sheet.
        score: What a calibration on the plate is worth; None if no robot was named.
        notes: What else must be known.
    """

    fixture: Fixture
    files: tuple[str, ...] = ()
    score: PlateScore | None = None
    notes: tuple[str, ...] = field(default=())

    @property
    def facts(self) -> tuple[str, ...]:
        """Size and number of parts, in words."""
        size = " × ".join(f"{MM * edge:.1f}" for edge in self.fixture.slab.size)
        shapes = ", ".join(
            f"{len(s.numbers)} × {s.letter} ({np.rad2deg(s.block.tilt):.3f}°)" for s in self.fixture.shapes
        )
        return (
            f"Plate {size} mm, {len(self.fixture.slab.bores)} through holes; positions from the lower left "
            "corner of its top face.",
            f"Blocks of square bar {MM * self.fixture.blocks[0].side:.0f} mm, mitred: {shapes}.",
        )

    @property
    def expected(self) -> tuple[str, ...]:
        """The accuracy to expect, in words; nothing if no robot was named."""
        if self.score is None:
            return ()
        measured, (position, rotation) = self.score.measured, self.score.sigma
        error = measured.error
        first = (
            f"{self.score.robot.name}, each target measured once with standard deviations of "
            f"{MM * position:.3g} mm and {np.rad2deg(rotation):.2g}°: in the region, in any branch, with "
            "orientations within 60° of the targets', the calibrated arm is expected to miss by "
            f"{short(MM * error.position_mean)} mm and {short(np.rad2deg(error.rotation_mean))}° on average; "
            "effects that the model lacks come on top."
        )
        second = (
            f"The targets determine {measured.rank} of {measured.visible} combinations of constants that "
            f"measurements can show; observability index O {measured.indices['O']:.3g} (ARIA eq. 17)."
        )
        return first, second

    def rows(self) -> list[tuple[str, ...]]:
        """One line a block, as in `HEADINGS`."""
        lines = []
        for i, block in enumerate(self.fixture.blocks[:LISTED]):
            places = from_corner(self.fixture, block.pose[:3, 3])
            angles = np.rad2deg([block.tilt, block.azimuth]) + 0.0
            numbers = (
                *(f"{v:.3f}" for v in places),
                f"{MM * block.height:.3f}",
                *(f"{a:.3f}" for a in angles),
            )
            branch = "" if self.score is None else self.score.measured.branches[i]
            lines.append((f"{block.number}", self.fixture.letter(block.number), *numbers, branch))
        return lines

    @property
    def unlisted(self) -> int:
        """How many blocks the table leaves out."""
        return max(len(self.fixture.blocks) - LISTED, 0)

    def html(self) -> str:
        """The page as HTML that needs nothing else."""
        heads = [f"{name} [{unit}]" if unit else name for name, unit in zip(HEADINGS, UNITS, strict=True)]
        return page_template("plate_sheet.html").render(
            sheet=self,
            headings=heads[: 7 + (self.score is not None)],
            picture=Markup(svg(self._picture(), "plate")),
            shapes=Markup(svg(self._shapes(), "shapes")),
        )

    def pdf(self) -> bytes:
        """The page as PDF, A4."""
        with look():
            page = Figure(figsize=A4, layout=ConstrainedLayoutEngine(rect=(0.07, 0.05, 0.86, 0.90)))
            parts = np.asarray(page.subfigures(4, 1, height_ratios=[1.2, 5.0, 2.0, 3.6]))
            self._words(parts[0])
            draw_fixture(parts[1].subplots(), self.fixture)
            self._draw_shapes(parts[2])
            self._table(parts[3])
            buffer = io.BytesIO()
            page.savefig(buffer, format="pdf", facecolor="white", metadata={"CreationDate": None})
        return buffer.getvalue()

    def _picture(self) -> Figure:
        with look():
            figure = new_figure(8.0, 4.7)
            draw_fixture(figure.subplots(), self.fixture)
        return figure

    def _shapes(self) -> Figure:
        with look():
            figure = new_figure(8.0, 1.8)
            self._draw_shapes(figure)
        return figure

    def _draw_shapes(self, figure) -> None:
        shapes = self.fixture.shapes[:MOST_SHAPES]
        for axes, shape in zip(figure.subplots(1, len(shapes), squeeze=False)[0], shapes, strict=True):
            draw_shape(axes, shape)

    def _words(self, figure) -> None:
        axes = figure.subplots()
        axes.axis("off")
        axes.text(0.0, 1.0, self.fixture.name, fontsize=16, fontweight="bold", va="top")
        sentences = [*self.facts, *self.expected, *self.notes]
        axes.text(0.0, 0.68, "\n".join(_wrapped(sentences, 130)), fontsize=7.5, va="top", linespacing=1.4)

    def _table(self, figure) -> None:
        axes = figure.subplots()
        axes.axis("off")
        columns = 7 + (self.score is not None)
        heads = [f"{n}\n[{u}]" if u else n for n, u in zip(HEADINGS, UNITS, strict=True)][:columns]
        lines = [row[:columns] for row in self.rows()]
        step, widths = (
            1.0 / (max(len(lines), 8) + 2.2),
            np.array([0, 0.07, 0.14, 0.24, 0.34, 0.44, 0.54, 0.64]),
        )
        size = float(np.clip(110.0 * step, 4.0, 7.5))
        for i, line in enumerate([heads, *lines]):
            for x, cell in zip(widths, line, strict=False):
                weight = "bold" if i == 0 else "normal"
                axes.text(x, 1.0 - step * (i + (i > 0)), cell, fontsize=size, fontweight=weight, va="top")
        axes.axhline(1.0 - 1.8 * step, color=INK, linewidth=0.5)


def _wrapped(sentences: list[str], width: int) -> list[str]:
    return [line for sentence in sentences for line in wrap(sentence, width)]
