"""A diagnosis in the terminal: verdict, errors, effects, alternatives, outliers, what to measure next.

rich.print(diagnosis_tables(result))
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Column, Table
from rich.text import Text

from workbench.arm.chain import Chain
from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.effect import MIN_STATED_ERRORS
from workbench.arm.joint_units import shown_joints, shown_units
from workbench.base.advice import beside
from workbench.base.errors import DataError
from workbench.base.wording import first_of, plural
from workbench.diagnosis.claims.cause import Cause
from workbench.diagnosis.result import Accepted, Diagnosis, Ranked, Verdict, judged
from workbench.diagnosis.verdict import MAX_STATED_CAUSES
from workbench.identification.errors.row_errors import Errors
from workbench.identification.report.table import models_table
from workbench.report.numbers import readable_unit, short, with_error
from workbench.report.result_display import plot_of, summary_of
from workbench.report.tables import folded, line, new_table, unbroken

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLES = {Verdict.EXPLAINED: "bold green", Verdict.NO_EFFECT: "bold", Verdict.PARTLY: "bold yellow"}
MAX_NAMED_OUTLIERS = 15
"""Maximum number of outliers named."""
MAX_LISTED_COEFFICIENTS = 6
"""Maximum number of coefficients of one effect listed individually."""
SUMMARY_CANDIDATES = 5
"""Number of candidates in a summary."""
Units = Sequence[tuple[str, str]]
"""Names of errors and their units: of what was measured."""
EXPLAINS = (
    "explains: √(e₁² − e₂²), e₁ and e₂ the cross-validated rms errors without and with the cause. "
    "Odds are against the best alternative, at most 20 : 1 while a doubt remains."
)
UNLIKELY = float(np.log(1e6))
"""Logarithm of the odds against an alternative beyond which it is none."""


def diagnosis_tables(result: Diagnosis) -> RenderableType:
    """Everything that a diagnosis found, the verdict first."""
    parts = _beginning(result)
    if result.causes:
        parts += [causes_table(result), Text(EXPLAINS, style="dim")]
        parts += [line("cause", cause.stated) for cause in result.causes[MAX_STATED_CAUSES:]]
    if result.effects:
        parts.append(effects_table(result))
        mapped = [found for found in result.effects if not _is_claimed(result, found.effect)]
        parts += [line("in the map", found.text) for found in mapped]
    parts += _alternatives(result)
    if len(result.outliers):
        parts.append(line("outliers", outlier_text(result)))
    if result.joint_noise is not None:
        parts.append(line("noise of joint readings", joint_noise_text(result)))
    if result.worth_measuring:
        parts.append(next_table(result))
    parts += [line("warning", text) for text in result.warnings]
    parts += [line("note", text) for text in result.notes]
    return Group(*parts)


@summary_of.register
def summary(result: Diagnosis) -> RenderableType:
    """The verdict, errors before and after, and the contribution of each candidate."""
    ranking = [ranking_table(result)] if result.ranking else []
    warnings = [line("warning", text) for text in result.warnings]
    return Group(*_beginning(result), *ranking, *_alternatives(result), *warnings)


@beside("the noise of joint readings", "–")
def joint_noise_text(result: Diagnosis) -> str:
    """Size of the noise of joint readings and its share of the remaining error; – for exact readings."""
    found = result.joint_noise
    if found is None:
        return "–"
    return f"{found.text(result.calibrated.chain)}, {100 * found.share:.0f} % of the remaining error"


@beside("the verdict with its errors", [])
def _beginning(result: Diagnosis) -> list[RenderableType]:
    """Robot and rows, verdict, errors before and after."""
    style = STYLES.get(result.verdict, "bold red")
    if result.verdict in (Verdict.EXPLAINED, Verdict.NO_EFFECT) and not result.is_good:
        style = STYLES[Verdict.PARTLY]
    verdict = Text(f"{result.verdict_text}: {result.message}", style=style)
    return [Text(heading(result), style="bold"), verdict, errors_table(result)]


def _alternatives(result: Diagnosis) -> list[Text]:
    return [Text(text, style="dim") for text in alternatives(result)]


def ranking_table(result: Diagnosis) -> Table:
    """The candidates with the largest contributions to the geometry alone."""
    added = {(found.effect.name, found.effect.names) for found in result.effects}
    headings = ("gain\n[nat]", "mean\n[mm]", "")
    table = new_table("What each candidate would add to the geometry alone", "effect", *headings)
    for candidate in result.ranking[:SUMMARY_CANDIDATES]:
        mean = "–" if candidate.held_out_mm is None else short(candidate.held_out_mm)
        is_added = (candidate.effect.name, candidate.effect.names) in added
        table.add_row(
            candidate.effect.label,
            f"{candidate.gain:.1f}".replace("-", "−"),
            mean,
            "added" if is_added else "",
        )
    return table


@beside("the heading", "")
def heading(result: Diagnosis) -> str:
    fitted = len(result.after_fit.problem.data)
    rows = f"{fitted} rows fitted, {len(result.held_out_data)} held out"
    if len(result.outliers):
        rows += f", {plural(len(result.outliers), 'outlier')}"
    if result.excluded:
        rows += f", {len(result.excluded)} excluded"
    return f"{result.robot.name}: {rows}"


@beside("the table of errors", Group())
def errors_table(result: Diagnosis) -> Table:
    """Nominal arm, geometry alone, and with the effects, on fitted and held-out rows."""
    models = [("nominal", result.nominal), ("geometry", result.before)]
    if result.effects:
        models.append(("with effects", result.after))
    return models_table(models)


@beside("the table of causes", Group())
def causes_table(result: Diagnosis) -> Table:
    """Claimed causes with their confidence and what they explain."""
    headings = [f"explains\n[{unit}]" for _, unit in error_units(result)]
    table = new_table("Causes", folded("cause"), unbroken("confidence"), "odds", *headings)
    for cause in result.causes:
        sizes = contributions(cause, error_units(result))
        table.add_row(cause.label, str(cause.confidence), odds_text(cause.odds), *sizes)
    return table


def contributions(cause: Cause, units: Units) -> list[str]:
    """What a cause explains, unit by unit; – where unknown."""
    return [short(v) for v, _ in zip((cause.contribution_mm, cause.contribution_deg), units, strict=False)]


def odds_text(odds: float) -> str:
    """`340 : 1`, at most a million."""
    return "> 10⁶ : 1" if odds > 1e6 else f"{odds:.0f} : 1"


@beside("the table of effects", Group())
def effects_table(result: Diagnosis) -> Table:
    """Added effects with coefficients ± standard errors, and the mean error without and with each."""
    rows = "held-out" if result.after.held_out is not None else "fitted"
    title = f"Added effects; mean error of {rows} rows without each one and with all"
    units = error_units(result)
    headings = [f"{which}\n[{unit}]" for _, unit in units for which in ("without", "with")]
    table = new_table(title, folded("effect"), folded("coefficients"), *headings)
    for found in result.effects:
        sizes = lines(found.effect, found.std, result.calibrated.chain)
        text = "\n".join(f"{name} {size}" for name, size in sizes)
        table.add_row(found.effect.label, text, *errors_without_and_with(found, units))
    return table


def error_units(result: Diagnosis) -> Units:
    """Position error in mm, and orientation error in degrees if measured."""
    turned = judged(result.after).orientation_deg is not None
    return [("position_mm", "mm"), *([("orientation_deg", "°")] if turned else [])]


def errors_without_and_with(found: Accepted, units: Units) -> Iterator[str]:
    """Mean errors without an effect and with all, unit by unit."""
    for name, _ in units:
        for errors in (found.before, found.after):
            spread = getattr(errors, name)
            yield "–" if spread is None else short(spread.mean)


@beside("which effects are causes", False)
def _is_claimed(result: Diagnosis, effect: AbstractEffect) -> bool:
    """Whether an effect of the model belongs to a cause rather than to the map."""
    causes = [c for c in result.causes if c.kind == effect.name]  # a cause names only its significant joints
    return any(set(c.joints) & set(effect.joints) or not effect.joints for c in causes)


@beside("alternatives", [])
def alternatives(result: Diagnosis) -> list[str]:
    """Alternatives that fit nearly as well as each effect, one line each."""
    sentences = (_instead(found) for found in result.effects)
    return [text for text in sentences if text]


def nearly_as_good(found: Accepted) -> list[Ranked]:
    """Alternatives to an effect: odds below a million to one, and better than no effect."""
    near = [r for r in found.alternatives if found.gain - r.gain <= UNLIKELY]
    return [r for r in near if r.held_out_mm is None or not r.held_out_mm > found.before.position_mm.mean]


def _instead(found: Accepted) -> str:
    """Alternatives to one effect; empty if there are none."""

    def sized(label: str, errors: Errors | None) -> str:
        size = "" if errors is None else errors.text("mean")
        return f"{label} ({size})" if size else label

    rivals = "; ".join(sized(r.effect.label, r.errors) for r in nearly_as_good(found))
    return f"Alternatives to {sized(found.effect.phrase, found.after)}: {rivals}" if rivals else ""


@beside("the text on outliers", "")
def outlier_text(result: Diagnosis) -> str:
    """Which rows were excluded as outliers, how far they are off, and what to do."""
    rows = sorted(result.data.row[result.outliers].tolist())
    shown = first_of(rows, MAX_NAMED_OUTLIERS)
    subject, it = (f"data rows {shown}", "them") if len(rows) > 1 else (f"data row {shown}", "it")
    off = result.outlier_errors.text("max") if result.outlier_errors is not None else ""
    up_to, mean = "up to " if len(rows) > 1 else "", result.after.train.text("mean")
    size = f"{up_to}{off} off, where the others' mean is {mean}; " if off else ""
    return f"{subject}: {size}no model of the arm explains {it}; measure {it} again, or exclude {it}"


@beside("the table of poses to measure next", Group())
def next_table(result: Diagnosis) -> Table:
    """Joint positions of poses to measure next."""
    reasons = [Column("what it determines")] if result.next_reasons else []
    table = new_table("Measure next", unbroken("pose"), *joint_headings(result), *reasons)
    for k, cells in enumerate(next_rows(result), 1):
        table.add_row(str(k), *map(escape, cells))
    return table


def joint_headings(result: Diagnosis) -> list[str]:
    """Headings of joint positions in degrees or mm."""
    return [f"q{j} [{unit.strip()}]" for j, unit in enumerate(shown_units(result.calibrated), 1)]


def next_rows(result: Diagnosis) -> list[list[str]]:
    """Joint positions of poses to measure next, and what each determines."""
    reasons = [[reason.sentence] for reason in result.next_reasons] or [[]] * len(result.measure_next)
    return [
        [*(f"{v:.1f}".replace("-", "−") for v in q), *why]
        for q, why in zip(shown_joints(result.calibrated, result.measure_next), reasons, strict=True)
    ]


@dataclass(frozen=True)
class Size:
    """One coefficient.

    Args:
        name: Such as `joint3.compliance`.
        value: In this unit.
        std: Standard error, likewise.
    """

    name: str
    value: float
    std: float
    unit: str

    @property
    def text(self) -> str:
        """Such as `0.0412 ± 0.0003 mrad/(N·m)`, to two digits of the standard error."""
        return f"{with_error(self.value, self.std)} {self.unit}"


def sizes(effect: AbstractEffect, std: tuple[float, ...], chain: Chain) -> tuple[Size, ...]:
    """Every coefficient of an effect with its standard error, in readable units."""
    units = [readable_unit(unit) for unit in effect.units(chain)]
    return tuple(
        Size(name, value * factor, error * factor, unit)
        for name, value, error, (factor, unit) in zip(
            effect.names, effect.coefficients, std, units, strict=True
        )
    )


def lines(effect: AbstractEffect, std: tuple[float, ...], chain: Chain) -> tuple[tuple[str, str], ...]:
    """Names and values for a table, by joint if there is one each; of many only the most significant."""
    found = sizes(effect, std, chain)
    alone, one_each = len(effect.joints) == 1, len(effect.joints) == len(found) > 1
    if len(found) <= MAX_LISTED_COEFFICIENTS:
        names = [
            size.name.partition(".")[0 if one_each else 2] if alone or one_each else size.name
            for size in found
        ]
        return tuple((name, size.text) for name, size in zip(names, found, strict=True))
    clearest = max(found, key=lambda size: abs(size.value) / size.std if size.std > 0.0 else 0.0)
    if abs(clearest.value) < MIN_STATED_ERRORS * clearest.std:
        return ((f"{len(found)} coefficients", "none of them individually significant"),)
    return ((f"{len(found)} coefficients, largest {clearest.name.partition('.')[2]}", clearest.text),)


@plot_of.register(Diagnosis)
def _candidates(result: Diagnosis) -> "Figure":
    from workbench.diagnosis.report.ranking import ranking

    if (drawn := ranking(result)) is None:
        raise DataError("no effect was tried, so there is nothing to draw")
    return drawn
