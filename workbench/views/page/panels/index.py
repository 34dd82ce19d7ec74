"""The live numbers: how well measurements at these targets would determine the arm."""

import numpy as np
import viser

from workbench.base.wording import plural
from workbench.plate.observability import INDICES
from workbench.plate.region_poses import PLATE_CONE
from workbench.plate.target_readings import assumptions
from workbench.report.chart import UprightBar, columns
from workbench.session.commands.identify import SetWanted
from workbench.session.commands.plate import AbstractPlateTrial
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.session.target_postures import from_limit
from workbench.session.target_state import Score
from workbench.session.target_steps import score_as_drawn
from workbench.session.worker import Worker
from workbench.views.appearance.colours import css
from workbench.views.drawables.plate import target_colour
from workbench.views.page.html import BAD, MUTED, UNCHANGED, block, change, heading, note, number, text
from workbench.views.page.panels.form import DEGREE, Shown
from workbench.views.page.panels.panel import AbstractPanel, ask

INDEX = "O1"
"""Of all targets together."""
FULL = 0.3
"""Rise of the error, as a share, of a bar of full height, at least."""


class IndexPanel(AbstractPanel):
    """Predicted error, and the contribution of each target; the strip judges it."""

    tab, order = Tab.PLATE, 20
    pause = 0.0
    depends = ("score", "history.first_score", "states", "selected", "noise", "plate.region", "drag")

    def build(self, gui: viser.GuiApi) -> None:
        self.html(_prediction)


def _prediction(session: Session) -> str:
    return block(
        heading(predicted_heading(session))
        + _measurable(session)
        + predicted(session)
        + reading(session.score, session.noise.position)
        + heading("Predicted error without each target")
        + loss_bars(session)
        + determined(session),
        testid="index",
    )


class DetailsPanel(AbstractPanel):
    """What a calibration on these targets would determine, in a specialist's words; folded."""

    tab, order = Tab.PLATE, 92
    depends = ("score", "history.first_score")

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Details of the plate", expand_by_default=False):
            self.html(_details)


def _details(session: Session) -> str:
    now, first = session.score, session.history.first_score
    index = change(now.indices[INDEX], first.indices[INDEX], larger_is_better=True)
    content = (
        f'<div title="{text(INDICES[INDEX].meaning)} — {text(INDICES[INDEX].source)}">'
        f"Observability index {INDEX} of all targets: {number(now.indices[INDEX], 4)} {index}</div>"
        + _worst(now)
        + f"<div>Rank {now.rank} of {now.parameters} · condition {number(now.condition)}</div>"
    )
    return block(content, testid="details")


def reading(score: Score, noise: float) -> str:
    """A predicted error against that of one reading; `noise` is the instrument's along each axis [m]."""
    if not np.isfinite(score.position):
        return ""
    length = np.sqrt(3.0) * noise
    times = score.position / length
    if times < 1.0:
        sentence = f"below the error of one instrument reading ({number(1e3 * length)} mm rms)"
    else:
        sentence = f"{number(times, 2)} × the error of one reading ({number(1e3 * length)} mm rms)"
    return f'<div data-testid="reading" style="color:{MUTED}">{sentence}</div>'


def _measurable(session: Session) -> str:
    """How many targets count, where some don't."""
    lost = [f"target {i}: {s.obstacle}" for i, s in enumerate(session.states, 1) if not s.measurable]
    if not lost:
        return ""
    count = len(session.states)
    return (
        f'<div data-testid="measurable" title="{text("; ".join(lost))}" style="color:{BAD};'
        f'font-weight:600">{count - len(lost)} of {count} targets measurable; the others are ignored</div>'
    )


def predicted_heading(session: Session) -> str:
    """What is predicted, and where: nobody may have noticed that the region follows the rows."""
    box = session.measurements.box
    place = "the region" if box is None or session.plate.region is not box else "the box of the rows"
    return f"Predicted error in {place} after calibration"


