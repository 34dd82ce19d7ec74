"""A sheet of a drawing as entities of ezdxf: a part 1:1 in millimetres, with dimensions, table and title.

DXF, PDF and SVG are of the same entities, the latter two by ezdxf's drawing add-on on matplotlib.

Gaps and heights of text are millimetres on paper, for a sheet that is printed reduced by its scale.
"""

import io
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch

from workbench.base.errors import MissingExtraError
from workbench.report.figures import svg

SCALES = (1.0, 2.0, 5.0, 10.0, 20.0)
"""Reductions of ISO 5455: 1:1, 1:2, …"""
ROOM = 190.0
"""Of paper for the views of a part [mm]."""
TEXT, LINE = 2.5, 4.25
"""Height of letters, and from line to line [mm of paper]."""
LAYERS = {
    "OUTLINE": (7, "CONTINUOUS", 50),
    "HOLES": (7, "CONTINUOUS", 35),
    "HIDDEN": (8, "DASHED", 25),
    "CENTRES": (1, "CENTER", 13),
    "BLOCKS": (8, "DASHED", 18),
    "DIMENSIONS": (5, "CONTINUOUS", 18),
    "TEXT": (7, "CONTINUOUS", 18),
    "FRAME": (7, "CONTINUOUS", 35),
}
"""Colour, line type and width [0.01 mm] (ISO 128)."""

A3 = (16.54, 11.69)
"""[in]"""

Point = Sequence[float] | Float[np.ndarray, "2"]


class DrawingSheet:
    """A drawing of one part whose views span so much [mm]."""

    def __init__(self, reach: float):
        try:
            import ezdxf
        except ImportError:
            raise MissingExtraError("writing drawings", extra="cad") from None
        self.scale = next((scale for scale in SCALES if reach / scale <= ROOM), SCALES[-1])
        self.document = ezdxf.new("R2010", setup=["linetypes", "dimstyles:curved"], units=ezdxf.units.MM)
        self.document.header["$LTSCALE"] = self.scale
        for layer, (colour, kind, width) in LAYERS.items():
            self.document.layers.add(layer, color=colour, linetype=kind, lineweight=width)
        self.space = self.document.modelspace()

    def view(self, x: float, y: float) -> "View":
        return View(self, np.array([x, y]))

    def text(
        self, text: str, at: Point, *, height: float = TEXT, align: str = "left", turn: float = 0.0
    ) -> None:
        from ezdxf.enums import TextEntityAlignment

        style = {"layer": "TEXT", "style": "OpenSans", "rotation": turn}
        line = self.space.add_text(text, height=self.scale * height, dxfattribs=style)
        line.set_placement(tuple(map(float, at)), align=TextEntityAlignment[align.upper()])

    def column(
        self, x: float, y: float, title: Sequence[str], table: Sequence[Sequence[str]], notes: Iterable[str]
    ) -> None:
        """Title, table (its first row underlined) and notes, from their upper left corner; then the frame."""
        step = LINE * self.scale
        self.text(title[0], (x, y := y - 1.5 * step), height=1.5 * TEXT)
        for text in title[1:]:
            self.text(text, (x, y := y - 1.25 * step))
        y -= step
        widths = [0.72 * TEXT * self.scale * (3 + max(map(len, cells))) for cells in zip(*table, strict=True)]
        left = x + np.cumsum([0.0, *widths])
        for number, row in enumerate(table):
            y -= step
            for at, cell in zip(left, row, strict=False):
                self.text(cell, (at, y))
            if not number:
                y -= 0.2 * step
                self.space.add_line((x, y), (left[-1], y), dxfattribs={"layer": "FRAME"})
        y -= step
        for text in notes:
            self.text(text, (x, y := y - step))
        self._frame()

    def _frame(self) -> None:
        """A frame round everything."""
        from ezdxf import bbox

        box, gap = bbox.extents(self.space, fast=True), 8.0 * self.scale
        low, high = np.array(box.extmin)[:2] - gap, np.array(box.extmax)[:2] + gap
        corners = [low, (high[0], low[1]), high, (low[0], high[1])]
        self.space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "FRAME"})

    def dxf(self) -> str:
        buffer = io.StringIO()
        self.document.write(buffer)
        return buffer.getvalue()

    def dimension_style(self, style: str) -> dict[str, Any]:
        text = self.scale * TEXT
        sizes: dict[str, Any] = {
            "dimtxt": text,
            "dimasz": 0.8 * text,
            "dimexe": 0.4 * text,
            "dimexo": 0.4 * text,
        }
        sizes |= {"dimgap": 0.3 * text, "dimlfac": 1.0, "dimdec": 3, "dimzin": 8, "dimtxsty": "OpenSans"}
        return {"dimstyle": style, "override": sizes, "dxfattribs": {"layer": "DIMENSIONS"}}


