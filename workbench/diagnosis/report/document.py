"""A diagnosis as blocks: verdict, errors, causes, effects, what to measure next, remarks."""

from collections.abc import Iterator

import numpy as np

from workbench.arm.chain import Chain
from workbench.arm.effects import AbstractEffect
from workbench.arm.joint_units import shown_joints, shown_units
from workbench.base.wording import capital, first_of, plural
from workbench.diagnosis.confidence import Confidence
from workbench.diagnosis.result import Diagnosis, Verdict
from workbench.diagnosis.verdict import MAX_STATED_CAUSES
from workbench.identification.report.document import errors_table, row_errors
from workbench.report.blocks import Block, ResultTable, Sentence, Tone, assembled, lines
from workbench.report.chart import Bar, Bars
from workbench.report.colours import CALIBRATED, NOMINAL, UNNAMED
from workbench.report.numbers import compared, readable_unit, short, signed, with_error
from workbench.report.result_display import blocks_of

TONES = {Verdict.EXPLAINED: Tone.GOOD, Verdict.NO_EFFECT: Tone.STRONG, Verdict.PARTLY: Tone.CAREFUL}
SAID, LEARNED = {Confidence.OPEN: "one of several"}, "Learned correction"
"""Beside a bar, in place of a confidence; and a bar without a cause."""
MAX_NAMED_OUTLIERS, MAX_LISTED_COEFFICIENTS = 15, 6
"""Outliers that are named, and coefficients of one effect that are listed, at most."""
EXPLAINS = (
    "explains: √(e₁² − e₂²), e₁ and e₂ the cross-validated rms errors without and with the cause. "
    "Odds are against the best alternative, at most 20 : 1 while a doubt remains."
)


@blocks_of.register
def diagnosis_blocks(result: Diagnosis) -> list[Block]:
    """Everything that a diagnosis found, the verdict first, tables of effects last."""
    parts = (verdict, models, causes, next_poses, remarks, effects)
    return assembled(result, heading, *parts)


def heading(result: Diagnosis) -> Iterator[Block]:
    fitted = len(result.after_fit.problem.data)
    rows = f"{fitted} rows fitted, {len(result.held_out_data)} held out"
    rows += f", {plural(len(result.outliers), 'outlier')}" * bool(len(result.outliers))
    rows += f", {len(result.excluded)} excluded" * bool(result.excluded)
    yield Sentence(f"{result.robot.name}: {rows}", tone=Tone.STRONG)


def verdict(result: Diagnosis) -> Iterator[Block]:
    is_doubted = result.verdict in (Verdict.EXPLAINED, Verdict.NO_EFFECT) and not result.is_good
    tone = Tone.CAREFUL if is_doubted else TONES.get(result.verdict, Tone.BAD)
    yield Sentence(f"{result.verdict_text}: {result.message}", tone=tone)


def models(result: Diagnosis) -> Iterator[Block]:
    """Errors of the nominal arm, with the geometry alone, and with the effects."""
    found = [("nominal", result.nominal), ("geometry", result.before)]
    yield errors_table(found + [("with effects", result.after)] * bool(result.effects))
    yield budget_bars(result)
    yield from row_errors(result.identification())


def budget_bars(found: Diagnosis) -> Bars:
    """Of the mean error that geometry leaves: each cause's part, the unnamed part, the rest; in squares.

    All causes explain what the error falls by with them; among them it goes by what each explains alone.
    """
    mapped, after = found.residual_map, found.after.judged
    ends = found.before.judged, after if mapped is None else mapped.before, after
    sure = (errors.take(np.delete(np.arange(len(errors)), found.suspects)) for errors in ends)
    whole, rest, left = (errors.position_mm.mean for errors in sure)
    sizes = np.nan_to_num([cause.contribution_mm for cause in found.causes])
    parts = sizes * np.sqrt(max(whole**2 - rest**2, 0.0) / max(sizes @ sizes, 1e-12))
    each = zip(found.causes, parts.tolist(), strict=True)
    rows = [Bar(capital(c.plain), v, CALIBRATED, SAID.get(c.confidence, c.confidence)) for c, v in each]
    rows += [Bar(LEARNED, float(np.sqrt(rest**2 - left**2)), UNNAMED)] if rest > left else []
    if not rows or not np.isfinite(whole):
        return Bars((), testid="budget")
    aside = " without suspects" * bool(len(found.suspects))
    title = f"Parts of the {compared(whole)} mm after geometry{aside}, adding in squares"
    return Bars([*rows, Bar("Remaining", left, NOMINAL)], title, testid="budget")


