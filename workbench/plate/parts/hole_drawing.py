"""The plate's hole drawing as DXF, in millimetres, 1:1, seen from above; origin at the lower left corner.

Overall dimensions are drawn below and right; the blocks' places as ordinate dimensions above and left,
spread where they would touch; every hole stands in the table beside.
"""

import io
from typing import Any

import numpy as np
from scipy.optimize import isotonic_regression

from workbench.base.errors import MissingExtraError
from workbench.plate.parts.parts import Bore, Fixture, Purpose

MM = 1e3
LAYERS: dict[str, dict[str, Any]] = {
    "OUTLINE": {"color": 7, "lineweight": 50},
    "HOLES": {"color": 7, "lineweight": 35},
    "CENTRES": {"color": 1, "linetype": "CENTER", "lineweight": 13},
    "BLOCKS": {"color": 8, "linetype": "DASHED", "lineweight": 18},
    "DOWNHILL": {"color": 3, "lineweight": 35},
    "DIMENSIONS": {"color": 5, "lineweight": 18},
    "TEXT": {"color": 7, "lineweight": 18},
}
DOWNHILL = {"layer": "DOWNHILL"}
SHORT = {Purpose.SCREW: "screw", Purpose.DOWEL: "dowel H7", Purpose.MOUNTING: "mounting"}


def dxf(fixture: Fixture) -> str:
    """The drawing as DXF text.

    Raises:
        MissingExtraError: ezdxf is not installed.
    """
    try:
        import ezdxf
    except ImportError:
        raise MissingExtraError("writing DXF drawings", extra="cad") from None
    document = ezdxf.new("R2010", setup=True, units=ezdxf.units.MM)
    for name, style in LAYERS.items():
        document.layers.add(name, **style)
    _Sheet(document.modelspace(), fixture).draw()
    buffer = io.StringIO()
    document.write(buffer)
    return buffer.getvalue()


