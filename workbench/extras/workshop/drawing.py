"""The plate's drawing as entities of ezdxf: from above, 1:1 in millimetres, with tables of holes and blocks.

DXF and PDF are of the same page, the latter by ezdxf's drawing add-on on matplotlib. Its tolerances keep the
plate's, ±a and ±b (`plate.tolerances`), where errors add up:

| error of the target       | made of                                                          | each |
|---------------------------|------------------------------------------------------------------|------|
| x, y                      | place of the foot's holes in the plate, of the seat in the block | ±a/2 |
| z                         | height of the block                                              | ±a   |
| tilt                      | mitre of the block                                               | ±b   |
| turn about the normal     | line of the dowels in the plate, index hole in the block         | ±b/2 |

A position tolerance is a cylinder: ±t along each of two axes is drawn as one of diameter 2t, which it holds.
The line of two dowels at the distance 2r turns by b/2 when one moves across it by r b against the other.
"""

import io
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from workbench.base.errors import MissingExtraError
from workbench.extras.workshop.fixture import DOWEL_OFFSET
from workbench.extras.workshop.parts import Fixture, Purpose
from workbench.extras.workshop.solids import MM
from workbench.plate.plate import Kind

SCALES = (1.0, 2.0, 5.0, 10.0, 20.0)
"""Reductions of ISO 5455 for print: 1:1, 1:2, …"""
ROOM, TEXT, LINE, GAP = 190.0, 2.5, 4.25, 10.0
"""On paper: for the plate, height of letters, from line to line, between columns [mm]."""
Rows = list[tuple[str, ...]]
LAYERS = {"OUTLINE": 50, "HOLES": 35, "BLOCKS": 18, "DIMENSIONS": 13, "TEXT": 13}
"""Widths of lines [0.01 mm] (ISO 128)."""


def plate_drawing(fixture: Fixture) -> Any:
    """The page as a document of ezdxf."""
    try:
        import ezdxf
    except ImportError:
        raise MissingExtraError("writing drawings", extra="cad") from None
    length, width = (MM * fixture.slab.size[:2]).tolist()
    scale = next((scale for scale in SCALES if max(length, width) / scale <= ROOM), SCALES[-1])
    document = ezdxf.new("R2010", setup=["linetypes", "dimstyles"], units=ezdxf.units.MM)
    for layer, line in LAYERS.items():
        document.layers.add(layer, linetype="DASHED" if layer == "BLOCKS" else "CONTINUOUS", lineweight=line)
    document.header["$LTSCALE"] = scale
    space = document.modelspace()
    corners = [(0.0, 0.0), (length, 0.0), (length, width), (0.0, width)]
    space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "OUTLINE"})
    for base, end, turn in (((0.0, -8.0), corners[1], 0.0), ((-8.0, 0.0), corners[3], 90.0)):
        sizes = {"dimtxt": TEXT * scale, "dimasz": 2.0 * scale, "dimgap": scale}
        numbers = {"dimlfac": 1.0, "dimdec": 3, "dimzin": 8}
        style: Any = {"override": sizes | numbers, "dxfattribs": {"layer": "DIMENSIONS"}}
        space.add_linear_dim(np.multiply(base, scale), corners[0], end, angle=turn, **style).render()
    for bore in fixture.slab.bores:
        x, y = fixture.from_corner(bore.mouth)
        space.add_circle((x, y), 0.5 * MM * bore.diameter, dxfattribs={"layer": "HOLES"})
        if bore.purpose is Purpose.MOUNTING:
            inwards = np.sign(0.5 * length - x) * (MM * bore.diameter + TEXT * scale)
            _write(space, bore.label, (x + inwards, y), scale, centred=True)
    for block in fixture.blocks:
        foot = fixture.from_corner(block.footprint)
        space.add_lwpolyline(foot, close=True, dxfattribs={"layer": "BLOCKS"})
        low, middle, high = foot[1:3].mean(axis=0), foot.mean(axis=0), foot[[0, 3]].mean(axis=0)
        space.add_line(low, 0.8 * low + 0.2 * middle, dxfattribs={"layer": "OUTLINE"})
        _write(space, f"{block.number}", 0.6 * high + 0.4 * middle, scale, centred=True)
    _table(space, _notes(fixture), (0.0, -1.5 * GAP * scale), scale)
    x = length + GAP * scale
    fits = max(int(width / (LINE * scale)) - 1, 12)
    for table in (*_pieces(_holes(fixture), fits), *_pieces(_blocks(fixture), fits)):
        x = _table(space, table, (x, width), scale) + GAP * scale
    return document


def _write(space: Any, text: str, at: Sequence[float], scale: float, *, centred: bool = False) -> None:
    from ezdxf.enums import TextEntityAlignment

    align = TextEntityAlignment.MIDDLE_CENTER if centred else TextEntityAlignment.LEFT
    line = space.add_text(text, height=TEXT * scale, dxfattribs={"layer": "TEXT", "style": "OpenSans"})
    line.set_placement(tuple(map(float, at)), align=align)


