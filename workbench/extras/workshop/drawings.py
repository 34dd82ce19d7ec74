"""The drawings as PDF and SVG, from the same entities as the DXF, by ezdxf's drawing add-on on matplotlib."""

import io
from collections.abc import Iterable

from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch

from workbench.plate.parts.drawing import Sheet
from workbench.report.figures import svg

A3 = (16.54, 11.69)
"""[in]"""


def pdf_of(sheets: Iterable[Sheet]) -> bytes:
    """A page for each sheet, fitted to A3."""
    buffer = io.BytesIO()
    with PdfPages(buffer, metadata={"CreationDate": None}) as book:
        for sheet in sheets:
            book.savefig(figure_of(sheet), facecolor="white")
    return buffer.getvalue()


def svg_of(sheet: Sheet, name: str) -> str:
    """The same page as SVG."""
    return svg(figure_of(sheet), name)


def figure_of(sheet: Sheet) -> Figure:
    """The page as a figure of matplotlib."""
    from ezdxf.addons.drawing import Frontend, RenderContext
    from ezdxf.addons.drawing.config import BackgroundPolicy, Configuration
    from ezdxf.addons.drawing.matplotlib import MatplotlibBackend
    from ezdxf.npshapes import to_matplotlib_path

    class Backend(MatplotlibBackend):
        def draw_filled_paths(self, paths, properties) -> None:
            """Glyphs as their font winds them: to detect holes anew fills half of every Ø."""
            outline = to_matplotlib_path(paths)
            self.ax.add_patch(PathPatch(outline, color=properties.color, linewidth=0.0))

    figure = Figure(figsize=A3)
    backend = Backend(figure.add_axes((0.02, 0.02, 0.96, 0.96)), adjust_figure=False)
    paper = Configuration(background_policy=BackgroundPolicy.WHITE)
    Frontend(RenderContext(sheet.document), backend, config=paper).draw_layout(sheet.space)
    return figure
