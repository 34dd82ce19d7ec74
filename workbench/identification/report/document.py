"""An identification and an evaluation as blocks, no wider than 80 columns in a terminal."""

from collections.abc import Iterable, Iterator

import numpy as np

from workbench.base.wording import plural
from workbench.data.accuracy_requirement import Wanted
from workbench.identification.errors.pass_or_fail import judge
from workbench.identification.errors.row_errors import AbstractValidation, Errors
from workbench.identification.fit import Fit
from workbench.identification.report.charts import before_after, constant_bars, row_chart
from workbench.identification.report.parameters import parameter_blocks
from workbench.identification.result import Evaluation, Identification, Run
from workbench.report.blocks import Block, ResultTable, Sentence, Tone, assembled, lines
from workbench.report.colours import CALIBRATED
from workbench.report.numbers import short
from workbench.report.result_display import blocks_of

KINDS = {
    "position_mm": ("mm", ("mean", "rms", "max")),
    "orientation_deg": ("°", ("mean", "rms", "max")),
    "tilt_deg": ("°", ("tilt rms",)),
    "own_size": ("", ("rms",)),
}
"""Unit and numbers of each kind of error."""
ONE_DECIMAL_FROM = 100.0
"""Errors above this have one decimal."""
MAX_EXCLUDED = 5
"""Excluded rows that are named."""


@blocks_of.register
def identification_blocks(result: Identification, *, wanted: Wanted | None = None) -> list[Block]:
    """Whether it keeps what was wanted, errors, parameters of the best fit, and all notes for the user."""

    def verdict(result: Identification) -> Iterator[Block]:
        if wanted is not None:
            yield Sentence(judge(result, wanted).verdict, tone=Tone.STRONG)

    return assembled(result, heading, verdict, models, row_errors, parameters, remarks)


def heading(result: Identification) -> Iterator[Block]:
    rows = f"{plural(len(result.train_rows), 'row')} fitted, {len(result.held_out_data)} held out"
    if result.excluded:
        rows += f", {len(result.excluded)} excluded"
    yield Sentence(f"{result.robot.name}: {rows}", tone=Tone.STRONG)


def models(result: Identification) -> Iterator[Block]:
    """Errors of the nominal arm and of what every algorithm found; a single one is not named."""
    runs = list(result.runs.values())
    found = [(run.fit.algorithm.title if len(runs) > 1 else "calibrated", run) for run in runs]
    yield errors_table([("nominal", result.nominal), *found])


def row_errors(result: Identification) -> Iterator[Block]:
    yield before_after(result)


def parameters(result: Identification) -> Iterator[Block]:
    yield from parameter_blocks(result.best.fit)
    yield constant_bars(result.best.fit)


def remarks(result: Identification) -> Iterator[Block]:
    """Unobservable combinations, warnings and decisions."""
    yield from lines("not identifiable", result.unidentifiable)
    yield from lines("warning", result.warnings)
    yield from lines("found", result.identifiability.found(result.best.fit))
    yield from lines("note", result.notes)
    if result.excluded:
        shown = ", ".join(f"row {row} ({reason})" for row, reason in result.excluded[:MAX_EXCLUDED])
        more = len(result.excluded) - MAX_EXCLUDED
        yield Sentence(shown + (f" and {more} more" if more > 0 else ""), "excluded")


@blocks_of.register
def fit_blocks(found: Fit | Run) -> Iterable[Block]:
    return parameter_blocks(found.fit if isinstance(found, Run) else found)


@blocks_of.register
def evaluation_blocks(result: Evaluation) -> list[Block]:
    """Errors of a given model, and the decisions taken."""
    table = table_of([(result.robot.name, f"{len(result.data.row)}", result.errors)])
    warnings = lines("warning", result.warnings)
    chart = row_chart([("", CALIBRATED, result.data.row, result.errors)], "by number")
    return [*warnings, table, chart, *lines("note", result.notes)]


def errors_table(models: Iterable[tuple[str, AbstractValidation]]) -> ResultTable:
    """Errors of several models on fitted and held-out rows, in mm and degrees."""
    return table_of(
        (title if rows == "fitted" else "", rows, errors)
        for title, validated in models
        for rows, errors in (("fitted", validated.train), ("held out", validated.held_out))
        if errors
    )


def table_of(found: Iterable[tuple[str, str, Errors]]) -> ResultTable:
    """Model, which rows, and their errors of every kind that was measured."""
    found = list(found)
    shown = [
        (kind, unit, name)
        for kind, (unit, names) in KINDS.items()
        if any(np.isfinite(_number(errors, kind, "mean")) for *_, errors in found)
        for name in names
    ]
    own = next((e.own.name.partition("[")[2].rstrip("]") for *_, e in found if e.own is not None), "")
    headings = ("model", "rows", *(f"{name}\n[{unit or own}]" for _, unit, name in shown))
    rows = []
    for title, which, errors in found:
        values = [_number(errors, kind, name.split()[-1]) for kind, _, name in shown]
        rows.append((title, which, *(short(v, 1 if v >= ONE_DECIMAL_FROM else 3) for v in values)))
    return ResultTable("", headings, rows, words=2)


def _number(errors: Errors, kind: str, name: str) -> float:
    return float(getattr(getattr(errors, kind), name, np.nan))
