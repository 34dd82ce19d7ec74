"""A session in plain words: decisions as sentences; subject, parameters and diagnosis as markdown."""

from collections.abc import Iterator

import numpy as np

from workbench.base.wording import plural
from workbench.diagnosis.report.table import alternatives, heading, lines, outlier_text
from workbench.diagnosis.result import Accepted, Diagnosis, judged
from workbench.identification.fit import Fit
from workbench.identification.report.parameters import unseen
from workbench.identification.result import Identification
from workbench.report.numbers import signed, standard_error
from workbench.session.commands.drag import DropTarget, MoveTarget
from workbench.session.cube_fields import field_of
from workbench.session.journal.entry import Ending, Entry
from workbench.session.stages import shown_stage
from workbench.session.state import Session
from workbench.views.drawables.measured import error_scale

UNITS = {"rad": (float(np.rad2deg(1.0)), "°"), "m": (1e3, "mm")}


def sentence(entry: Entry, session: Session, messages: list[str]) -> str:
    """A command and its result."""
    sentence = entry.command.title
    if isinstance(entry.command, MoveTarget | DropTarget) and entry.ending is Ending.DONE:
        sentence += _place(session)
    if entry.ending in (Ending.CANCELLED, Ending.FAILED):
        sentence += f" ({entry.ending})"
    text = "; ".join(messages) or entry.text
    return f"{sentence}: {text}" if text else sentence


def _place(session: Session) -> str:
    """Where the target stands now, and what that means."""
    state, (x, y, z) = session.states[session.selected], 1e3 * session.plate.targets[session.selected].xyz
    text = f": target {session.selected + 1} is at {x:.1f}, {y:.1f}, {z:.1f} mm"
    if not state.measurable:
        return f"{text}, {state.obstacle}"
    return with_predicted(text, session.score.position)


def with_predicted(text: str, error: float | None) -> str:
    """A sentence with the predicted error [m] behind it, where there is one."""
    if error is None or not np.isfinite(error):
        return text
    return f"{text}; predicted error {1e3 * error:.3g} mm rms"


def about(session: Session) -> str:
    """Robot, plate, measurements, and a legend of the recording, as markdown."""
    loaded, noise = session.measurements.loaded, session.noise
    measured = "none yet" if loaded is None else f"{loaded.name}, {plural(len(loaded.dataset), 'row')}"
    lines = [
        f"**{session.robot.name}:** {session.robot.dof} joints, convention {session.robot.convention}.",
        f"Plate “{session.plate.name}” with {plural(len(session.plate), 'target')}.",
        f"Instrument: {1e3 * noise.position:.3g} mm, {np.rad2deg(noise.rotation):.3g}°.",
        "",
        f"**Measurements:** {measured}",
        "",
        "**Timelines:** `step`: commands; `session_time`: seconds; `measured_row`: rows of the measurements.",
        "",
        *cube_text(session),
        "**Blocks:** sand where reached, blue where selected, brown where the arm is blocked, red where",
        "out of reach. **Arms:** the solid one is nominal, the orange one the real arm as far as known.",
        f"**Points** were measured: coloured by their error once there is a fit{_scale_text(session)}.",
        "**Arrows** lead from predicted to measured positions: grey nominal, orange the model at that step.",
        f"All errors, of arms and arrows alike, are drawn × {session.choices.overlay.exaggeration:g}.",
    ]
    return "\n".join(lines)


def _scale_text(session: Session) -> str:
    """What the colours of the measured points mean."""
    rows = session.results.comparison
    if rows is None or not rows.stages:
        return ""
    scale, stage = error_scale(rows), shown_stage(session, rows)
    return f", {stage}: blue up to {1e3 * scale.low:.3g} mm, orange-red from {1e3 * scale.high:.3g} mm"


def cube_text(session: Session) -> Iterator[str]:
    """What the colours of the region's cubes mean, where they are shown."""
    field = field_of(session)
    if field is None or (shown := field.values(session)) is None:
        return
    low, high = (f"{field.factor * bound:.3g} {field.unit}".strip() for bound in (shown.low, shown.high))
    worst, best = (low, high) if field.larger_is_better else (high, low)
    title = field.title.lower()
    yield f"**Cubes:** {title}, orange-red {worst} or worse, blue {best} or better; grey: not reached."
    yield ""


def parameters_markdown(found: Identification | None, name: str) -> str:
    """The parameters of one fit of an identification as a markdown table."""
    if found is None:
        return "Nothing has been identified yet."
    fit = found.runs[name].fit
    lines = [f"**{fit.title}**: {fit.outcome}", "", "| parameter | nominal | identified | std. error | |"]
    lines.append("|---|---:|---:|---:|---|")
    lines += ["| " + " | ".join(cells) + " |" for cells in parameter_rows(fit)]
    if found.unidentifiable:
        lines += ["", "Can't be told apart: " + "; ".join(found.unidentifiable) + "."]
    return "\n".join(lines)


def parameter_rows(fit: Fit) -> Iterator[tuple[str, str, str, str, str]]:
    """Name, nominal and identified value, standard error and unit of every parameter."""
    hidden = unseen(fit)
    for p, value, std in zip(fit.parameters, fit.x, fit.std, strict=True):
        scale, unit = UNITS.get(p.unit, (1.0, p.unit))
        error = "not seen" if p.name in hidden else standard_error(float(scale * std), 4)
        yield p.text, signed(scale * p.nominal, 4), signed(float(scale * value), 4), error, unit


def diagnosis_markdown(found: Diagnosis) -> str:
    """Everything that a reviewer should know of it, the verdict first."""
    return "\n".join(
        [f"**{found.verdict_text}**: {found.message}", "", f"{heading(found)}.", "", *_tables(found)]
    )


def _tables(found: Diagnosis) -> Iterator[str]:
    yield "| model | mean error |"
    yield "|---|---:|"
    yield from (f"| {name} | {error} |" for name, error in model_errors(found))
    if found.effects:
        yield from ("", "| added to the model | coefficients | without | with |")
        yield "|---|---|---:|---:|"
        yield from (_effect(effect, found) for effect in found.effects)
    yield ""
    yield from (f"- {text}" for text in remarks(found))


def model_errors(found: Diagnosis) -> Iterator[tuple[str, str]]:
    """Mean errors of every model, on held-out rows if there are any."""
    models = {"nominal": found.nominal, "geometry alone": found.before, "with the effects": found.after}
    for name, validation in models.items():
        yield name, judged(validation).text("mean")


def remarks(found: Diagnosis) -> Iterator[str]:
    """What was added, alternatives, outliers, what to measure next."""
    yield from (accepted.text for accepted in found.effects)
    yield from alternatives(found)
    if len(found.outliers):
        yield f"outliers: {outlier_text(found)}"
    if len(found.measure_next):
        yield f"suggested poses to measure next: {plural(len(found.measure_next), 'pose')}"
    yield from (f"note: {text}" for text in found.notes)


def _effect(accepted: Accepted, found: Diagnosis) -> str:
    sizes = lines(accepted.effect, accepted.std, found.calibrated.chain)
    coefficients = ", ".join(f"{name} {size}" for name, size in sizes)
    errors = f"{accepted.before.text('mean')} | {accepted.after.text('mean')}"
    return f"| {accepted.effect.label} | {coefficients} | {errors} |"
