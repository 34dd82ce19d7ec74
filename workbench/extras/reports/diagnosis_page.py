"""The report of a diagnosis: a self-contained HTML page, its figures as files, and the result."""

from pathlib import Path
from typing import Any

from markupsafe import Markup

from workbench.base.advice import ask, failures
from workbench.base.files import check_folder
from workbench.base.progress import progress
from workbench.base.wording import plural
from workbench.diagnosis.claims.cause import Cause
from workbench.diagnosis.report.budget import budget_bars
from workbench.diagnosis.report.results_json import diagnosis_json
from workbench.diagnosis.report.table import (
    EXPLAINS,
    Units,
    alternatives,
    contributions,
    error_units,
    errors_without_and_with,
    joint_headings,
    joint_noise_text,
    lines,
    next_rows,
    odds_text,
    outlier_text,
)
from workbench.diagnosis.result import Diagnosis, judged
from workbench.diagnosis.verdict import doubts
from workbench.extras.reports.diagnosis_figures import pictures
from workbench.identification.report.table import error_cards
from workbench.identification.result import error_rows
from workbench.report.figures import DrawnFigure, png
from workbench.report.html import write_page
from workbench.report.sections import sections_of

PAGE = "diagnosis.html"
RESULT = "diagnosis.json"
PICTURES = "diagnosis-"
"""Prefix of every figure's file name."""


def write_diagnosis(result: Diagnosis, folder: Path | str) -> Path:
    """Write `diagnosis.html`, its pictures as PNG files and `diagnosis.json`: all of them or nothing.

    An older report in the folder is replaced; other files in it stay.

    Args:
        folder: Made if it is not there.
    """
    check_folder(folder)
    wanted = pictures(result)
    drawings: list[DrawnFigure] = []
    files: dict[str, bytes] = {}
    with failures() as failed:
        for k, picture in enumerate(wanted):
            progress(0.9 * k / len(wanted), f"drawing: {picture.title}")
            if (drawn := ask(f"the picture “{picture.title}”", picture.drawn, None)) is not None:
                figure, drawing = drawn
                drawings.append(drawing)
                files[f"{PICTURES}{picture.name}.png"] = png(figure)
        progress(0.9, "writing the page")
        old = (p.name for p in Path(folder).glob(f"{PICTURES}*.png"))
        numbers, fields = diagnosis_json(result), _template_fields(result)
        fields["sections"], more = sections_of(result)
    fields["notes"] = (*result.warnings, *failed, *result.notes)
    path = write_page(
        folder,
        PAGE,
        drawings,
        numbers | more,
        numbers=RESULT,
        files=files,
        replaces=old,
        package="workbench.extras.reports",
        **fields,
    )
    progress(1.0, "done")
    return path


def _template_fields(result: Diagnosis) -> dict[str, Any]:
    return {
        "robot": result.robot.name,
        "verdict": result.verdict_text,
        "good": result.is_good,
        "message": result.message,
        "budget": Markup(budget_bars(result)),
        "causes": [_cause(c, error_units(result)) for c in result.causes],
        "explains": " ".join([EXPLAINS, *doubts(result.causes)]),
        "residual_map": result.residual_map.sentence if result.residual_map is not None else "",
        "effects": [_effect(result, k) for k in range(len(result.effects))],
        "units": [unit for _, unit in error_units(result)],
        "held_out": result.after.held_out is not None,
        "cards": error_cards(judged(result.before), judged(result.after)),
        "facts": _facts(result),
        "errors": error_rows(
            [
                ("Nominal", result.nominal),
                ("Geometry alone", result.before),
                ("With the effects", result.after),
            ]
        ),
        "turned": result.after.train.orientation_deg is not None,
        "alternatives": alternatives(result),
        "outliers": outlier_text(result) if len(result.outliers) else "",
        "next_headings": [*joint_headings(result), *(["what it determines"] if result.next_reasons else [])],
        "next_rows": next_rows(result) if result.worth_measuring else [],
        "notes": result.notes,
    }


def _cause(cause: Cause, units: Units) -> dict[str, object]:
    return {
        "label": cause.label,
        "words": cause.claim,
        "confidence": str(cause.confidence),
        "odds": odds_text(cause.odds),
        "explained": contributions(cause, units),
    }


def _effect(result: Diagnosis, place: int) -> dict[str, object]:
    found = result.effects[place]
    return {
        "label": found.effect.label,
        "words": found.text,
        "sizes": lines(found.effect, found.std, result.calibrated.chain),
        "errors": list(errors_without_and_with(found, error_units(result))),
    }


def _facts(result: Diagnosis) -> list[tuple[str, str]]:
    fitted = len(result.after_fit.problem.data)
    rows = f"{fitted} fitted, {len(result.held_out_data)} held out, {plural(len(result.outliers), 'outlier')}"
    shown = result.identification().best.saved.rows_text(result.final_fit.problem.data, "fitted row")
    facts = [
        ("Robot", f"{result.robot.name} ({result.robot.convention}, {result.robot.dof} joints)"),
        ("File", result.data.source),
        ("Rows", f"{rows}, {len(result.excluded)} excluded"),
        ("Remaining error", f"{result.noise.text} per axis"),
        ("Saved arm", f"mean error {result.saved_errors.text('mean')} on {shown}"),
    ]
    if result.known_noise is not None:
        facts.append(("Known noise", f"{result.known_noise.text} per axis"))
    if result.joint_noise is not None:
        facts.append(("Noise of joint readings", joint_noise_text(result)))
    return facts
