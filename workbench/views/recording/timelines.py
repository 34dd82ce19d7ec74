"""Contents of a recording over the steps of a session: log, numbers, dragged targets, searches.

Each keeps what it needs of earlier steps; everything else is drawn from the current session.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import rerun as rr

from workbench.diagnosis.result import judged
from workbench.plate.plate import Plate
from workbench.report.blocks import ResultTable
from workbench.report.numbers import short
from workbench.report.result_display import as_markdown
from workbench.session.command import AbstractChore
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget
from workbench.session.commands.messages import SetCaption
from workbench.session.journal.entry import Ending
from workbench.session.state import Session
from workbench.session.target_state import Score
from workbench.views.appearance.colours import CALIBRATED, NOMINAL, REACHED, SELECTED
from workbench.views.drawables.sink import differences
from workbench.views.recording.canvas import Canvas
from workbench.views.recording.recorded_step import Moment
from workbench.views.recording.rerun_sink import THIN, markdown
from workbench.views.recording.sentences import sentence

LEVELS = {Ending.DONE: "INFO", Ending.CANCELLED: "INFO", Ending.REFUSED: "WARN", Ending.FAILED: "ERROR"}
MAX_TRAIL = 64
"""Places that a trail keeps; of more, evenly chosen ones."""
DRAGS = (GrabTarget, MoveTarget, DropTarget)
ARMS = {"nominal": NOMINAL, "calibrated": CALIBRATED}
HEAD = ("step", "search", "measurable targets", "index O of a target", "predicted error [mm]")


class AbstractTimeline(ABC):
    """Follows a session step by step."""

    @abstractmethod
    def draw(self, canvas: Canvas, moment: Moment) -> None:
        """Draw what this step adds."""


class Log(AbstractTimeline):
    """`log`: one line per decision, and what a demo says.

    The places of a drag are left out, what the session computes by itself, and how the page looks.
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
    """Whether two sessions differ in nothing but the page and what is laid over the scene."""
    if before is None:
        return False
    alike = replace(before.choices, overlay=now.choices.overlay)
    return differences(before, now) <= {"page", "choices"} and not differences(alike, now.choices)


class Trails(AbstractTimeline):
    """`world/plate/trails/N`: where a target has been dragged; any other move starts a new trail."""

    def __init__(self) -> None:
        self._trails: list[list[np.ndarray]] = []
        self._plate: Plate | None = None
        self._drawn: dict[int, int] = {}

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        session = moment.session
        if not session.shows_plate and self._drawn:
            self._drawn = {}
            canvas.clear("world/plate/trails")
        if session.history.first_plate is not self._plate or len(self._trails) != len(session.plate):
            self._plate, self._drawn = session.history.first_plate, {}
            self._trails = [[] for _ in session.plate.targets]
            canvas.clear("world/plate/trails")
        is_drag = moment.entry is not None and isinstance(moment.entry.command, MoveTarget | DropTarget)
        for i, (trail, target) in enumerate(zip(self._trails, session.plate.targets, strict=True)):
            if not trail or not np.array_equal(trail[-1], target.xyz):
                if not is_drag:
                    trail.clear()
                    if self._drawn.pop(i, None) is not None:
                        canvas.clear(f"world/plate/trails/{i + 1}")
                trail.append(target.xyz)
                if len(trail) > 2 * MAX_TRAIL:
                    del trail[1:-1:2]
        if session.drag is None and session.shows_plate:
            for i, trail in enumerate(self._trails):
                self._show(canvas, i, trail)

    def _show(self, canvas: Canvas, i: int, trail: list[np.ndarray]) -> None:
        if len(trail) > 1 and self._drawn.get(i) != id(trail[-1]):
            self._drawn[i] = id(trail[-1])
            chosen = np.unique(np.linspace(0, len(trail) - 1, MAX_TRAIL).round().astype(int))
            strip = np.array([trail[k] for k in chosen])
            canvas.log(f"world/plate/trails/{i + 1}", rr.LineStrips3D([strip], colors=REACHED, radii=THIN))


