"""The live numbers: how well measurements at these targets would determine the arm."""

from collections.abc import Sequence
from math import isclose

import numpy as np
import viser

from workbench.base.wording import capital, plural
from workbench.plate.observability import INDICES
from workbench.plate.optimiser.target_blocks import overlapping_blocks
from workbench.plate.plate import Plate
from workbench.plate.region_poses import PLATE_CONE
from workbench.plate.target_readings import assumptions
from workbench.report.chart import Chart, Marks
from workbench.report.numbers import compared
from workbench.session.page_state import Tab
from workbench.session.state import Drag, Session
from workbench.views.appearance.colours import css
from workbench.views.drawables.plate import target_colour
from workbench.views.page.html import BAD, MUTED, UNCHANGED, block, change, heading, sparkline, text
from workbench.views.page.panels.panel import AbstractPanel

INDEX = INDICES["O"]
"""The one index of the page: of all targets together."""
OBSERVABILITY = (
    f"How evenly the targets tell all constants of the arm, 0 (some not at all) to 1: {INDEX.meaning}."
)
OTHERWISE = "The error decides: O counts more than this region needs."
"""Where the one gets better and the other worse."""
TRACE = 60
"""Places of a drag that its curves have at most."""
ONE_LINE = f"color:{MUTED};white-space:nowrap;overflow:hidden;text-overflow:ellipsis"
"""Style of a sentence that keeps the height."""
FULL = 0.3
"""Least rise of the error, as a share, that is drawn of an indispensable target."""


class IndexPanel(AbstractPanel):
    """Predicted error and index; the strip judges them."""

    tab, order = Tab.PLATE, 20
    pause = 0.0
    depends = ("score", "history.first", "noise", "plate.region", "drag")

    def build(self, gui: viser.GuiApi) -> None:
        self._drag: Drag | None = None
        self._plate: Plate | None = None
        self._trace: list[tuple[float, float]] = []
        self.html(self._prediction)

    def _prediction(self, session: Session) -> str:
        if session.plate is not self._plate if session.drag is None else session.drag is not self._drag:
            self._trace = []  # it led to another plate
        self._drag, self._plate = session.drag, session.plate
        if session.drag is not None:
            if len(self._trace) >= TRACE:
                del self._trace[1::2]
            self._trace.append((session.score.position, session.score.indices["O"]))
        about = heading("Predicted error in the region; observability index O")
        return block(about + headline(session, self._trace), testid="index")


class LossPanel(AbstractPanel):
    """The contribution of each target; in a drag now and then, as a page takes long to set so many words."""

    tab, order = Tab.PLATE, 21
    depends = ("score", "states", "selected", "drag")

    def build(self, gui: viser.GuiApi) -> None:
        about = heading("Rise of the error without each target [% of it]")
        self.html(lambda s: block(about + loss_bars(s) + determined(s), testid="losses"))


def headline(session: Session, trace: Sequence[tuple[float, float]]) -> str:
    """Error and index side by side, with curves of the last drag; of the last step the error is the judge."""
    now, noise = session.score, session.noise
    past = session.history.past if session.drag is not None else session.history.past[:-1]
    before = past[-1].score if past else session.history.first.score
    is_moved = session.plate is not session.history.first.plate
    included = assumptions(session.plate, (noise.position, noise.rotation))
    about = (
        f"Root mean square over the cuboid, turned from a target by up to {np.rad2deg(PLATE_CONE):.0f}°, in "
        f"any posture, each target measured once. Includes: {included}."
    )
    own = f"and {compared(np.rad2deg(now.rotation))}°, rms" if np.isfinite(now.rotation) else "rms"
    index, last = now.indices[INDEX.name], before.indices[INDEX.name]
    error_change = change(now.position, before.position) if is_moved else ""
    index_change = change(index, last, is_verdict=False) if is_moved else ""
    pairs = (now.position, before.position), (index, last)
    is_told = is_moved and now.measurable == before.measurable  # else it is told that a target is lost
    is_told = is_told and not any(isclose(*pair, rel_tol=UNCHANGED) for pair in pairs)
    differ = is_told and (now.position > before.position) == (index > last)
    below = OTHERWISE if differ else _about(session)
    errors, indices = zip(*trace, strict=True) if trace else ((), ())
    return (
        '<div style="display:flex;gap:16px;font-variant-numeric:tabular-nums">'
        + _figure("predicted", f"{compared(1e3 * now.position)} mm", own + error_change, about, errors)
        + _figure(
            "O", f"O {compared(index, 4)}", "of 1, all constants" + index_change, OBSERVABILITY, indices
        )
        + f'</div><div data-testid="reading" style="color:{MUTED}">{below}</div>'
    )


