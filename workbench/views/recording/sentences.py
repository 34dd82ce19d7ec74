"""A session in plain words: decisions as sentences, its subject as markdown."""

from collections.abc import Iterator

import numpy as np

from workbench.base.wording import plural
from workbench.report.numbers import compared
from workbench.session.commands.drag import DropTarget, MoveTarget
from workbench.session.commands.edit import MovePlate
from workbench.session.cube_fields import field_of
from workbench.session.stages import before_and_after
from workbench.session.state import Session
from workbench.session.view import Ending, Entry
from workbench.views.drawables.viewpoint import title


def sentence(entry: Entry, session: Session, messages: list[str]) -> str:
    """A command and its result."""
    sentence = entry.command.title
    if isinstance(entry.command, MoveTarget | DropTarget | MovePlate) and entry.ending is Ending.DONE:
        sentence += _place(session, is_plate=isinstance(entry.command, MovePlate))
    if entry.ending in (Ending.CANCELLED, Ending.FAILED):
        sentence += f" ({entry.ending})"
    text = "; ".join(messages) or entry.text
    return f"{sentence}: {text}" if text else sentence


def _place(session: Session, *, is_plate: bool) -> str:
    """Where the target, or the plate, stands now, and what that means."""
    state, target = session.states[session.selected], session.plate.targets[session.selected]
    x, y, z = 1e3 * (session.plate if is_plate else target).xyz
    text = f": {'it' if is_plate else f'target {session.selected + 1}'} is at {x:.1f}, {y:.1f}, {z:.1f} mm"
    if not is_plate and not state.measurable:
        return f"{text}, {state.obstacle}"
    error = session.score.position
    return f"{text}; predicted error {compared(1e3 * error)} mm rms" if np.isfinite(error) else text


def headline(session: Session) -> str:
    """What is seen, how good it is, and what a demo says of it, as markdown."""
    score = session.score
    figures = f"predicted error {compared(1e3 * score.position)} mm, O {score.indices['O']:.3f}"
    figures = before_and_after(session) if session.results.identification else figures
    return f"**{title(session)}:** {figures}\n\n{session.page.caption}"


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
        "**Timelines:** `step`: commands; `session_time`: seconds.",
        "",
        *cube_text(session),
        "**O** is the observability index: how evenly the targets tell all constants, 0 (some not) to 1.",
        "**Blocks:** sand where reached, blue where selected, brown where the arm is blocked, red where",
        "out of reach. **Arms:** solid, J1 … at its joints: nominal; orange: the real one as far as known.",
        "**Points** were measured: coloured by their error once there is a fit.",
        "**Arrows** lead from predicted to measured positions, in the colour of the model's stage: grey",
        "nominal, blue with its geometry identified, orange with what was added; likewise lines and bars.",
        f"All errors, of arms and arrows alike, are drawn × {session.choices.overlay.exaggeration:g}.",
    ]
    return "\n".join(lines)


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
