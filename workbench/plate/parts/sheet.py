"""One page about a plate: picture, block shapes, table of blocks, expected accuracy; as HTML and as PDF.

The picture is a parallel projection. Blocks are convex and stand apart, so that drawing them from back to
front, and of each only the faces towards the viewer, hides what has to be hidden.
"""

import io
from dataclasses import dataclass, field
from textwrap import wrap
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Polygon

from workbench.base import se3
from workbench.base.wording import capital
from workbench.plate.parts.parts import Block, BlockShape, Bore, Fixture
from workbench.plate.plate import SQUARE
from workbench.plate.readings import assumptions
from workbench.plate.score import PlateScore
from workbench.report.figures import COLOURS, INK, look, new_figure, svg
from workbench.report.html import page_template
from workbench.report.numbers import short

MM = 1e3
TURN = np.deg2rad(-62.0)
"""Direction of the viewer about the plate's normal, from its x axis [rad]."""
RISE = np.deg2rad(38.0)
"""Direction of the viewer above the plate [rad]."""
TOWARDS = np.array([np.cos(TURN) * np.cos(RISE), np.sin(TURN) * np.cos(RISE), np.sin(RISE)])
ACROSS = np.array([-np.sin(TURN), np.cos(TURN), 0.0])
UPWARDS = np.cross(TOWARDS, ACROSS)
LIGHT = np.array([0.25, -0.45, 0.86])
METAL = np.array([0.80, 0.82, 0.85])
FACE = np.array([0.55, 0.76, 0.91])
MOST_SHAPES = 6
"""Block shapes in one row, and on the PDF sheet; each has its own page in the drawing set."""


def draw_fixture(axes: Axes, fixture: Fixture) -> None:
    """Plate, blocks and the robot's base, seen from the plate's front."""
    axes.set_aspect("equal")
    axes.axis("off")
    length, width, thickness = MM * fixture.slab.size
    slab = np.array([[x, y, z] for z in (-thickness, 0.0) for x, y in SQUARE * [length, width] / 2])
    _solid(axes, slab, top=METAL)
    for bore in fixture.slab.bores:
        if bore.label.startswith("M"):
            _ring(axes, bore, np.eye(4))
    for block in sorted(fixture.blocks, key=lambda b: float(b.pose[:3, 3] @ TOWARDS)):
        _block(axes, block)
    _robot(axes, fixture)
    axes.autoscale_view()


def draw_shape(axes: Axes, shape: BlockShape) -> None:
    """A block's side view with its height, mitre and edges."""
    block = shape.block
    half, (low, high) = 0.5 * MM * block.side, (MM * h for h in block.heights)
    outline = np.array([[-half, 0.0], [half, 0.0], [half, low], [-half, high]])
    axes.set_aspect("equal")
    axes.axis("off")
    axes.add_patch(Polygon(outline, closed=True, facecolor=tuple(METAL), edgecolor=INK, linewidth=0.8))
    for bore in block.bores:
        pen: dict[str, Any] = {"edgecolor": INK, "linewidth": 0.4, "linestyle": "--"}
        axes.add_patch(Polygon(MM * bore.outline, closed=True, fill=False, **pen))
    kinds = f"{len(shape.numbers)} × {shape.letter}, {np.rad2deg(block.tilt):.3f}°"
    axes.set_title(kinds)
    for x, height, align in ((-half, high, "right"), (half, low, "left")):
        shift = -2.0 if align == "right" else 2.0
        axes.text(x + shift, 0.5 * height, f"{height:.2f}", ha=align, va="center", rotation=90)
    axes.text(0.0, -2.5, f"{2 * half:.0f} sq.\n{MM * block.height:.2f} mid", ha="center", va="top")
    axes.set_xlim(-half - 14.0, half + 14.0)
    axes.set_ylim(-22.0, high + 3.0)


_FACES = ([4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7])


def _on_paper(points: np.ndarray) -> np.ndarray:
    """Points in the plate's frame as they are seen."""
    return np.stack([points @ ACROSS, points @ UPWARDS], -1)