def _figure(name: str, shown: str, below: str, hint: str, curve: Sequence[float]) -> str:
    return (
        f'<div title="{text(hint)}" style="flex:1 1 0;min-width:0;white-space:nowrap;overflow:hidden">'
        f'<div style="font-size:26px;font-weight:650;line-height:1.25" data-testid="{name}">{shown}</div>'
        f'<div style="color:{MUTED}">{below}</div>{sparkline(curve)}</div>'
    )


def _about(session: Session) -> str:
    """The predicted error against that of one reading, or why there is none."""
    error = session.score.position
    if np.isnan(error):  # the strip says why
        return ""
    if np.isinf(error):
        is_reached = session.score.measurable == len(session.plate)
        way = "Add targets at other places and heights" if is_reached else "Move more targets into reach"
        return f'<span style="color:{BAD}">Unbounded: parameters stay open. {way}.</span>'
    length = np.sqrt(3.0) * session.noise.position
    times = error / length
    share = "Below" if times < 1.0 else f"{compared(times, 2)} ×"
    reading = f"{compared(1e3 * length)} mm, {compared(1e3 * session.noise.position)} per axis"
    return f"{share} the error of one reading ({reading})"


def loss_bars(session: Session) -> str:
    """One bar per target: by how much the error would rise without it; full where it is indispensable."""
    rises, drawn = session.score.rises, []
    top = max(FULL, float(rises[np.isfinite(rises)].max(initial=0.0)))
    for i, (rise, state) in enumerate(zip(rises.tolist(), session.states, strict=True)):
        share = 0.0 if np.isnan(rise) else min(rise, top)
        colour = css(target_colour(state, selected=i == session.selected))
        tooltip = f"target {i + 1}: " + (_without(rise) if state.measurable else state.obstacle)
        place, height = np.array([float(i)]), np.array([100.0 * share])
        drawn.append(Marks(place, height, colour, [tooltip], radius=6.0, is_bar=True))
    svg = Chart(drawn, 50.0, ticks=[(float(i), f"{i + 1}") for i in range(len(drawn))], floor=0.0).svg()
    selected = _without(rises[session.selected]) or "does not count"
    return (
        f'{svg}<div style="{ONE_LINE}">Target {session.selected + 1}: '
        f'<span data-testid="loss">{selected}</span></div>'
    )


def _without(rise: float) -> str:
    """What would be lost without a target."""
    if not np.isfinite(rise):
        return "" if np.isnan(rise) else "parameters undetermined without it"
    return f"without it the error rises by {100 * rise:.0f} %"


def determined(session: Session) -> str:
    """How many targets count, and how much these leave undetermined."""
    now = session.score
    lost = [f"target {i}: {s.obstacle}" for i, s in enumerate(session.states, 1) if not s.measurable]
    missing, sentence = now.visible - now.rank, f"{plural(now.measurable, 'target')}, all measurable"
    if missing:
        sentence = f"{plural(now.measurable, 'target')} leave {plural(missing, 'combination')} undetermined"
    if lost:
        sentence = f"{now.measurable} of {len(session.states)} targets measurable; the others are ignored"
    met = overlapping_blocks(session.plate)
    style = f"{ONE_LINE};color:{BAD};font-weight:600" if lost or missing or met else ONE_LINE
    sentence = sentence if lost or missing or not met else capital(met)
    hint = text("; ".join([sentence, *lost]))
    return f'<div data-testid="rank" title="{hint}" style="{style}">{sentence}</div>'