class View:
    """A part's own coordinates [mm] on a sheet; `off` is a distance on paper [mm]."""

    def __init__(self, sheet: DrawingSheet, origin: Float[np.ndarray, "2"]):
        self.sheet, self.origin = sheet, origin

    def at(self, point: Point, off: Point = (0.0, 0.0)) -> Float[np.ndarray, "2"]:
        return self.origin + np.asarray(point, float) + self.sheet.scale * np.asarray(off, float)

    def line(self, points: Iterable[Point], layer: str = "OUTLINE", *, closed: bool = True) -> None:
        places = [self.at(point) for point in points]
        self.sheet.space.add_lwpolyline(places, close=closed, dxfattribs={"layer": layer})

    def circle(self, centre: Point, diameter: float, layer: str = "HOLES") -> None:
        self.sheet.space.add_circle(self.at(centre), 0.5 * diameter, dxfattribs={"layer": layer})

    def hole(self, centre: Point, diameter: float) -> None:
        """A round hole with its centre lines."""
        self.circle(centre, diameter)
        for reach in 0.8 * diameter * np.eye(2):
            self.line([centre - reach, centre + reach], "CENTRES", closed=False)

    def text(self, text: str, at: Point, off: Point = (0.0, 0.0), *, align: str = "center", large=False):
        self.sheet.text(text, self.at(at, off), height=TEXT * (1.2 if large else 1.0), align=align)

    def across(
        self, a: Point, b: Point, off: Point, turn: float, text: str = "<>", *, by: Point = (0.0, 0.0)
    ) -> None:
        """The distance of two points along a direction [°]; its line passes a point, so far off on paper."""
        base, p1, p2 = (tuple(self.at(*place)) for place in ((by, off), (a,), (b,)))
        style = self.sheet.dimension_style("EZDXF")
        self.sheet.space.add_linear_dim(base=base, p1=p1, p2=p2, angle=turn, text=text, **style).render()

    def angle(self, centre: Point, radius: float, start: float, end: float, text: str, at: Point) -> None:
        """An angle between two directions [°], anticlockwise, its text at a place of the sheet."""
        middle, s = np.deg2rad(0.5 * (start + end)), self.sheet.scale
        on_arc = self.at(centre) + radius * np.array([np.cos(middle), np.sin(middle)])
        wide = 0.65 * TEXT * len(text) * s
        foot = (float(np.clip(on_arc[0], at[0], at[0] + wide)), float(at[1]) - s)
        self.sheet.space.add_line(on_arc, foot, dxfattribs={"layer": "DIMENSIONS"})
        self.sheet.space.add_angular_dim_cra(
            center=self.at(centre),
            radius=radius,
            start_angle=start,
            end_angle=end,
            distance=0.0,
            location=(float(at[0]) + 0.5 * wide, float(at[1]) + 0.5 * TEXT * s),
            text=text,
            text_rotation=0.0,
            **self.sheet.dimension_style("EZ_CURVED"),
        ).render()


def pdf_of(sheets: Iterable[DrawingSheet]) -> bytes:
    """A page for each sheet, fitted to A3."""
    buffer = io.BytesIO()
    with PdfPages(buffer, metadata={"CreationDate": None}) as book:
        for sheet in sheets:
            book.savefig(figure_of(sheet), facecolor="white")
    return buffer.getvalue()


def svg_of(sheet: DrawingSheet, name: str) -> str:
    return svg(figure_of(sheet), name)


def figure_of(sheet: DrawingSheet) -> Figure:
    """The page as a figure of matplotlib."""
    from ezdxf.addons.drawing import Frontend, RenderContext
    from ezdxf.addons.drawing.config import BackgroundPolicy, Configuration
    from ezdxf.addons.drawing.matplotlib import MatplotlibBackend
    from ezdxf.npshapes import to_matplotlib_path

    class Backend(MatplotlibBackend):
        def draw_filled_paths(self, paths, properties) -> None:
            """Glyphs as their font winds them: to detect holes anew fills half of every Ø; the frame bounds
            them all, so that no patch is measured."""
            outline = to_matplotlib_path(paths)
            self.ax.add_artist(PathPatch(outline, color=properties.color, linewidth=0.0))

    figure = Figure(figsize=A3)
    backend = Backend(figure.add_axes((0.02, 0.02, 0.96, 0.96)), adjust_figure=False)
    paper = Configuration(background_policy=BackgroundPolicy.WHITE)
    Frontend(RenderContext(sheet.document), backend, config=paper).draw_layout(sheet.space)
    return figure