def _solid(axes: Axes, corners: np.ndarray, *, top: np.ndarray) -> None:
    """The faces that can be seen of a solid of four lower and four upper corners [mm]."""
    for number, face in enumerate(_FACES):
        places = corners[face]
        normal = np.cross(places[1] - places[0], places[2] - places[0])
        normal /= np.linalg.norm(normal)
        if normal @ TOWARDS <= 0.0:
            continue
        colour = (top if number == 0 else METAL) * (0.72 + 0.28 * max(float(normal @ LIGHT), 0.0))
        outline = _on_paper(places)
        axes.add_patch(Polygon(outline, closed=True, facecolor=tuple(colour), edgecolor=INK, linewidth=0.5))


def _block(axes: Axes, block: Block) -> None:
    half, (low, high) = 0.5 * MM * block.side, (MM * h for h in block.heights)
    below = np.column_stack([half * SQUARE, np.zeros(4)])
    above = np.column_stack([half * SQUARE, np.where(SQUARE[:, 0] > 0.0, low, high)])
    pose = block.pose.copy()
    pose[:3, 3] *= MM
    _solid(axes, se3.apply(pose, np.concatenate([below, above])), top=FACE)
    facing = (pose[:3, :3] @ [np.sin(block.tilt), 0.0, np.cos(block.tilt)]) @ TOWARDS > 0.0
    for bore in block.bores:
        if facing and bore.direction[2] < 0.0:
            _ring(axes, bore, pose)
    seen = _on_paper(se3.apply(pose, above))
    x, y = seen[np.argmax(seen[:, 1])]
    axes.annotate(f"{block.number}", (x, y), ha="center", va="bottom", fontweight="bold",
                  xytext=(0, 2), textcoords="offset points")  # fmt: skip


def _ring(axes: Axes, bore: Bore, pose: np.ndarray) -> None:
    """A bore's mouth."""
    angles = np.linspace(0.0, 2.0 * np.pi, 25)
    one = np.cross(bore.direction, [0.0, 1.0, 0.0])
    one /= np.linalg.norm(one)
    two = np.cross(bore.direction, one)
    around = np.cos(angles)[:, None] * one + np.sin(angles)[:, None] * two
    circle = _on_paper(se3.apply(pose, MM * (bore.mouth + 0.5 * bore.diameter * around)))
    axes.fill(*circle.T, facecolor=INK, alpha=0.75, linewidth=0.0)


def _robot(axes: Axes, fixture: Fixture) -> None:
    """The axes of the robot's base."""
    pose = se3.inverse(fixture.pose)
    origin, arm = MM * pose[:3, 3], 0.12 * MM * float(max(fixture.slab.size))
    for axis, name in enumerate("xyz"):
        line = _on_paper(np.stack([origin, origin + arm * pose[:3, axis]]))
        axes.plot(*line.T, color=COLOURS[1], linewidth=1.4)
        tip = (line[1, 0], line[1, 1])
        axes.annotate(name, tip, color=COLOURS[1], ha="center", va="center", fontsize=7, xytext=(4, 4),
                      textcoords="offset points")  # fmt: skip
    foot = _on_paper(origin)
    axes.annotate("robot base", (foot[0], foot[1]), color=COLOURS[1], ha="center", va="top", fontsize=7,
                  xytext=(0, -5), textcoords="offset points")  # fmt: skip


HEADINGS = ("block", "x", "y", "height", "tilt", "turn", "branch")
UNITS = ("", "", "mm", "mm", "mm", "°", "°", "")
LISTED = 40
"""Greatest number of blocks in the table; the rest is in the list of blocks."""
A4 = (8.27, 11.69)


