"""A verification as tables and plain data: the schema `workbench.verification/1`."""

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.text import Text

from workbench.extras.service.verification.intervals import CONFIDENCE, SHARE, Bounds
from workbench.extras.service.verification.iso9283 import RepeatedPose
from workbench.extras.service.verification.verify import Verification
from workbench.identification.errors.row_errors import Spread
from workbench.identification.report.results_json import errors_json
from workbench.report.json import Json, plain
from workbench.report.numbers import short, signed
from workbench.report.tables import line, new_table

SCHEMA = "workbench.verification/1"
LISTED = 10
"""Repeated poses that a table names one by one, the least accurate first."""
REPEATS = ("rows", "visits", "AP [mm]", "RP [mm]", "AP a b c [°]", "RP a b c [±°]")
DEG = np.rad2deg(1.0)


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
    lines = [("position [mm]", errors.position_mm, result.position, 1e3)]
    if errors.orientation_deg is not None and result.rotation is not None:
        lines.append(("orientation [°]", errors.orientation_deg, result.rotation, DEG))
    return lines


def worst_first(result: Verification) -> list[RepeatedPose]:
    """Repeated poses, the least accurate first."""
    return sorted(result.repeated, key=lambda pose: -pose.accuracy)


def repeat_cells(pose: RepeatedPose) -> tuple[str, ...]:
    """Cells of a repeated pose, as `REPEATS` names them."""
    named = f"{pose.rows[0]}, {pose.rows[1]}" if pose.visits == 2 else f"{pose.rows[0]} …"
    angles = [
        " ".join(signed(v, 3) for v in (DEG * values).tolist())
        for values in (pose.angle_accuracy, pose.angle_repeatability)
    ]
    if not np.isfinite(pose.angle_accuracy).all():
        angles = ["–", "–"]
    return named, str(pose.visits), short(1e3 * pose.accuracy), short(1e3 * pose.repeatability), *angles


def _repeats_table(result: Verification) -> RenderableType:
    table = new_table("ISO 9283", *REPEATS)
    for pose in worst_first(result)[:LISTED]:
        table.add_row(*repeat_cells(pose))
    if (more := len(result.repeated) - LISTED) > 0:
        table.add_row(f"and {more} more", *[""] * 5)
    return table


def verification_json(result: Verification) -> Json:
    """The result as plain data."""
    wanted = result.wanted
    return plain(
        {
            "schema": SCHEMA,
            "robot": result.robot.name,
            "passed": result.passed,
            "verdict": result.verdict,
            "wanted": wanted and wanted.json(),
            "rows": len(result.within),
            "poses": result.poses,
            "errors": errors_json(result.evaluation.errors),
            "confidence": CONFIDENCE,
            "intervals": {
                "position_mm": _bounds(result.position, 1e3),
                "orientation_deg": None if result.rotation is None else _bounds(result.rotation, DEG),
            },
            "share_within_at_least": None if wanted is None else result.minimum_share,
            "iso9283": [
                {
                    "rows": pose.rows,
                    "visits": pose.visits,
                    "AP_mm": 1e3 * pose.accuracy,
                    "RP_mm": 1e3 * pose.repeatability,
                    "AP_abc_deg": DEG * pose.angle_accuracy,
                    "RP_abc_deg": DEG * pose.angle_repeatability,
                }
                for pose in result.repeated
            ],
            "failed_rows": result.data.row[~result.within],
            "facts": result.facts,
            "warnings": list(result.warnings),
            "notes": list(result.evaluation.notes),
        }
    )


def _bounds(bounds: Bounds, scale: float) -> Json:
    return {
        "mean": [scale * v for v in bounds.mean],
        "rms": [scale * v for v in bounds.rms],
        "share": SHARE,
        "share_within": scale * bounds.maximum,
    }
