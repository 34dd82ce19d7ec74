"""Machine-readable results: the schemas `workbench.identification/1` and `workbench.evaluation/1`.

Only finite numbers are written; unknown ones (the orientation of point data, the standard error of an
unobservable parameter) are null.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from workbench.arm.robot import Robot
from workbench.base.advice import ask
from workbench.data.accuracy_requirement import Wanted
from workbench.data.dataset import Dataset
from workbench.identification.errors.row_errors import TOOL, AbstractValidation, Errors
from workbench.identification.meaning.nominal_fit import near_readings
from workbench.identification.report.document import IDENTIFIED, identification_blocks, identified
from workbench.identification.result import Evaluation, Identification
from workbench.identification.run import Run
from workbench.report.blocks import Block
from workbench.report.json import Json, document
from workbench.report.page import write_page

IDENTIFICATION = "workbench.identification/1"
EVALUATION = "workbench.evaluation/1"
NEAR = ("margin", "alike", "blind")


def reading_json(data: Dataset, robot: Robot | None = None) -> Json:
    """What rows were taken to mean, how many times worse the next reading fits an arm, and which others move
    it alike, give the same points, or can't be told from it by these rows."""
    near = ask("what else rows mean", lambda: None if robot is None else near_readings(robot, data), None)
    told = {f"reading_{k}": getattr(near, k, None) for k in NEAR}
    left = None if near is None else [reading.text for reading in near.open]
    return {"reading": data.read_as or "as given", **told, "reading_open": left}


def identification_json(result: Identification) -> Json:
    """The result of an identification as plain data."""
    known, fit = result.identifiability, result.best.fit
    return document(
        IDENTIFICATION,
        robot=result.robot.name,
        **reading_json(result.data, result.nominal_robot),
        measurements=lambda: {
            "used": len(result.train_rows),
            "held_out": len(result.held_out_data),
            "held_out_rows": result.held_out_data.place,
            "excluded": excluded_json(result.excluded, result.data),
            "outliers": result.data.places(outlier.row for outlier in result.outliers),
            "suspects": result.data.places(result.suspects),
            "source": result.data.source,
        },
        nominal=lambda: validation_json(result.nominal),
        algorithms=lambda: {name: _run(run) for name, run in result.runs.items()},
        unidentifiable=lambda: list(result.unidentifiable),
        warnings=lambda: list(result.warnings),
        notes=list(result.notes),
        noise=lambda: result.noise.json(),
        expected_deviation=fit.problem.deviation,
        **ask("what may be identified", lambda: known.json(fit), {}),
    )


def write_identification(
    result: Identification, folder: Path | str, *, wanted: Wanted | None = None, first: Sequence[Block] = ()
) -> Path:
    """Write `report.html` and `result.json` into a folder, which is made if it is not there: both or nothing.

    Args:
        wanted: Required error of every pose; no verdict if None.
        first: What the page begins with.
    """
    title, names = f"{result.robot.name}: {result.data.source}", ("report.html", "result.json")
    blocks, plain = [*first, *identification_blocks(result, wanted=wanted)], identification_json(result)
    return write_page(folder, names, blocks, plain, title=title, kind="Identification")


def evaluation_json(result: Evaluation) -> Json:
    """The result of an evaluation as plain data."""
    errors = result.errors
    each = zip(result.data.place, 1e3 * errors.position, np.rad2deg(errors.rotation), strict=True)
    return document(
        EVALUATION,
        robot=result.robot.name,
        **reading_json(result.data, result.robot),
        errors=errors_json(errors),
        rows=[{"row": row, "position_mm": off, "orientation_deg": turned} for row, off, turned in each],
        notes=[*result.warnings, *result.notes],
    )


def excluded_json(excluded: Sequence[tuple[int, str]], data: Dataset) -> list[Json]:
    """Rows of data that were excluded, counted from 0, each with the reason."""
    rows = data.places(row for row, _ in excluded)
    return [{"row": row, "reason": reason} for row, (_, reason) in zip(rows, excluded, strict=True)]


def errors_json(errors: Errors | None) -> Json | None:
    """Object `E` of formats.md; None without rows."""
    if not errors:
        return None
    return dict.fromkeys(TOOL) | {name: spread._asdict() for name, spread in errors.spreads.items()}


def validation_json(validation: AbstractValidation) -> Json:
    """Errors on the fitted and on the held-out rows."""
    return {"train": errors_json(validation.train), "held_out": errors_json(validation.held_out)}


def _run(run: Run) -> Json:
    fit = run.fit
    return {
        **validation_json(run),
        "converged": fit.outcome.ok,
        "outcome": str(fit.outcome),
        "iterations": fit.iterations,
        "seconds": fit.seconds,
        "condition": fit.rows_factor.condition,
        "parameters": IDENTIFIED.each(identified(fit)),
        "implausible": list(run.implausible),
    }