class _Sheet:
    """Draws one fixture into a model space; sizes of text and gaps follow the plate's size."""

    def __init__(self, space: Any, fixture: Fixture):
        self.space, self.fixture = space, fixture
        self.length, self.width, self.thickness = (MM * fixture.slab.size).tolist()
        self.text = float(np.clip(max(self.length, self.width) / 100.0, 2.5, 6.0))

    def draw(self) -> None:
        """Everything."""
        corners = [(0, 0), (self.length, 0), (self.length, self.width), (0, self.width)]
        self.space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "OUTLINE"})
        for bore in self.fixture.slab.bores:
            self._hole(bore)
        for block in self.fixture.blocks:
            foot = MM * (block.footprint + 0.5 * self.fixture.slab.size[:2])
            self.space.add_lwpolyline(foot.tolist(), close=True, dxfattribs={"layer": "BLOCKS"})
            self.space.add_line(foot[1:3].mean(axis=0), _beyond(foot, 1.5 * self.text), dxfattribs=DOWNHILL)
            corner = foot[np.argmax(foot.sum(axis=1))]
            label = f"{block.number}{self.fixture.letter(block.number)}"
            self._write(label, (corner[0] + 0.4 * self.text, corner[1]), 1.2)
        self._overall()
        self._ordinates()
        self._robot()
        self._table()

    def _hole(self, bore: Bore) -> None:
        x, y = self.fixture.from_corner(bore.mouth)
        radius = 0.5 * MM * bore.diameter
        self.space.add_circle((x, y), radius, dxfattribs={"layer": "HOLES"})
        for dx, dy in ((1.6 * radius, 0.0), (0.0, 1.6 * radius)):
            ends = ((x - dx, y - dy), (x + dx, y + dy))
            self.space.add_line(*ends, dxfattribs={"layer": "CENTRES"})
        if bore.purpose is Purpose.MOUNTING:
            self._write(bore.label, (x + 1.3 * radius, y + 1.3 * radius), 1.0)

    def _overall(self) -> None:
        gap = 6.0 * self.text
        below: dict[str, Any] = {"base": (0, -gap), "p1": (0, 0), "p2": (self.length, 0)}
        right = {
            "base": (self.length + gap, 0),
            "p1": (self.length, 0),
            "p2": (self.length, self.width),
            "angle": 90,
        }
        for places in (below, right):
            self.space.add_linear_dim(**places, **self._style()).render()

    def _ordinates(self) -> None:
        """Blocks' places along x above the plate, along y left of it."""
        places = np.array([self.fixture.from_corner(b.pose[:3, 3]) for b in self.fixture.blocks])
        spacing, reach = 2.2 * self.text, 5.0 * self.text
        for x, label in _spread(places[:, 0], spacing):
            self.space.add_ordinate_x_dim(
                feature_location=(x, self.width), offset=(label - x, reach), **self._style()
            ).render()
        for y, label in _spread(places[:, 1], spacing):
            self.space.add_ordinate_y_dim(
                feature_location=(0, y), offset=(-reach, label - y), **self._style()
            ).render()

    def _robot(self) -> None:
        """The robot's base as a cross with its axes' names, and where it stands, in words."""
        pose = np.linalg.inv(self.fixture.pose)
        x, y = self.fixture.from_corner(pose[:3, 3])
        arm = 4.0 * self.text
        for axis, name in ((0, "X"), (1, "Y")):
            tip = (x + arm * pose[0, axis], y + arm * pose[1, axis])
            self.space.add_line((x, y), tip, dxfattribs={"layer": "CENTRES"})
            self._write(name, tip, 0.8)
        self.space.add_circle((x, y), 0.5 * self.text, dxfattribs={"layer": "CENTRES"})
        words = f"ROBOT BASE AT X {x:.2f} Y {y:.2f}, {MM * pose[2, 3]:+.2f} FROM TOP FACE"
        self._write(words, (0.0, -13.0 * self.text), 1.0)

    def _table(self) -> None:
        """Title, and one line a hole."""
        left, line = self.length + 14.0 * self.text, 1.7 * self.text
        title = (
            f"{self.fixture.name.upper()}: PLATE {self.length:.1f} x {self.width:.1f} x {self.thickness:.1f}"
        )
        self._write(title, (left, self.width - line), 1.3)
        note = "mm; seen from above; all holes through; green ticks: where faces slope down"
        self._write(note, (left, self.width - 2.4 * line), 0.9)
        columns = (0.0, 5.0, 14.0, 22.0, 30.0)
        rows = [("HOLE", "X", "Y", "DIA", "FOR")]
        for bore in self.fixture.slab.bores:
            x, y = self.fixture.from_corner(bore.mouth)
            rows.append(
                (bore.label, f"{x:.3f}", f"{y:.3f}", f"{MM * bore.diameter:.2f}", SHORT[bore.purpose])
            )
        for number, cells in enumerate(rows):
            for column, cell in zip(columns, cells, strict=True):
                at = (left + column * self.text, self.width - (4.0 + number) * line)
                self._write(cell, at, 1.0)

    def _write(self, words: str, at: tuple[float, float], size: float) -> None:
        attributes = {"layer": "TEXT", "style": "OpenSans"}
        self.space.add_text(words, height=size * self.text, dxfattribs=attributes).set_placement(at)

    def _style(self) -> dict[str, Any]:
        text = self.text
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
        return {"dimstyle": "EZDXF", "override": override, "dxfattribs": {"layer": "DIMENSIONS"}}


def _beyond(foot: np.ndarray, length: float) -> np.ndarray:
    """A point so far outside the middle of a block's downhill edge."""
    middle, edge = foot.mean(axis=0), foot[1:3].mean(axis=0)
    return edge + length * (edge - middle) / np.linalg.norm(edge - middle)


def _spread(values: np.ndarray, spacing: float) -> list[tuple[float, float]]:
    """Different values in order, each with a place for its label; labels keep their distance."""
    unique = np.unique(np.round(values, 3))
    ranks = spacing * np.arange(len(unique))
    # labels nearest to their values with the distance kept: the isotonic fit of value − rank · spacing
    fitted = isotonic_regression(unique - ranks).x + ranks
    return list(zip(unique.tolist(), fitted.tolist(), strict=True))
