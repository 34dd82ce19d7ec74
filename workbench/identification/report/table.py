"""Tables for the terminal, no wider than 80 columns.

Functions return what `rich` can print:

    rich.print(identification_tables(result))
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from workbench.base.advice import beside
from workbench.base.wording import plural
from workbench.identification.errors.row_errors import Errors, Spread
from workbench.identification.fit import Fit
from workbench.identification.report.parameters import LEGEND, Cell, ConstantStatus, parameter_table
from workbench.identification.result import (
    Evaluation,
    Identification,
    Run,
    Validation,
    error_rows,
    order_of_measuring,
)
from workbench.report.numbers import factor, short
from workbench.report.result_display import plot_of, summary_of
from workbench.report.tables import folded, line, new_table, unbroken

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLES = {
    ConstantStatus.IDENTIFIED: "",
    ConstantStatus.HELD: "dim",
    ConstantStatus.SHARED: "yellow",
    ConstantStatus.UNSEEN: "dim",
}
AXES = ("x", "y", "z")
COLUMNS = {
    "position_mm": ("mm", ("mean", "rms", "max")),
    "orientation_deg": ("°", ("mean", "rms", "max")),
    "tilt_deg": ("°", ("tilt rms",)),
    "own": ("", ("rms",)),
}
"""Unit and numbers of each kind of error."""
ONE_DECIMAL_FROM = 100.0
"""Errors above this have one decimal."""
NARROW_FROM = 6
"""Number of columns above which the padding is reduced to fit 80 characters."""


def identification_tables(
    result: Identification, *, parameters: bool = True, every: bool = False
) -> RenderableType:
    """Errors, parameters of the best fit, and all notes for the user.

    Args:
        parameters: Whether to show the parameter table as well.
        every: Whether to show all algorithms, not only those with different results.
    """
    parts: list[RenderableType] = [Text(heading(result), style="bold"), errors_table(result, every=every)]
    if parameters:
        parts.append(parameters_tables(result.best.fit))
    parts += messages(result)
    return Group(*parts)


@beside("the heading", "")
def heading(result: Identification) -> str:
    rows = f"{plural(len(result.train_rows), 'row')} fitted, {len(result.held_out_data)} held out"
    if result.excluded:
        rows += f", {len(result.excluded)} excluded"
    return f"{result.robot.name}: {rows}"


def errors_table(result: Identification, *, every: bool = False) -> Table:
    """Nominal and calibrated arm on training and held-out rows, in mm and degrees."""
    return models_table([("nominal", result.nominal), *(result.models if every else _calibrated(result))])


def _calibrated(result: Identification) -> list[tuple[str, Run]]:
    """The arms that differ; a single one is not labelled with its algorithm."""
    found = result.distinct
    return found if len(found) > 1 else [("calibrated", found[0][1])]


@beside("the table of errors", Group())
def models_table(models: Sequence[tuple[str, Validation | Run]]) -> Table:
    """Errors of several models on fitted and held-out rows."""
    lines = error_rows(models)
    kinds, table = error_columns([errors for *_, errors in lines])
    for title, rows, errors in lines:
        if title:
            table.add_section()
        table.add_row(title, rows, *error_cells(errors, kinds))
    return table


@summary_of.register
def identification_summary(result: Identification) -> RenderableType:
    return identification_tables(result, parameters=False)


@summary_of.register
def evaluation_tables(result: Evaluation) -> RenderableType:
    """Errors of a given model, and the decisions taken."""
    kinds, table = error_columns([result.errors])
    table.add_row(escape(result.robot.name), f"{len(result.row_numbers)}", *error_cells(result.errors, kinds))
    return Group(table, *(line("note", note) for note in result.notes))


@summary_of.register
@beside("the table of parameters", Group())
def parameters_tables(fit: Fit) -> RenderableType:
    """The joint table of the paper (Tables 3, 4) with nominal values and standard errors; then the frames."""
    content = parameter_table(fit)
    parts: list[RenderableType] = []
    if content.rows:
        table = new_table(
            f"Arm: deviations from nominal ({fit.title})", unbroken("joint"), unbroken(""), *content.headings
        )
        table.padding = (0, 1, 0, 0)
        for joint, cells in content.rows:
            label = joint.removeprefix("joint")
            for k, which in enumerate(("nominal", "deviation", "±")):
                row = [_cell_line(cell, k) for cell in cells]
                table.add_row(escape(label) if k == 0 else "", which, *row, end_section=k == 2)
        parts.append(table)
    if content.others:
        headings = (folded("parameter"), "nominal", "deviation", "±", unbroken(""))
        table = new_table("Frames and instrument", *headings)
        for cell in content.others:
            values = [_cell_line(cell, k) for k in range(3)]
            table.add_row(escape(cell.name), *values, cell.readable_unit)
        parts.append(table)
    parts += [Text(f"{mark} {LEGEND[mark]}", style="dim") for mark in content.marks]
    return Group(*parts)


@beside("notes and warnings", [])
def messages(result: Identification) -> list[RenderableType]:
    """Unobservable combinations, warnings and decisions, one line each."""
    lines: list[RenderableType] = [line("not identifiable", sentence) for sentence in result.unidentifiable]
    lines += [line("warning", sentence) for sentence in result.warnings]
    if result.identifiability is not None:
        lines += [line("found", text) for text in result.identifiability.found(result.best.fit)]
    lines += [line("note", sentence) for sentence in result.notes]
    if result.excluded:
        shown = ", ".join(f"row {row} ({reason})" for row, reason in result.excluded[:5])
        more = len(result.excluded) - 5
        lines.append(line("excluded", shown + (f" and {more} more" if more > 0 else "")))
    return lines


def error_columns(found: Sequence[Errors]) -> tuple[list[str], Table]:
    """The kinds of error that were measured, and an empty table with columns for them."""
    kinds = [kind for kind in COLUMNS if any(_is_measured(getattr(errors, kind)) for errors in found)]
    own = next((errors.own_name.partition("[")[2].rstrip("]") for errors in found if errors.own_name), "")
    headings = [f"{n}\n[{unit or own}]" for kind in kinds for unit, names in [COLUMNS[kind]] for n in names]
    table = new_table("", unbroken("model"), unbroken("rows"), *headings)
    if len(headings) > NARROW_FROM:
        table.padding = (0, 1, 0, 0)
    return kinds, table


def error_cells(errors: Errors, kinds: Sequence[str]) -> list[str]:
    cells = []
    for kind in kinds:
        spread, names = getattr(errors, kind), COLUMNS[kind][1]
        found = [getattr(spread, name.split()[-1]) if _is_measured(spread) else np.nan for name in names]
        cells += [short(value, 1 if value >= ONE_DECIMAL_FROM else 3) for value in found]
    return cells


def _is_measured(spread: Spread | None) -> bool:
    return spread is not None and not np.isnan(spread.mean)


def _cell_line(cell: Cell | None, which: int) -> Text:
    """Nominal value (0), deviation (1) or standard error (2) of a constant."""
    if cell is None:
        return Text("")
    text = cell.shown[which]
    if which == 1:
        return Text(text + (cell.state or " "), style=STYLES[cell.state] or "bold")
    return Text(text + " " if text else "", style="dim")


def error_cards(before: Errors, after: Errors) -> list[dict[str, str]]:
    """Cards at the top of the page: mean and maximum errors before and after."""
    cards = []
    for what, unit, old, new in (
        ("position error", " mm", before.position_mm, after.position_mm),
        ("orientation error", "°", before.orientation_deg, after.orientation_deg),
        ("inclinometer error", "°", before.tilt_deg, after.tilt_deg),
    ):
        if old is None or new is None or np.isnan(new.mean):
            continue
        for name in ("mean", "max"):
            a, b = getattr(old, name), getattr(new, name)
            label = f"{'Mean' if name == 'mean' else 'Maximum'} {what}"
            cards.append(
                {"label": label, "unit": unit, "before": short(a), "after": short(b), "factor": factor(a, b)}
            )
    return cards


@plot_of.register(Evaluation)
def _figure(result: Evaluation) -> "Figure":
    from workbench.identification.report.error_plots import evaluation_figure

    return evaluation_figure(result)


@plot_of.register(Identification)
def _before_and_after(result: Identification) -> "Figure":
    from workbench.identification.report.error_plots import before_after

    return before_after(result, order_of_measuring(result))
