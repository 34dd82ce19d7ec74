"""Charts described once, by values and colours, and drawn as SVG: for the page, and for HTML reports.

Words and frames take the colour of the text around them, so that a chart reads on light and on dark pages.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.report.numbers import significant

WIDTH = 340.0
LEFT, FOOT, MARGIN = 54.0, 16.0, 6.0
"""Room for the numbers of an upright axis, and below a chart; free room inside the frame."""
ROW, THICK = 26.0, 14.0
"""Height of a row with a bar, and of the bar."""
SIZE, LETTER = 12, 0.55
"""Of words, and the width of a letter as a share of it."""


@dataclass(frozen=True)
class Bar:
    """A named size; `note` stands behind its number."""

    name: str
    value: float
    colour: str
    note: str = ""


@dataclass(frozen=True, eq=False)
class Marks:
    """Points over the chart's x axis, bars up to them, or a line through them.

    Args:
        y: NaN or infinite where there is none.
        titles: Of each point, shown when it is pointed at.
        links: Where a click on each leads; empty for nowhere.
        is_filled: Whether a line is the upper edge of an area, down to the floor, with the first title.
        radius: Of a point, or half the width of a bar.
        is_bar: Whether each point is a bar from the floor.
        name: In the legend; empty: not in it.
    """

    x: Float[np.ndarray, " n"]
    y: Float[np.ndarray, " n"]
    colour: str
    titles: Sequence[str] = ()
    links: Sequence[str] = ()
    radius: float = 2.6
    is_line: bool = False
    is_bar: bool = False
    is_filled: bool = False
    name: str = ""


@dataclass(frozen=True)
class Upright:
    """A dashed upright line with words beside its top, if any."""

    x: float
    text: str
    colour: str


@dataclass(frozen=True, eq=False)
class Chart:
    """Marks in one frame.

    Args:
        ticks: Places [x] with words below them.
        floor: Where the upright axis begins; None: at the smallest value.
        uprights: Lines that mark where something happened, over the marks.
    """

    marks: Sequence[Marks]
    height: float = 90.0
    ticks: Sequence[tuple[float, str]] = ()
    is_log: bool = False
    floor: float | None = None
    uprights: Sequence[Upright] = ()
    title: str = field(default="", kw_only=True)
    testid: str = field(default="chart", kw_only=True)

    def svg(self) -> str:
        """The drawing; empty where there is nothing to draw."""
        x, y = (np.concatenate([getattr(m, axis) for m in self.marks]) for axis in ("x", "y"))
        if not len(y := y[np.isfinite(y)]):
            return ""
        low, high = y.min() if self.floor is None else self.floor, y.max()
        parts = [f'<path d="M{LEFT} 0V{self.height:.0f}H{WIDTH:.0f}" fill="none" {_ink("stroke", 0.3)}/>']
        for at, end in ((self.height, low), (MARGIN + 6, high)):
            parts.append(text(LEFT - 4, at, significant(float(end)), anchor="end"))
        first, last = float(x.min()), float(x.max())
        for place, label in self.ticks:
            at = self._across(place, first, last)
            parts.append(f'<path d="M{at:.1f} {self.height:.0f}v4" {_ink("stroke", 0.3)}/>')
            parts.append(
                text(min(at, WIDTH - 0.3 * SIZE * len(label)), self.height + FOOT - 1, label, anchor="middle")
            )
        for one in self.marks:
            across = self._across(one.x, first, last)
            parts.append(_drawn(one, across, self._up(one.y, float(low), float(high)), self.height))
        for k, line in enumerate(self.uprights):
            at = self._across(line.x, first, last)
            anchor, aside = ("end", -4) if at > 0.5 * (LEFT + WIDTH) else ("start", 4)
            parts += [
                f'<path d="M{at:.1f} 0V{self.height:.0f}" style="stroke:{line.colour}" stroke-width="1.6" '
                'stroke-dasharray="5 3" data-testid="event-line"/>',
                text(at + aside, MARGIN + 5 + (SIZE + 2) * k, line.text, anchor=anchor),
            ]
        named = [one for one in self.marks if one.name]
        foot = self.height + FOOT + (FOOT if named else 0.0)
        return framed(foot, [*parts, *_legend(named, foot - 4)], self.testid)

    def _across(self, x: Any, first: float, last: float) -> Any:
        return LEFT + MARGIN + (WIDTH - LEFT - 2 * MARGIN) * (x - first) / max(last - first, 1e-12)

    def _up(self, y: np.ndarray, low: float, high: float) -> np.ndarray:
        if self.is_log:
            y = np.log(np.maximum(y, 1e-12))
            low, high = (float(np.log(max(v, 1e-12))) for v in (low, high))
        room = self.height - MARGIN - (MARGIN if self.floor is None else 0.0)  # bars stand on the frame
        return MARGIN + room * (1.0 - (y - low) / max(high - low, 1e-12))


@dataclass(frozen=True)
class Bars:
    """Bars one below another, each with its name above it and its number behind it."""

    rows: Sequence[Bar]
    title: str = ""
    unit: str = "mm"
    testid: str = "bars"

    def svg(self) -> str:
        """The drawing, whose longest bar leaves room for all numbers; empty without bars."""
        sizes = [f"{significant(r.value)} {self.unit}{r.note and ' · '}{r.note}" for r in self.rows]
        room = [0.9 * WIDTH - LETTER * SIZE * len(size) for size in sizes]
        scale = np.min(np.divide(room, [max(r.value, 1e-12) for r in self.rows]), initial=np.inf)
        parts = []
        for k, (row, size) in enumerate(zip(self.rows, sizes, strict=True)):
            y, length = (ROW + 6.0) * k, max(scale * row.value, 1.5)
            parts += [
                text(0, y + 11, row.name),
                f'<rect x="0" y="{y + 15:.1f}" width="{length:.1f}" height="{THICK:.0f}" rx="2" '
                f'style="fill:{row.colour}"><title>{escape(f"{row.name}: {size}")}</title></rect>',
                text(length + 6, y + 26, size),
            ]
        return framed((ROW + 6.0) * len(self.rows), parts, self.testid) if self.rows else ""


def framed(height: float, parts: Sequence[str], testid: str) -> str:
    """The drawing of these parts, as wide as the place where it stands."""
    return (
        f'<svg viewBox="0 0 {WIDTH:.0f} {height:.0f}" width="100%" font-size="{SIZE}" '
        f'data-testid="{testid}">{"".join(parts)}</svg>'
    )


def text(x: float, y: float, shown: str, *, anchor: str = "start") -> str:
    style = f'text-anchor="{anchor}" style="fill:currentColor"'
    return f'<text x="{x:.1f}" y="{y:.1f}" {style}>{escape(shown)}</text>'


def _ink(what: str, opacity: float) -> str:
    return f'{what}="currentColor" {what}-opacity="{opacity}"'


def _legend(named: Sequence[Marks], y: float) -> Iterator[str]:
    """The colours of marks, side by side."""
    x = LEFT
    for one in named:
        yield f'<circle cx="{x + 4:.0f}" cy="{y - 4:.0f}" r="4" style="fill:{one.colour}"/>'
        yield text(x + 12, y, one.name)
        x += 24 + LETTER * SIZE * len(one.name)


def _drawn(marks: Marks, x: np.ndarray, y: np.ndarray, foot: float) -> str:
    known = np.flatnonzero(np.isfinite(y))
    if marks.is_line:
        line = " ".join(f"{x[k]:.1f},{y[k]:.1f}" for k in known)
        ink = f'style="fill:{marks.colour if marks.is_filled else "none"};stroke:{marks.colour}"'
        title = f"<title>{escape(marks.titles[0])}</title>" if marks.titles else ""
        return f'<polyline points="{line}" {ink} fill-opacity=".35" stroke-width="1.2">{title}</polyline>'
    return "".join(_dot(marks, k, x[k], y[k], foot) for k in known.tolist())


def _dot(marks: Marks, k: int, x: float, y: float, foot: float) -> str:
    title = f"<title>{escape(marks.titles[k])}</title>" if marks.titles else ""
    style, r = f'style="fill:{marks.colour}"', marks.radius
    dot = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{r}" {style}>{title}</circle>'
    if marks.is_bar:
        size = f'x="{x - r:.1f}" y="{y:.1f}" width="{2 * r:.1f}" height="{foot - y:.1f}"'
        dot = f'<rect {size} rx="2" {style}>{title}</rect>'
    link = marks.links[k] if marks.links else ""
    return f'<a href="{escape(link)}">{dot}</a>' if link else dot
