"""SVG figures in one style, with files that change only if the result does.

Figures are made without pyplot, so that nothing is shown and no window system is asked for. Their ink is
written as `currentColor` and their ground is transparent: a picture takes the colours of the page that it
stands in, light or dark, and is black where nothing is said.
"""

import io
import re
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal

import matplotlib
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import LogLocator, NullFormatter

from workbench.report.colours import CALIBRATED, GEOMETRY

INK = "#1b2129"
"""Stands for the page's text colour; replaced when the picture is written."""
COLOURS = (GEOMETRY, CALIBRATED, "#009e73", "#cc79a7", "#56b4e9")
"""Okabe & Ito's colours, which the colour-blind can tell apart: one per algorithm, in order."""
LOOK: Any = {
    "svg.hashsalt": "workbench",
    "svg.fonttype": "none",
    "text.parse_math": False,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial", "sans-serif"],
    "font.size": 8.0,
    "axes.titlesize": 9.0,
    "axes.titleweight": "bold",
    "axes.labelsize": 8.0,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.facecolor": "none",
    "axes.grid": False,
    "axes.unicode_minus": True,
    "figure.facecolor": "none",
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "xtick.minor.size": 1.5,
    "ytick.minor.size": 1.5,
    "lines.linewidth": 1.2,
}
_ONE_AT_A_TIME = threading.RLock()


@contextmanager
def look() -> Iterator[None]:
    """The settings of our figures, for as long as one is made; threads wait for each other."""
    with _ONE_AT_A_TIME, matplotlib.rc_context(LOOK), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        yield


class _NotebookFigure(Figure):
    """A figure that a notebook shows by itself, since none of ours goes through pyplot."""

    def _repr_png_(self) -> bytes:
        return png(self)

    def draw(self, renderer: RendererBase) -> None:
        """Drawn once: before it saves a figure, matplotlib draws it for nothing but its layout."""
        engine = self.get_layout_engine()
        if isinstance(engine, ConstrainedLayoutEngine) and self.axes and self.canvas.is_saving():
            engine.execute(self)
        else:
            super().draw(renderer)


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of this many inches."""
    return _NotebookFigure(figsize=(width, height), layout="constrained")


def on_white(figure: Figure) -> Figure:
    """The figure on paper of its own, for a notebook or a file, dark or light."""
    figure.set_facecolor("white")
    return figure


def plain_ticks(axis: Axis) -> None:
    """Plain numbers on a logarithmic axis, after its data: 1, 2, 5 where it spans less than two decades."""
    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 100.0 * low else (1.0,)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def grid(axes: Axes, which: Literal["both", "x", "y"] = "y") -> None:
    """Faint lines behind the data."""
    axes.grid(axis=which, color=INK, alpha=0.12, linewidth=0.5)
    axes.set_axisbelow(True)


def svg(figure: Figure, name: str) -> str:
    """The figure as SVG text, the same for the same data.

    Args:
        figure: To be written.
        name: Begins every identifier in it, so that several pictures can stand in one page.
    """
    buffer = io.StringIO()
    with look():
        nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        figure.savefig(buffer, format="svg", metadata=nothing)
    content = buffer.getvalue()
    content = content[content.index("<svg") :]
    content = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{name}-", content)
    content = content.replace(INK, "currentColor")
    return "\n".join(line.rstrip() for line in content.splitlines()) + "\n"


def png(figure: Figure, dots: int = 130) -> bytes:
    """The figure as a PNG picture on white, the same for the same data.

    Args:
        figure: To be written.
        dots: Per inch.
    """
    buffer = io.BytesIO()
    with look():
        figure.savefig(buffer, format="png", dpi=dots, facecolor="white", metadata={"Software": None})
    return buffer.getvalue()