def _table(space: Any, rows: Sequence[Sequence[str]], corner: tuple[float, float], scale: float) -> float:
    """Rows of cells from their upper left corner; gives their right edge."""
    x, top = corner
    for cells in zip(*rows, strict=True):
        for number, cell in enumerate(cells, start=1):
            _write(space, cell, (x, top - number * LINE * scale), scale)
        x += 0.72 * TEXT * scale * (2 + max(map(len, cells)))
    return x


def _pieces(rows: Rows, fits: int) -> Iterable[Rows]:
    """A table in pieces of so many lines, each with its head, that stand beside each other."""
    head, *body = rows
    return ([head, *body[i : i + fits]] for i in range(0, len(body), fits))


def _holes(fixture: Fixture) -> Rows:
    rows: Rows = [("hole", "x", "y", "size", "for")]
    for bore in fixture.slab.bores:
        x, y = (f"{value:z.3f}" for value in fixture.from_corner(bore.mouth))
        fit = " H7" if bore.purpose is Purpose.DOWEL else ""
        rows.append((bore.label, x, y, f"Ø{MM * bore.diameter:.4g}{fit}", str(bore.purpose)))
    return rows


def _blocks(fixture: Fixture) -> Rows:
    rows: Rows = [("target", "block", "height", "tilt", "turn", "index")]
    letters = {block.number: letter for letter, alike in fixture.shapes.items() for block in alike}
    for block in fixture.blocks:
        at = {bore.purpose: bore.mouth for bore in block.bores}
        x, y, _ = at[Purpose.INDEX] - at[Purpose.SEAT] if Purpose.INDEX in at else np.full(3, np.nan)
        angles = block.tilt, block.azimuth, np.arctan2(y, x / np.cos(block.tilt))
        cells = (f"{np.rad2deg(angle):z.4f}°".replace("nan°", "–") for angle in angles)
        rows.append((f"{block.number}", letters[block.number], f"{MM * block.height:.3f}", *cells))
    return rows


def _notes(fixture: Fixture) -> list[tuple[str]]:
    """Title, what the drawing asks for, and what the solids can't say."""
    length, turn = fixture.plate.made_as_drawn.production.tolerance
    place, angle, half = MM * length, np.rad2deg(turn), 0.5 * np.rad2deg(turn)
    pair = 2.0 * MM * DOWEL_OFFSET * 0.5 * turn
    x, y = fixture.from_corner(np.linalg.inv(fixture.plate.pose)[:3, 3])
    z = MM * np.linalg.inv(fixture.plate.pose)[2, 3]
    kinds = {block.kind for block in fixture.blocks}
    seats = (
        "Seats: bore Ø6 H7 × 8, index hole Ø3 H7 × 6 at 15; in the probe pins Ø6 g6 and Ø3 g6. Index: from "
    )
    seats += "the bore to the index hole in the face, from the slope downwards (x if flat), anticlockwise."
    size = " × ".join(f"{MM * edge:.1f}" for edge in fixture.slab.size)
    text = [
        f"{fixture.plate.name}: plate {size}, seen from above, mm",
        "Plate EN AW-5083; blocks of square bar 46, EN AW-6082; general tolerances ISO 2768-mK.",
        f"Each target within ±{place:.3g} mm, ±{angle:.3g}°; therefore:",
        f"Dowel holes: position Ø{place:.3f} to the top, the lower and the left edge, those of a block "
        f"Ø{pair:.3f} to each other; other holes Ø0.2.",
        f"Blocks: height ±{place:.3g} at the middle, mitre ±{angle:.3g}°; seat, cone or centre Ø{place:.3f} "
        f"to the dowels' middle, index hole ±{half:.3g}° to their line.",
        "Foot: M6, core Ø5 × 12; dowel holes Ø4 H7 × 8, ±14 across the slope.",
        *([seats] if Kind.SEAT in kinds else []),
        *(["Sockets: 90° cone for a ball of Ø12."] if Kind.SOCKET in kinds else []),
        "Tick: low side of a block (+x if flat); turn: from x, anticlockwise.",
        f"Robot's base at x {x:.2f}, y {y:.2f}, {z:+.2f} from the top.",
        *fixture.notes,
    ]
    return [(line,) for line in text]


def dxf_of(document: Any) -> bytes:
    buffer = io.StringIO()
    document.write(buffer)
    return buffer.getvalue().encode()


def pdf_of(document: Any) -> bytes:
    """The page on A3, by ezdxf's drawing add-on on matplotlib."""
    from ezdxf.addons.drawing import Frontend, RenderContext
    from ezdxf.addons.drawing.config import BackgroundPolicy, ColorPolicy, Configuration, TextPolicy
    from ezdxf.addons.drawing.matplotlib import MatplotlibBackend
    from matplotlib.figure import Figure

    figure, buffer = Figure(figsize=(16.54, 11.69)), io.BytesIO()
    backend = MatplotlibBackend(figure.add_axes((0.02, 0.02, 0.96, 0.96)), adjust_figure=False)
    paper = Configuration(
        background_policy=BackgroundPolicy.WHITE,
        color_policy=ColorPolicy.BLACK,
        text_policy=TextPolicy.OUTLINE,
    )
    Frontend(RenderContext(document), backend, config=paper).draw_layout(document.modelspace())
    figure.savefig(buffer, format="pdf", metadata={"CreationDate": None})
    return buffer.getvalue()