def causes(result: Diagnosis) -> Iterator[Block]:
    """Claimed causes with their confidence and what they explain; what only predicts."""
    units = error_units(result)
    rows = []
    for cause in result.causes:
        sizes = dict(zip(("mm", "°"), (cause.contribution_mm, cause.contribution_deg), strict=True))
        odds = "> 10⁶ : 1" if cause.odds > 1e6 else f"{cause.odds:.0f} : 1"
        rows.append((cause.label, str(cause.confidence), odds, *(short(sizes[unit]) for _, unit in units)))
    if rows:
        headings = ("cause", "confidence", "odds", *(f"explains\n[{unit}]" for _, unit in units))
        yield ResultTable("Causes", headings, rows, words=2)
        yield Sentence(EXPLAINS, tone=Tone.QUIET)
        unsaid = (c.sentence for k, c in enumerate(result.causes) if c.doubt or k >= MAX_STATED_CAUSES)
        yield from lines("cause", unsaid)


def effects(result: Diagnosis) -> Iterator[Block]:
    """Added effects with coefficients ± standard errors, and the mean error without and with each."""
    if not result.effects:
        return
    rows = "held-out" if result.after.held_out else "fitted"
    units = error_units(result)
    headings = [f"{which}\n[{unit}]" for _, unit in units for which in ("without", "with")]
    table = []
    for found in result.effects:
        text = "\n".join(coefficients(found.effect, found.std, result.calibrated.chain))
        pair = found.before, result.after.judged
        spreads = (getattr(errors, name) for name, _ in units for errors in pair)
        sizes = ("–" if spread is None else short(spread.mean) for spread in spreads)
        table.append((found.effect.label, text, *sizes))
    title = f"Added effects; mean error of {rows} rows without each one and with all"
    claimed = {(c.kind, j) for c in result.causes for j in c.joints or (None,)}  # of significant joints only
    both = ((e.text, {(e.effect.name, j) for j in e.effect.joints or (None,)}) for e in result.effects)
    yield from lines("in the map", (text for text, mine in both if not mine & claimed))
    yield ResultTable(title, ("effect", "coefficients", *headings), table, words=2)


def error_units(result: Diagnosis) -> list[tuple[str, str]]:
    """Position error in mm, and orientation error in degrees if measured."""
    turned = result.after.judged.orientation_deg is not None
    return [("position_mm", "mm"), *([("orientation_deg", "°")] if turned else [])]


def next_poses(result: Diagnosis) -> Iterator[Block]:
    """Joint positions of poses to measure next, and what each would determine."""
    if not result.worth_measuring:
        return
    reasons = [reason.sentence for reason in result.next_reasons] or [""] * len(result.measure_next)
    each = enumerate(zip(shown_joints(result.calibrated, result.measure_next), reasons, strict=True), 1)
    rows = [(str(k), reason, *(signed(v, 1) for v in joints)) for k, (joints, reason) in each]
    joints = (f"q{j}\n[{unit.strip()}]" for j, unit in enumerate(shown_units(result.calibrated), 1))
    yield ResultTable("Measure next", ("pose", "what it determines", *joints), rows, words=2)


def remarks(result: Diagnosis) -> Iterator[Block]:
    """Outliers, the noise of joint readings, warnings and notes."""
    if len(result.outliers):
        yield Sentence(outlier_text(result), "outliers")
    if (noise := result.remaining.joint_noise) is not None:
        share = f"{100 * noise.share:.0f} % of the remaining error"
        yield Sentence(f"{noise.text(result.calibrated.chain)}, {share}", "noise of joint readings")
    yield from lines("warning", result.warnings)
    yield from lines("note", result.notes)


def outlier_text(result: Diagnosis) -> str:
    """Which rows were excluded as outliers, how far they are off, and what to do."""
    rows = sorted(result.data.row[result.outliers].tolist())
    shown = first_of(rows, MAX_NAMED_OUTLIERS)
    subject, it = (f"data rows {shown}", "them") if len(rows) > 1 else (f"data row {shown}", "it")
    off = result.outlier_errors.text("max")
    up_to, mean = "up to " if len(rows) > 1 else "", result.after.train.text("mean")
    size = f"{up_to}{off} off, where the others' mean is {mean}; " if off else ""
    return f"{subject}: {size}no model of the arm explains {it}; measure {it} again, or correct the file"


def coefficients(effect: AbstractEffect, std: tuple[float, ...], chain: Chain) -> list[str]:
    """Names and sizes such as `compliance 0.0412 ± 0.0003 mrad/(N·m)`, to two digits of the standard error.

    By joint if there is one each; of many only how many they are.
    """
    if len(effect.names) > MAX_LISTED_COEFFICIENTS:
        return [f"{len(effect.names)} along the joint" if effect.joints else f"{len(effect.names)}"]
    sizes, each = {}, zip(effect.names, effect.coefficients, std, effect.units(chain), strict=True)
    for name, value, error, unit in each:
        factor, symbol = readable_unit(unit)
        sizes[name] = f"{with_error(factor * value, factor * error)} {symbol}"
    one_each = len(effect.joints) == len(sizes) > 1
    kept = 0 if one_each else 2 if len(effect.joints) == 1 else None
    return [f"{name if kept is None else name.partition('.')[kept]} {size}" for name, size in sizes.items()]
