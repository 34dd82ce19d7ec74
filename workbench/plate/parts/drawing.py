"""Drawing pages: lines, circles, words and dimensions in millimetres of paper, written as PDF and as DXF.

A page is described once; both files are made from the same items. In DXF everything is enlarged by the page's
scale, so that parts are 1:1 there and dimensions measure what they say.
"""

import io
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from workbench.base.errors import MissingExtraError
from workbench.report.figures import look

PAPERS = {"A4": (297.0, 210.0), "A3": (420.0, 297.0), "A2": (594.0, 420.0), "A1": (841.0, 594.0)}
"""Width and height of a sheet on its long side [mm]."""
SCALES = (1.0, 2.0, 5.0, 10.0, 20.0)
"""Reductions of ISO 5455 that are used: 1:1, 1:2, …"""
TEXT = 2.5
"""Height of small letters [mm]."""
POINTS = 72.0 / 25.4


class Layer(StrEnum):
    """What a line is."""

    OUTLINE = "OUTLINE"
    HOLES = "HOLES"
    HIDDEN = "HIDDEN"
    CENTRES = "CENTRES"
    BLOCKS = "BLOCKS"
    DIMENSIONS = "DIMENSIONS"
    TEXT = "TEXT"
    FRAME = "FRAME"


LOOKS: dict[Layer, tuple[int, str, float, str]] = {
    Layer.OUTLINE: (7, "CONTINUOUS", 0.5, "-"),
    Layer.HOLES: (7, "CONTINUOUS", 0.35, "-"),
    Layer.HIDDEN: (8, "DASHED", 0.25, "--"),
    Layer.CENTRES: (1, "CENTER", 0.13, "-."),
    Layer.BLOCKS: (8, "DASHED", 0.18, "--"),
    Layer.DIMENSIONS: (5, "CONTINUOUS", 0.18, "-"),
    Layer.TEXT: (7, "CONTINUOUS", 0.18, "-"),
    Layer.FRAME: (7, "CONTINUOUS", 0.35, "-"),
}
"""DXF colour and line type, width [mm], dashes of each layer (ISO 128)."""
INKS = {Layer.CENTRES: "#b03030", Layer.DIMENSIONS: "#1f4e8c", Layer.HIDDEN: "#666666"}
"""Colours on paper; black for the other layers."""

Point = Sequence[float] | Float[np.ndarray, "2"]


@dataclass(frozen=True, eq=False)
class Line:
    """A polyline.

    Args:
        points: On the paper [mm].
        layer: What it is.
        closed: Whether it ends where it begins.
    """

    points: Float[np.ndarray, "n 2"]
    layer: Layer = Layer.OUTLINE
    closed: bool = False


@dataclass(frozen=True, eq=False)
class Circle:
    """A circle: centre on the paper and radius [mm]."""

    centre: Float[np.ndarray, "2"]
    radius: float
    layer: Layer = Layer.HOLES


@dataclass(frozen=True, eq=False)
class Words:
    """A line of text: foot at a point [mm], height [mm], `left`, `center` or `right`, turned [degrees]."""

    text: str
    at: Float[np.ndarray, "2"]
    height: float = TEXT
    align: str = "left"
    turn: float = 0.0


@dataclass(frozen=True, eq=False)
class Dimension:
    """Distance of two points along a direction, with its words.

    Args:
        a: From here.
        b: To here.
        base: A point on the dimension line.
        turn: Direction that is measured [degrees].
        text: What it says; `<>` is the length measured.
    """

    a: Float[np.ndarray, "2"]
    b: Float[np.ndarray, "2"]
    base: Float[np.ndarray, "2"]
    turn: float
    text: str


@dataclass(frozen=True, eq=False)
class Angle:
    """An angle about a centre between two directions, anticlockwise [degrees], its words at a point."""

    centre: Float[np.ndarray, "2"]
    radius: float
    start: float
    end: float
    text: str
    at: Float[np.ndarray, "2"]


Item = Line | Circle | Words | Dimension | Angle