class Series(AbstractTimeline):
    """Numbers of the session at every step.

    `index/O` … `index/O5`, `index/condition`, `index/rank`: what the targets tell. `predicted/position_mm`,
    `predicted/rotation_deg`: mean errors in the region after a calibration. `error/nominal_mm` and
    `error/calibrated_mm` (`_deg`): mean errors on held-out rows, or on the fitted ones where none were.
    """

    def __init__(self) -> None:
        self._drawn: dict[str, float] = {}

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        session, entry = moment.session, moment.entry
        is_all = entry is not None and not moment.is_passing and not isinstance(entry.command, DRAGS)
        for path, value in (*_score(session.score), *_errors(session)):
            if path not in self._drawn:
                self._style(canvas, path)
            if is_all or self._drawn.get(path) != value:
                self._drawn[path] = value
                canvas.log(path, rr.Scalars(value if math.isfinite(value) else math.nan))

    def _style(self, canvas: Canvas, path: str) -> None:
        name = path.split("/")[1]
        colour = ARMS.get(name.split("_")[0], SELECTED)
        step = rr.components.InterpolationMode.StepAfter
        line = rr.SeriesLines(names=name.replace("_", " "), colors=colour, interpolation_mode=step)
        canvas.log(path, line, static=True)


class RowErrorTimeline(AbstractTimeline):
    """`row_error/nominal_mm/N_FIT` and `row_error/calibrated_mm/N_FIT` on the timeline `measured_row`.

    Rows that were drawn can't be taken back, so every fit has a path of its own: N counts identifications.
    """

    def __init__(self) -> None:
        self._identification: object = None
        self._count = 0
        self._drawn: set[str] = set()

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        results = moment.session.results
        if results.identification is not None and results.identification is not self._identification:
            self._identification = results.identification
            self._count += 1
        rows = results.comparison
        group = f"{self._count}_{results.fit}"
        if rows is None or rows.calibrated is None or group in self._drawn:
            return
        self._drawn.add(group)
        for values, (name, colour) in zip(1e3 * rows.errors.T, ARMS.items(), strict=True):
            path = f"row_error/{name}_mm/{group}"
            lines = rr.SeriesLines(names=f"{results.fit}: {name} mm", colors=colour)
            canvas.log(path, lines, static=True)
            canvas.rows(path, rr.Scalars.columns(scalars=values), len(rows))


class Searches(AbstractTimeline):
    """The table of searches, each against the plate before it; equal O is what a search of poses is after."""

    def __init__(self) -> None:
        self._before: Session | None = None
        self._rows: list[tuple[str, ...]] = []

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        entry, before, self._before = moment.entry, self._before, moment.session
        if entry is None or before is None or entry.ending is not Ending.DONE:
            return
        if entry.command.is_plate_search:
            now = moment.session.score
            pairs = zip(_cells(before.score), _cells(now), strict=True)
            self._rows.append((f"{moment.step}", entry.command.title, *(f"{a} → {b}" for a, b in pairs)))
            canvas.log("searches", markdown(as_markdown([ResultTable("", HEAD, self._rows, words=5)])))


def _cells(score: Score) -> Iterator[str]:
    """Measurable targets, range of their indices, predicted error."""
    seen = score.per_target[np.isfinite(score.per_target)]
    yield f"{score.measurable} of {len(score.per_target)}"
    yield f"{seen.min():.4f} … {seen.max():.4f}" if len(seen) else "–"
    yield short(1e3 * score.position)


def _score(score: Score) -> Iterator[tuple[str, float]]:
    for name, value in score.indices.items():
        yield f"index/{name}", float(value)
    yield "index/condition", float(score.condition)
    yield "index/rank", float(score.rank)
    yield "predicted/position_mm", 1e3 * float(score.position)
    yield "predicted/rotation_deg", math.degrees(float(score.rotation))


def _errors(session: Session) -> Iterator[tuple[str, float]]:
    found, run = session.results.identification, session.results.run
    if found is None or run is None:
        return
    for name, errors in (("nominal", judged(found.nominal)), ("calibrated", judged(run))):
        yield f"error/{name}_mm", errors.position_mm.mean
        if errors.orientation_deg is not None:
            yield f"error/{name}_deg", errors.orientation_deg.mean


TIMELINES: tuple[type[AbstractTimeline], ...] = (Log, Trails, Series, RowErrorTimeline, Searches)