def predicted(session: Session) -> str:
    """The predicted error, and what the last step changed in it."""
    now, first, noise = session.score, session.history.first_score, session.noise
    if np.isnan(now.position):
        is_sampled = session.region.sampled is session.plate.region
        unknown = "The arm does not reach the region." if is_sampled else "Not computed yet."
        return f'<div style="color:{MUTED}">{unknown}</div>'
    if np.isinf(now.position):
        is_reached = now.measurable == len(session.plate)
        way = "Add targets at other places and heights" if is_reached else "Move more targets into reach"
        return (
            f'<div style="color:{BAD}">Unbounded: these targets leave parameters open which '
            f"affect the tool there. {way}.</div>"
        )
    is_moved = session.plate is not session.history.first_plate
    scores = session.history.scores if session.drag is not None else session.history.scores[:-1]
    before = scores[-1] if scores else first
    better = change(now.position, before.position, larger_is_better=False) if is_moved else ""
    if better:
        better += f'<span style="color:{MUTED}">against before the last step</span>'
    drawn = score_as_drawn(session) if session.drag is None else None
    if drawn is not None:
        better = (
            f'<span data-testid="as-drawn" title="{text(session.plate.made_as_drawn.assumptions)}">'
            f"as drawn {number(1e3 * drawn.position)} mm</span>{better}"
        )
    included = assumptions(session.plate, (noise.position, noise.rotation))
    return (
        '<div style="display:flex;flex-wrap:wrap;align-items:baseline;gap:0 8px" title="Root mean square '
        f"over the cuboid, turned from a target by up to {np.rad2deg(PLATE_CONE):.0f}°, in any posture, "
        f'each target measured once. Includes: {text(included)}.">'
        f'<span data-testid="predicted" style="font-size:22px;font-weight:650">{number(1e3 * now.position)} '
        f'mm rms</span><span style="font-size:14px;color:{MUTED}">{number(np.rad2deg(now.rotation))}°</span>'
        f"{better}</div>"
    )


def loss_bars(session: Session) -> str:
    """One bar per target: by how much the error would rise without it; full where it is indispensable."""
    rises = session.score.rises
    top = max(FULL, float(rises[np.isfinite(rises)].max(initial=0.0)))
    drawn = []
    for i, (rise, state) in enumerate(zip(rises.tolist(), session.states, strict=True)):
        share = 1.0 if np.isinf(rise) else 0.0 if np.isnan(rise) else min(rise / top, 1.0)
        above = "!" if np.isinf(rise) else "" if np.isnan(rise) else f"+{100 * rise:.0f}"
        colour = css(target_colour(state, selected=i == session.selected))
        tooltip = f"target {i + 1}: " + (_without(rise) if state.measurable else state.obstacle)
        drawn.append(UprightBar(f"{i + 1}", share, colour, above, tooltip))
    selected, own = (of[session.selected] for of in (rises, session.score.per_target))
    return (
        f"{columns(drawn)}"
        f'<div style="color:{MUTED}">Target {session.selected + 1}: '
        f'<span data-testid="loss">{_without(selected) or "does not count"}</span> (bars in %) · '
        '<span title="Inverse condition number of the target alone; 1 is best.">index O '
        f'<span data-testid="own">{number(own)}</span></span>{alone_or_together(session)}</div>'
    )


def alone_or_together(session: Session) -> str:
    """Why index and error of the selected target moved the same way since the beginning, where they did."""
    now, first, i = session.score, session.history.first_score, session.selected
    if i >= len(first.per_target):
        return ""
    own = now.per_target[i] / first.per_target[i] - 1.0
    error = now.position / first.position - 1.0
    if not (own * error > 0.0 and min(abs(own), abs(error)) > UNCHANGED):
        return ""
    more, falls = ("less", "rises") if error > 0.0 else ("more", "falls")
    sentence = (
        f"the index rates it alone; with the other targets it adds {more} information, so the error {falls}"
    )
    return f'<span data-testid="alone">: {sentence}</span>'


def _without(rise: float) -> str:
    """What would be lost without a target."""
    if np.isnan(rise):
        return ""
    return "parameters undetermined without it" if np.isinf(rise) else f"{100 * rise:+.0f} % error without it"


