"""Figures of one identification: errors before and after, where they occur, and the corrections.

The paper's arrays of error plots are in `error_grid`; `all_figures` makes everything that a report shows.
"""

from functools import cache, partial

import numpy as np
from matplotlib.figure import Figure

from workbench.base.advice import Advice
from workbench.base.progress import progress
from workbench.data.accuracy_requirement import Wanted
from workbench.identification.report.constants import corrections, influence_of_fit
from workbench.identification.report.error_grid import STEMS, error_grid
from workbench.identification.report.error_plots import POINTS, before_after, error_where, residual_histogram
from workbench.identification.result import Identification, columns_of, order_of_measuring
from workbench.report.figures import DrawnFigure, Picture, draw

NAMES = (
    *("errors-position", "errors-orientation", "before-after", "residuals", "error-where", "corrections"),
    "influence",
)
"""Every picture that a report may have."""


def all_figures(
    result: Identification, *, wanted: Wanted | None = None, advice: Advice | None = None
) -> tuple[DrawnFigure, ...]:
    """Every picture that the result can fill, in the order of a report.

    Args:
        wanted: Whose limits are drawn along the axes, where it is asked for per axis.
        advice: Keeps a sentence about each picture that failed.
    """
    drawings: list[DrawnFigure] = []
    advice = advice or Advice()
    for k, picture in enumerate(pictures(result, wanted=wanted)):
        progress(k / len(NAMES), f"drawing: {picture.title}")
        if (drawn := advice.ask(f"the picture “{picture.title}”", picture.drawn, None)) is not None:
            drawings.append(drawn[1])
    return tuple(drawings)


def pictures(result: Identification, *, wanted: Wanted | None = None) -> tuple[Picture, ...]:
    """Every picture that the result might fill; arguments as of `all_figures`."""
    best, rows = result.best, len(result.train_rows) + len(result.held_out_data)
    place = order_of_measuring(result)
    columns = cache(partial(columns_of, result))
    requested = wanted is not None and wanted.per_axis
    limits = (
        1e3 * wanted.position if wanted and requested else None,
        float(np.rad2deg(wanted.rotation)) if wanted and requested and wanted.rotation else None,
    )
    over = (
        "sorted by size, as there are too many to draw one by one"
        if rows > STEMS
        else "in order of measuring"
    )
    array = (
        f"Each column is one arm; rows are {over}. The identified arms share a scale in every row of the "
        "array; the nominal arm has its own where noted, and the band in its column is what the other "
        f"columns show.{' Dotted lines: the wanted limit.' if requested else ''}"
    )
    thin = f" {POINTS} of {rows} rows are drawn, evenly chosen." if rows > POINTS else ""
    best_title = best.fit.title
    return (
        Picture(NAMES[0], "Position errors, axis by axis", array,
         lambda: error_grid(columns(), place, rotation=False, limit=limits[0])),
        Picture(NAMES[1], "Orientation errors, axis by axis", array,
         lambda: error_grid(columns(), place, rotation=True, limit=limits[1])),
        Picture(NAMES[2], "Before and after, row by row",
         f"Nominal arm (grey; base and tool fitted where free) and {best_title} (blue; held-out rows in the "
         "colour of the text). Circled: rows that stand out." + thin, lambda: before_after(result, place)),
        Picture(NAMES[3], "Residuals against the noise",
         f"Residual components of {best_title} on the fitted rows, and the normal distribution of the noise "
         "that weighed them. Wider or lopsided residuals mean that something is missing from the model.",
         lambda: residual_histogram(result)),
        Picture(NAMES[4], "Where errors remain",
         f"Error of {best_title} against the distance from the first axis and against every joint; the line "
         "is the running median. A trend means that something is missing from the model there." + thin,
         lambda: error_where(result)),
        Picture(NAMES[5], "Corrections of the arm",
         "Identification minus nominal in standard errors, one standard error either way; on the right the "
         "same in mm and mrad. Within the band (two standard errors) a correction may be chance.",
         lambda: corrections(best)),
        Picture(NAMES[6], "Influence of each constant",
         "How far the tool moves at the fitted poses when an angle deviates by 0.05° or a length by 0.1 mm, "
         "one constant at a time.", lambda: influence_of_fit(result)),
    )  # fmt: skip


def figure(result: Identification, name: str = "before-after") -> Figure:
    """One of the report's figures: `before-after`, `residuals`, `error-where`, `corrections` …"""
    return draw(pictures(result), name)
