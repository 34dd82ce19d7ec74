"""A verification as tables and plain data: the schema `workbench.verification/1`."""

from typing import TYPE_CHECKING

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.text import Text

from workbench.extras.service.verification.intervals import BOUNDED_SHARE, CONFIDENCE, Bounds
from workbench.extras.service.verification.iso9283 import RepeatedPose
from workbench.extras.service.verification.result import Verification
from workbench.identification.errors.row_errors import Spread
from workbench.identification.report.results_json import errors_json
from workbench.report.json import Json, document
from workbench.report.numbers import short, signed
from workbench.report.result_display import plot_of, summary_of
from workbench.report.result_fields import DEG, MM, ResultField, ResultFields, Unit
from workbench.report.tables import line, new_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SCHEMA = "workbench.verification/1"
LISTED = 10
"""Repeated poses that a table names one by one, the least accurate first."""


def _rows(rows: np.ndarray) -> str:
    return f"{rows[0]}, {rows[1]}" if len(rows) == 2 else f"{rows[0]} …"


def _angles(values: np.ndarray) -> str:
    return " ".join(signed(v, 3) for v in values.tolist()) if np.isfinite(values).all() else "–"


REPEATED = ResultFields(
    ResultField("rows", title="rows", text=_rows),
    ResultField("visits", title="visits"),
    ResultField("AP", MM, of="accuracy", title="AP"),
    ResultField("RP", MM, of="repeatability", title="RP"),
    ResultField("AP_abc", DEG, of="angle_accuracy", title="AP a b c", text=_angles),
    ResultField("RP_abc", DEG, of="angle_repeatability", title="± RP a b c", text=_angles),
)
"""Of a `RepeatedPose`."""


@summary_of.register
def verification_tables(result: Verification) -> RenderableType:
    """Errors with intervals, AP and RP, the verdict, and what weakens it."""
    table = new_table(
        f"{result.robot.name}: {len(result.within)} rows of {result.poses} fresh poses",
        "error",
        "mean",
        "95 %",
        "rms",
        "max",
        "bound",
    )
    for text, spread, bounds, scale in error_lines(result):
        table.add_row(
            escape(text),
            short(spread.mean),
            f"{short(scale * bounds.mean.low)} … {short(scale * bounds.mean.high)}",
            short(spread.rms),
            short(spread.max),
            short(scale * bounds.maximum),
        )
    parts: list[RenderableType] = [table, Text("bound: met by 95 % of all poses, with 95 % confidence")]
    if result.repeated:
        parts.append(_repeats_table(result))
    colour = {True: "bold green", False: "bold red", None: "bold"}[result.passed]
    parts.append(Text(result.verdict, style=colour))
    parts += [line("warning", text) for text in result.warnings]
    return Group(*parts, *(line("note", text) for text in result.evaluation.notes))


def error_lines(result: Verification) -> list[tuple[str, Spread, Bounds, float]]:
    """Name with unit, summary in that unit, intervals in SI and the factor to that unit."""
    errors = result.evaluation.errors
    lines = [("position [mm]", errors.position_mm, result.position, MM.factor)]
    if errors.orientation_deg is not None and result.rotation is not None:
        lines.append(("orientation [°]", errors.orientation_deg, result.rotation, DEG.factor))
    return lines


def worst_first(result: Verification) -> list[RepeatedPose]:
    """Repeated poses, the least accurate first."""
    return sorted(result.repeated, key=lambda pose: -pose.accuracy)


def _repeats_table(result: Verification) -> RenderableType:
    table = REPEATED.table("ISO 9283", worst_first(result)[:LISTED])
    if (more := len(result.repeated) - LISTED) > 0:
        table.add_row(f"and {more} more", *[""] * 5)
    return table


def verification_json(result: Verification) -> Json:
    """The result as plain data."""
    wanted = result.wanted
    return document(
        SCHEMA,
        robot=result.robot.name,
        passed=result.passed,
        verdict=result.verdict,
        wanted=wanted and wanted.json(),
        rows=len(result.within),
        poses=result.poses,
        errors=errors_json(result.evaluation.errors),
        confidence=CONFIDENCE,
        intervals={
            "position_mm": _bounds(result.position, MM),
            "orientation_deg": result.rotation and _bounds(result.rotation, DEG),
        },
        share_within_at_least=None if wanted is None else result.minimum_share,
        iso9283=REPEATED.each(result.repeated),
        failed_rows=result.data.row[~result.within],
        facts=result.facts,
        warnings=result.warnings,
        notes=result.evaluation.notes,
    )


def _bounds(bounds: Bounds, unit: Unit) -> Json:
    mean, rms, maximum = map(unit.of, bounds)
    return {"mean": mean, "rms": rms, "share": BOUNDED_SHARE, "share_within": maximum}


@plot_of.register(Verification)
def _figure(result: Verification) -> "Figure":
    from workbench.extras.service.verification.plots import error_figure

    return error_figure(result)