@dataclass(frozen=True, eq=False)
class View:
    """Where a part's own coordinates [mm] lie on the paper.

    Args:
        origin: Of the part's coordinates on the paper [mm].
        scale: Reduction: 2 for 1:2.
    """

    origin: Float[np.ndarray, "2"]
    scale: float = 1.0

    def at(self, point: Point) -> Float[np.ndarray, "2"]:
        """A point on the paper."""
        return self.origin + np.asarray(point, float) / self.scale

    def line(self, points: Iterable[Point], layer: Layer = Layer.OUTLINE, *, closed: bool = True) -> Line:
        """A polyline."""
        return Line(np.array([self.at(p) for p in points]), layer, closed)

    def hole(self, centre: Point, diameter: float, label: str = "") -> list[Item]:
        """A round hole with its centre lines, and its number to the lower right."""
        middle, radius = self.at(centre), 0.5 * diameter / self.scale
        reach = 1.6 * radius
        cross = [np.array([[-reach, 0.0], [reach, 0.0]]), np.array([[0.0, -reach], [0.0, reach]])]
        items: list[Item] = [Circle(middle, radius), *(Line(middle + ends, Layer.CENTRES) for ends in cross)]
        if label:
            items.append(Words(label, middle + np.array([0.8 * radius + 0.6, -radius - TEXT])))
        return items

    def label(self, centre: Point, diameter: float, words: str, *, under: bool = False) -> Words:
        """Words over a hole, or under it."""
        off = 0.8 * diameter / self.scale + 0.6
        up = -off - TEXT if under else off
        return Words(words, self.at(centre) + np.array([0.0, up]), TEXT, "center")

    def title(self, words: str, under: Point, gap: float) -> Words:
        """Words in the middle over a point, so far above it on paper [mm]."""
        return Words(words, self.at(under) + np.array([0.0, gap]), TEXT, "center")

    def across(self, a: Point, b: Point, base: Point, turn: float, text: str = "<>") -> Dimension:
        """A dimension; its line goes through a point of the paper relative to the origin [mm]."""
        return Dimension(self.at(a), self.at(b), self.origin + np.asarray(base, float), turn, text)


@dataclass(frozen=True, eq=False, kw_only=True)
class Page:
    """A sheet of a drawing set.

    Args:
        name: Name of its DXF file.
        paper: A4 … A1.
        scale: Reduction of the parts.
        items: What is on it.
    """

    name: str
    paper: str = "A3"
    scale: float = 1.0
    items: tuple[Item, ...] = field(default=())


def paper_for(width: float, height: float, beside: tuple[float, float]) -> tuple[str, float]:
    """Sheet and reduction for a part of a size [mm] with so much beside and below it [mm of paper]."""
    for scale in SCALES:
        for paper in ("A3", "A2"):
            room = np.array(PAPERS[paper]) - 30.0 - beside
            if width / scale <= room[0] and height / scale <= room[1]:
                return paper, scale
    return "A1", SCALES[-1]


def pdf_of(pages: Sequence[Page]) -> bytes:
    """All pages as one PDF file."""
    buffer = io.BytesIO()
    with look(), PdfPages(buffer, metadata={"CreationDate": None}) as book:
        for page in pages:
            book.savefig(_figure(page), facecolor="white")
    return buffer.getvalue()


def _figure(page: Page) -> Figure:
    width, height = PAPERS[page.paper]
    figure = Figure(figsize=(width / 25.4, height / 25.4))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0.0, width), ylim=(0.0, height))
    axes.axis("off")
    sheet = _Sheet()
    for item in page.items:
        sheet.draw(item, page.scale)
    for layer, paths in sheet.strokes.items():
        pen: dict[str, Any] = {"lw": LOOKS[layer][2] * POINTS, "ls": LOOKS[layer][3]}
        pen["ec"] = INKS.get(layer, "black")
        axes.add_artist(PathPatch(_joined(paths), fill=False, joinstyle="miter", **pen))
    axes.add_artist(PathPatch(_joined(sheet.arrows), fc=INKS[Layer.DIMENSIONS], lw=0.0))
    for words in sheet.words:
        style: dict[str, Any] = {"ha": words.align, "va": "baseline", "rotation": words.turn}
        style |= {"rotation_mode": "anchor", "fontsize": 1.35 * words.height * POINTS, "color": "black"}
        axes.text(float(words.at[0]), float(words.at[1]), words.text, **style)
    return figure


def _joined(paths: Sequence[Path]) -> Path:
    """Many paths as one, which is drawn at once."""
    whole = Path.make_compound_path(*paths)
    whole.should_simplify = False
    return whole