def _worst(now: Score) -> str:
    """The parameters that are determined worst, by name."""
    if not now.worst:
        return ""
    shown = ", ".join(f"{text(name)} {_spread(error, unit)}" for name, error, unit in now.worst)
    return (
        f'<div data-testid="worst" style="color:{MUTED}" title="Parameters with the largest standard error '
        f'after a calibration here; angles count as arcs at the arm&#39;s reach.">'
        f"Least certain: {shown}</div>"
    )


def _spread(error: float, unit: str) -> str:
    if np.isinf(error):
        return "open"
    return f"±{number(1e3 * error, 2)} mm" if unit == "m" else f"±{number(np.rad2deg(error), 2)}°"


def determined(session: Session) -> str:
    """How much these targets leave undetermined, how many count, and how near joints come to their limits."""
    now, reached = session.score, [s.q for s in session.states if s.measurable]
    nearest = min((from_limit(session.robot, q) for q in reached), default=None)
    room = "" if nearest is None else f"; joints stay {nearest.text} or more from their limits"
    missing = now.parameters - now.rank
    colour = MUTED if missing == 0 else BAD
    more = f"; they leave {plural(missing, 'combination')} of parameters undetermined" if missing else ""
    return (
        f'<div data-testid="rank" style="color:{colour}">{plural(now.measurable, "target")}{room}{more}</div>'
    )


FIELDS = (
    ("Required [mm]", "Maximum position error allowed for the calibrated arm; 0: no requirement."),
    ("Required [°]", "Maximum orientation error allowed; 0: no requirement."),
)
SHOWN: tuple[Shown, Shown] = (
    lambda s: 0.0 if s.choices.wanted is None else s.choices.wanted.position,
    lambda s: 0.0 if s.choices.wanted is None else s.choices.wanted.rotation or 0.0,
)
NOTHING = "0 mm: no requirement, so there is no pass or fail. Set a value to assess plate and arm against it."
NO_ANGLE = "0°: no requirement for orientations."


class WantedPanel(AbstractPanel):
    """Input of the required error, in every tab that uses it."""

    tab, order = Tab.PLATE, 30
    depends = ("choices.wanted",)

    def build(self, gui: viser.GuiApi) -> None:
        self.form(
            self._want,
            *(
                self.number(label, (0.0, 1000.0, 0.01), hint, shows, unit=unit, digits=3)
                for (label, hint), shows, unit in zip(FIELDS, SHOWN, (1e-3, DEGREE), strict=True)
            ),
        )
        self.html(_unjudged)

    def _want(self, position: float, rotation: float) -> SetWanted:
        before = self._worker.session.choices.wanted
        return SetWanted(position or None, rotation or None, before is not None and before.per_axis)


def _unjudged(session: Session) -> str:
    wanted = session.choices.wanted
    sentence = NOTHING if wanted is None else NO_ANGLE if wanted.rotation is None else ""
    return sentence and note(sentence, "unjudged", margin="0 0 4px")


TIMES = 3.0
"""Required error that is offered where none is set, as a multiple of the predicted one, then rounded up."""

LIMITS = 0.001, 1000.0
"""Required errors that can be typed there [mm]."""


def try_plate(event: viser.GuiEvent, worker: Worker, trial: AbstractPlateTrial) -> None:
    """Try the plate; ask first what the arms have to keep, if that is not known."""
    session = worker.session
    if session.choices.wanted is not None:
        worker.submit(trial)
        return
    predicted = 1e3 * session.score.position
    minimum, maximum = LIMITS
    offered = min(max(_round_up(TIMES * predicted), minimum), maximum) if np.isfinite(predicted) else 1.0
    fields: list[viser.GuiNumberHandle] = []

    def build(gui: viser.GuiApi) -> None:
        label, hint = FIELDS[0]
        fields.append(gui.add_number(label, offered, min=minimum, max=maximum, step=0.001, hint=hint))

    def begin() -> None:
        worker.submit(SetWanted(1e-3 * float(fields[0].value)))
        worker.submit(trial)

    known = f" {number(predicted)} mm rms are predicted." if np.isfinite(predicted) else ""
    question = f"How accurate must every arm be, everywhere in the region?{known}"
    ask(event, "Required error", question, "Try with this", begin, build=build)


def _round_up(value: float) -> float:
    """The next of 1, 2, 5, 10 … ."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= value))