@dataclass(frozen=True, eq=False, kw_only=True)
class PlateSheet:
    """Everything on the page.

    Args:
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
        drawn = (
            "" if len(self.fixture.shapes) <= MOST_SHAPES else f" The PDF sheet shows {MOST_SHAPES} of them."
        )
        return (
            f"Plate {size} mm, {len(self.fixture.slab.bores)} through holes; positions from the lower left "
            "corner of its top face.",
            f"Blocks of square bar {MM * self.fixture.blocks[0].side:.0f} mm, mitred: {shapes}. Every shape "
            f"has its own page in drawings.pdf.{drawn}",
            f"Drawn for {self.fixture.tolerances.note}; {self.making}",
        )

    @property
    def making(self) -> str:
        """What the shapes of the blocks mean for their price, in words."""
        shapes, blocks = len(self.fixture.shapes), len(self.fixture.blocks)
        if shapes <= max(3, blocks // 3):
            return f"{shapes} shape{'s' * (shapes > 1)} for {blocks} blocks."
        return (
            f"{shapes} different shapes for {blocks} blocks: plate optimise --shapes 3 finds a plate that is "
            "cheaper to make and says what that costs in accuracy."
        )

    @property
    def expected(self) -> tuple[str, ...]:
        """The accuracy to expect, in words; nothing if no robot was named."""
        if self.score is None:
            return ()
        measured = self.score.measured
        error = measured.error
        turns = (
            f" and {short(np.rad2deg(error.rotation_mean))}°"
            if np.isfinite(error.rotation_mean)
            else " (its orientation stays open)"
        )
        first = (
            f"{self.score.robot.name}, each target measured once: in the region, in any branch, with "
            "orientations within 60° of the targets', the calibrated arm is expected to miss by "
            f"{short(MM * error.position_mean)} mm{turns} on average. "
            f"This includes: {assumptions(self.score.plate, self.score.sigma)}; effects that the model lacks "
            "come on top."
        )
        if self.score.left_out:
            first += f" {capital(self.score.left_out)}."
        second = (
            f"The targets determine {measured.rank} of {measured.visible} combinations of constants that "
            f"measurements can show; observability index O {measured.indices['O']:.3g} (ARIA eq. 17)."
        )
        return first, second

    def rows(self) -> list[tuple[str, ...]]:
        """One line a block, as in `HEADINGS`."""
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
        """How many blocks the table leaves out."""
        return max(len(self.fixture.blocks) - LISTED, 0)

    def html(self) -> str:
        """The page as HTML that needs nothing else."""
        heads = [
            f"{name} [{unit}]" if unit else name for name, unit in zip(self.headings, UNITS, strict=False)
        ]
        return page_template("plate_sheet.html").render(
            sheet=self,
            headings=heads,
            rows=[row[: len(heads)] for row in self.rows()],
            picture=Markup(svg(self._picture(), "plate")),
            shapes=Markup(svg(self._shapes(), "shapes")),
        )

    def pdf(self) -> bytes:
        """The page as PDF, A4."""
        with look():
            page = Figure(figsize=A4, layout=ConstrainedLayoutEngine(rect=(0.07, 0.05, 0.86, 0.90)))
            parts = np.asarray(page.subfigures(4, 1, height_ratios=[2.2, 4.4, 1.9, 3.3]))
            self._words(parts[0])
            draw_fixture(parts[1].subplots(), self.fixture)
            self._draw_shapes(parts[2], self.fixture.shapes[:MOST_SHAPES])
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
            rows = -(-len(self.fixture.shapes) // MOST_SHAPES)
            figure = new_figure(8.0, 1.8 * rows)
            self._draw_shapes(figure, self.fixture.shapes)
        return figure

    def _draw_shapes(self, figure, shapes) -> None:
        across = min(len(shapes), MOST_SHAPES)
        places = figure.subplots(-(-len(shapes) // across), across, squeeze=False).ravel()
        for axes in places[len(shapes) :]:
            axes.axis("off")
        for axes, shape in zip(places, shapes, strict=False):
            draw_shape(axes, shape)

    def _words(self, figure) -> None:
        axes = figure.subplots()
        axes.axis("off")
        axes.text(0.0, 1.0, self.fixture.name, fontsize=16, fontweight="bold", va="top")
        sentences = [*self.facts, *self.expected, *self.notes]
        words = "\n".join(line for sentence in sentences for line in wrap(sentence, 130))
        axes.text(0.0, 0.85, words, fontsize=7.0, va="top", linespacing=1.35, in_layout=False)

    def _table(self, figure) -> None:
        axes = figure.subplots()
        axes.axis("off")
        heads = [f"{n}\n[{u}]" if u else n for n, u in zip(self.headings, UNITS, strict=False)]
        lines = [row[: len(heads)] for row in self.rows()]
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
