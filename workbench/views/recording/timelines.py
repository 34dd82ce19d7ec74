"""Contents of a recording over the steps of a session: log and numbers.

Each keeps what it needs of earlier steps; everything else is drawn from the current session.
"""

import math
from collections.abc import Iterator

import rerun as rr

from workbench.session.command import AbstractChore
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget
from workbench.session.commands.messages import SetCaption
from workbench.session.stages import stage_words, stages
from workbench.session.state import Session
from workbench.session.view import Ending, Moment
from workbench.views.appearance.colours import SELECTED, STAGE_COLOURS
from workbench.views.drawables.sink import differences
from workbench.views.recording.canvas import PATHS, Canvas
from workbench.views.recording.sentences import sentence

LEVELS = {Ending.DONE: "INFO", Ending.CANCELLED: "INFO", Ending.REFUSED: "WARN", Ending.FAILED: "ERROR"}
COLOURS = {PATHS[stage]: colour for stage, colour in STAGE_COLOURS.items()}
DRAGS = (GrabTarget, MoveTarget, DropTarget)


class Log:
    """`log`: one line per decision, and what a demo says.

    The places of a drag are left out, what the session computes by itself, and how page and scene look.
    """

    def __init__(self) -> None:
        self._message_count = 0
        self._last: Session | None = None

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        before, self._last = self._last, moment.session
        if moment.entry is None:
            self._message_count = moment.session.page.message_count
            summary = "The session begins" if moment.step == 0 else "The session continues"
            canvas.log("log", rr.TextLog(summary, level="INFO"))
            return
        messages = [m.text for m in moment.session.page.messages if m.number > self._message_count]
        self._message_count = moment.session.page.message_count
        command, is_done = moment.entry.command, moment.entry.ending is Ending.DONE
        if isinstance(command, SetCaption) and moment.session.page.caption:
            canvas.log("log", rr.TextLog(f"“{moment.session.page.caption}”", level="INFO"))
            return
        is_quiet = isinstance(command, MoveTarget | AbstractChore) or _look_alike(before, moment.session)
        if is_done and is_quiet and not messages:
            return
        text = sentence(moment.entry, moment.session, messages)
        canvas.log("log", rr.TextLog(text, level=LEVELS[moment.entry.ending]))


def _look_alike(before: Session | None, now: Session) -> bool:
    """Whether two sessions differ in nothing but the page, what is laid over the scene, and the row shown."""
    if before is None or differences(before, now) - {"page", "choices", "results", "playback"}:
        return False
    chosen, found = differences(before.choices, now.choices), differences(before.results, now.results)
    is_moved = differences(before.playback, now.playback) - {"focus"}
    return chosen <= {"overlay"} and found <= {"row"} and not is_moved


class Series:
    """Numbers of the session at every step.

    `index/O`: what the targets tell. `predicted/position_mm`, `predicted/rotation_deg`: mean errors in the
    region after a calibration. `error/nominal_mm`, `geometry_mm` and `effects_mm` (`_deg`): mean errors on
    held-out rows, on the fitted ones without any.
    """

    def __init__(self) -> None:
        self._drawn: dict[str, float] = {}

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        session, entry = moment.session, moment.entry
        is_all = entry is not None and not isinstance(entry.command, DRAGS)
        for path, value in _numbers(session):
            if path not in self._drawn:
                self._style(canvas, path, session)
            if is_all or self._drawn.get(path) != value:
                self._drawn[path] = value
                canvas.log(path, rr.Scalars(value if math.isfinite(value) else math.nan))

    def _style(self, canvas: Canvas, path: str, session: Session) -> None:
        name, _, unit = path.split("/")[1].partition("_")
        colour, words = COLOURS.get(name, SELECTED), stage_words(session)
        title = {PATHS[stage]: words[stage] for stage in words}.get(name, name)
        step = rr.components.InterpolationMode.StepAfter
        line = rr.SeriesLines(names=f"{title} {unit}".strip(), colors=colour, interpolation_mode=step)
        canvas.log(path, line, rr.SeriesPoints(colors=colour, marker_sizes=4.0), static=True)


def _numbers(session: Session) -> Iterator[tuple[str, float]]:
    yield "index/O", float(session.score.indices["O"])
    yield "predicted/position_mm", 1e3 * float(session.score.position)
    yield "predicted/rotation_deg", math.degrees(float(session.score.rotation))
    for stage in stages(session):
        yield f"error/{PATHS[stage.title]}_mm", stage.error
        if (turned := stage.errors.orientation_deg) is not None:
            yield f"error/{PATHS[stage.title]}_deg", turned.mean
