"""A certificate on one page, to print on A4: what was verified, how, with what result, and by whom."""

import hashlib
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base.columns import Column, row_drivers
from workbench.base.errors import FileError
from workbench.base.installed_package import package_version
from workbench.base.wording import plural
from workbench.extras.service.verification.iso9283 import cycle_text
from workbench.extras.service.verification.plots import CAPTION, error_map
from workbench.extras.service.verification.report import REPEATED, error_lines, verification_json, worst_first
from workbench.extras.service.verification.result import Verification
from workbench.report.figures import DrawnFigure, svg
from workbench.report.html import write_page
from workbench.report.numbers import short

PAGE, MAP = "certificate.html", "error-map"
LISTED = 5
"""Repeated poses in the table: as many as the standard's cycle has."""
SIGNATURES = ("Measured by", "Approved by")


def _shown(result: Verification, inputs: Sequence[Path | str], day: date) -> dict[str, Any]:
    """What the page shows: names and texts in two columns, tables with their headings first, sentences."""
    data = result.data
    arm = [("Arm", f"{result.robot.name}, {result.robot.dof} joints"), *result.facts.items()]
    if (calibration := result.robot.calibration) is not None:
        arm.append(("Calibrated from", f"{calibration.source}, {plural(len(calibration.poses), 'row')}"))
    arm.append(("Measurements", f"{Path(data.source).name}, {plural(len(data), 'row')}"))
    return {
        "title": result.robot.name,
        "stamp": {True: "PASSED", False: "FAILED", None: "VERIFIED"}[result.passed],
        "passed": result.passed,
        "verdict": result.verdict,
        "arm": arm,
        "conditions": _conditions(result),
        "errors": _errors(result),
        "repeats": _repeats(result),
        "method": _method(result),
        "warnings": result.warnings,
        "inputs": [(Path(path).name, _sha256(Path(path))) for path in inputs],
        "made": f"{day.isoformat()}, workbench {package_version()}",
    }


def write_certificate(
    result: Verification, folder: Path | str, *, inputs: Sequence[Path | str] = (), day: date | None = None
) -> Path:
    """Write page, picture and numbers into a folder, and return the path of the page.

    Args:
        inputs: Files whose sha256 is given.
        day: Of the certificate; today if None.
    """
    drawing = DrawnFigure(MAP, "Where the errors are", CAPTION, svg(error_map(result), MAP))
    shown = _shown(result, inputs, day or date.today())
    return write_page(
        folder,
        PAGE,
        [drawing],
        verification_json(result),
        package=__package__,
        c=shown,
        signatures=SIGNATURES,
    )


def _conditions(result: Verification) -> list[tuple[str, str]]:
    data = result.data
    rows = [("Poses", f"{result.poses} different, none of them used for the calibration")]
    if result.robot.calibration is None:
        rows = [("Poses", f"{result.poses} different")]
    if len(data.sessions) > 1:
        rows.append(("Placements", f"{len(data.sessions)}: {', '.join(map(str, data.sessions))}"))
    for name, column in row_drivers().items():
        values = data.column(name)
        if values is not None and np.isfinite(values).any():
            rows.append(_range(column, values))
    wanted = "no limit was given" if result.wanted is None else f"at most {result.wanted.text} at every pose"
    return [*rows, ("Wanted", wanted)]


def _range(column: Column, values: np.ndarray) -> tuple[str, str]:
    """What drove the arm, from where to where; of times, how long."""
    if column.name == "time":
        return "Duration", f"{float(np.nanmax(values) - np.nanmin(values)) / 3600.0:.3g} h"
    low, high = (column.shown[1] * float(bound) for bound in (np.nanmin(values), np.nanmax(values)))
    span = f"{low:.3g}" if high - low < 1e-9 else f"{low:.3g} to {high:.3g}"
    return column.name.capitalize(), f"{span} {column.unit}"


def _errors(result: Verification) -> list[tuple[str, ...]]:
    lines: list[tuple[str, ...]] = [("Error", "mean", "95 % interval", "rms", "largest", "95 % of all poses")]
    for name, spread, bounds, scale in error_lines(result):
        interval = f"{short(scale * bounds.mean.low)} … {short(scale * bounds.mean.high)}"
        maximum = f"≤ {short(scale * bounds.maximum)}" if np.isfinite(bounds.maximum) else "too few poses"
        lines.append((name, short(spread.mean), interval, short(spread.rms), short(spread.max), maximum))
    return lines


def _repeats(result: Verification) -> list[tuple[str, ...]]:
    if not result.repeated:
        return []
    cells = (tuple(REPEATED.cells(pose)) for pose in worst_first(result)[:LISTED])
    return [("ISO 9283: rows", *REPEATED.headings[1:]), *cells]


def _method(result: Verification) -> list[str]:
    sentences = [
        "Method: an error is the distance between the measured tool point and the one that the calibrated "
        "model computes from the joint positions; orientation, the angle between both. Intervals of means "
        "are bootstrapped over poses; the bound of 95 % of all poses holds with 95 % confidence whatever the "
        "errors' distribution.",
        f"Repeatability: {cycle_text(result.repeated)}.",
    ]
    if result.repeated:
        sentences[1] += (
            f" Visits are rows whose joints agree within {np.rad2deg(result.same):.2g}°; AP: barycentre "
            "of the visits against the command pose; RP: mean + 3 S of their distances from it."
        )
        if (more := len(result.repeated) - LISTED) > 0:
            sentences[1] += f" The least accurate {LISTED} are listed, {more} more are in the result file."
    return sentences


def _sha256(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise FileError(error.strerror or "can't be read", path=str(path)) from None