class _Sheet:
    """What a page's items are made of: strokes by layer, arrowheads and words."""

    def __init__(self) -> None:
        self.strokes: defaultdict[Layer, list[Path]] = defaultdict(list)
        self.arrows: list[Path] = []
        self.words: list[Words] = []

    def draw(self, item: Item, scale: float) -> None:
        match item:
            case Line(points, layer, closed):
                self._line(layer, np.vstack([points, points[:1]]) if closed else points)
            case Circle(centre, radius, layer):
                self._arc(layer, centre, radius, 0.0, 360.0)
            case Words():
                self.words.append(item)
            case Dimension():
                self._dimension(item, scale)
            case Angle(centre, radius, start, end, text, at):
                self._arc(Layer.DIMENSIONS, centre, radius, start, end)
                for angle, way in ((start, 1.0), (end, -1.0)):
                    out = _unit(angle)
                    self._arrow(centre + radius * out, way * np.array([-out[1], out[0]]))
                self.draw(_leader(item), scale)
                self.words.append(Words(text, at))

    def _line(self, layer: Layer, points: Any) -> None:
        path = Path(points, closed=len(points) > 2 and np.array_equal(points[0], points[-1]))
        self.strokes[layer].append(path)

    def _arc(self, layer: Layer, centre: np.ndarray, radius: float, start: float, end: float) -> None:
        arc = Path.arc(start, end)
        self.strokes[layer].append(Path(centre + radius * np.asarray(arc.vertices), arc.codes))

    def _dimension(self, item: Dimension, scale: float) -> None:
        """Extension lines, arrows and words of a linear dimension."""
        along = _unit(item.turn)
        feet = [item.base + ((p - item.base) @ along) * along for p in (item.a, item.b)]
        for point, foot in zip((item.a, item.b), feet, strict=True):
            away = foot - point
            if np.linalg.norm(away) > 1.0:
                unit = away / np.linalg.norm(away)
                self._line(Layer.DIMENSIONS, [point + unit, foot + unit])
        length = float((feet[1] - feet[0]) @ along)
        inside, onwards = abs(length) > 8.0, np.sign(length) * along
        ends = feet if inside else [feet[0] - 6.0 * onwards, feet[1] + 6.0 * onwards]
        self._line(Layer.DIMENSIONS, ends)
        for foot, way in zip(feet, (1.0, -1.0), strict=True):
            self._arrow(foot, way * (1.0 if inside else -1.0) * onwards)
        text = item.text.replace("<>", f"{abs(length) * scale:.3f}".rstrip("0").rstrip("."))
        turn = item.turn if -90.0 < item.turn <= 90.0 else item.turn - 180.0
        up = _unit(turn + 90.0)
        self.words.append(Words(text, 0.5 * (feet[0] + feet[1]) + 0.8 * up, TEXT, "center", turn))

    def _arrow(self, tip: np.ndarray, back: np.ndarray) -> None:
        """An arrowhead whose shaft goes back along a unit vector."""
        side = np.array([-back[1], back[0]])
        self.arrows.append(Path([tip, tip + 2.5 * back + 0.5 * side, tip + 2.5 * back - 0.5 * side, tip]))


def _unit(angle: float) -> Float[np.ndarray, "2"]:
    """The direction at an angle [degrees]."""
    return np.array([np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))])


def _leader(item: Angle) -> Line:
    """From the middle of an arc to its words."""
    on_arc = item.centre + item.radius * _unit(0.5 * (item.start + item.end))
    left, foot = item.at
    right = left + 0.65 * TEXT * len(item.text)
    return Line(np.array([on_arc, [np.clip(on_arc[0], left, right), foot - 1.0]]), Layer.DIMENSIONS)


def dxf_of(page: Page) -> str:
    """A page as DXF text, 1:1."""
    try:
        import ezdxf
    except ImportError:
        raise MissingExtraError("writing DXF drawings", extra="cad") from None
    document = ezdxf.new("R2010", setup=["linetypes", "dimstyles:curved"], units=ezdxf.units.MM)
    for layer, (colour, kind, width, _) in LOOKS.items():
        document.layers.add(layer, color=colour, linetype=kind, lineweight=round(100 * width))
    for item in page.items:
        _in_space(document.modelspace(), item, page.scale)
    buffer = io.StringIO()
    document.write(buffer)
    return buffer.getvalue()


def _in_space(space: Any, item: Item, scale: float) -> None:
    match item:
        case Line(points, layer, closed):
            space.add_lwpolyline((scale * points).tolist(), close=closed, dxfattribs={"layer": layer})
        case Circle(centre, radius, layer):
            space.add_circle((scale * centre).tolist(), scale * radius, dxfattribs={"layer": layer})
        case Words(text, at, height, align, turn):
            from ezdxf.enums import TextEntityAlignment

            where = getattr(TextEntityAlignment, align.upper())
            style = {"layer": Layer.TEXT, "style": "OpenSans", "rotation": turn}
            words = space.add_text(text, height=scale * height, dxfattribs=style)
            words.set_placement((scale * at).tolist(), align=where)
        case Dimension(a, b, base, turn, text):
            space.add_linear_dim(
                base=(scale * base).tolist(),
                p1=(scale * a).tolist(),
                p2=(scale * b).tolist(),
                angle=turn,
                text=text,
                **_dimension_style(scale),
            ).render()
        case Angle(centre, radius, start, end, text, at):
            _in_space(space, _leader(item), scale)
            space.add_angular_dim_cra(
                center=(scale * centre).tolist(),
                radius=scale * radius,
                start_angle=start,
                end_angle=end,
                distance=0.0,
                location=(scale * (at + np.array([0.4 * TEXT * len(text), 0.5 * TEXT]))).tolist(),
                text=text,
                **(_dimension_style(scale) | {"dimstyle": "EZ_CURVED"}),
            ).render()


def _dimension_style(scale: float) -> dict[str, Any]:
    text = scale * TEXT
    override = {
        "dimtxt": text,
        "dimasz": 0.8 * text,
        "dimexe": 0.4 * text,
        "dimexo": 0.4 * text,
        "dimgap": 0.3 * text,
        "dimlfac": 1.0,
        "dimdec": 3,
        "dimzin": 8,
        "dimtxsty": "OpenSans",
    }
    return {"dimstyle": "EZDXF", "override": override, "dxfattribs": {"layer": Layer.DIMENSIONS}}
