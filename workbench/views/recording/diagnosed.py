"""A diagnosis for reviewers: verdict, errors before and after, accepted effects, what else was found."""

from collections.abc import Iterator

from workbench.diagnosis.record import Accepted, Diagnosis, judged
from workbench.diagnosis.report.table import (
    alternatives,
    chance,
    heading,
    lines,
    outlier_words,
)
from workbench.report.numbers import short


def diagnosis_markdown(found: Diagnosis) -> str:
    """Everything that a reviewer should know of it, the verdict first."""
    return "\n".join([f"**{found.verdict}**: {found.message}", "", f"{heading(found)}.", "", *_tables(found)])


def _tables(found: Diagnosis) -> Iterator[str]:
    yield "| model | mean position error |"
    yield "|---|---:|"
    yield from (f"| {name} | {error} |" for name, error in model_errors(found))
    if found.effects:
        yield from ("", "| added to the model | coefficients | before | after | chance |")
        yield "|---|---|---:|---:|---:|"
        yield from (_effect(effect, found) for effect in found.effects)
    yield ""
    yield from (f"- {words}" for words in remarks(found))


def model_errors(found: Diagnosis) -> Iterator[tuple[str, str]]:
    """Mean position error of every model, on held-out rows if there are any."""
    models = {"nominal": found.nominal, "geometry alone": found.before, "with the effects": found.after}
    for name, validation in models.items():
        yield name, f"{short(judged(validation).position_mm.mean)} mm"


def remarks(found: Diagnosis) -> Iterator[str]:
    """What was added, alternatives, outliers, what to measure next."""
    yield from (accepted.words for accepted in found.effects)
    yield from alternatives(found)
    if len(found.outliers):
        yield f"outliers: {outlier_words(found)}"
    if len(found.measure_next):
        yield f"{len(found.measure_next)} poses are proposed to be measured next"
    yield from (f"note: {words}" for words in found.notes)


def _effect(accepted: Accepted, found: Diagnosis) -> str:
    sizes = lines(accepted.effect, accepted.std, found.calibrated.chain)
    coefficients = ", ".join(f"{name} {size}" for name, size in sizes)
    errors = f"{short(accepted.before_mm)} mm | {short(accepted.after_mm)} mm"
    return f"| {accepted.effect.label} | {coefficients} | {errors} | {chance(accepted.p_value)} |"
