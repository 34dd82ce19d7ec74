"""`index`, `predicted` and `error`: numbers over the steps of the session, and over the measured rows."""

import math
from collections.abc import Iterator

import numpy as np
import rerun as rr

from workbench.diagnosis.record import judged
from workbench.identification.record import Run, Validation
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget
from workbench.session.state import Score, Session
from workbench.views.appearance.colours import ARROW_AFTER, ARROW_BEFORE, SELECTED
from workbench.views.recording.canvas import Canvas
from workbench.views.recording.entities.entity import AbstractEntity, Moment

DRAGS = (GrabTarget, MoveTarget, DropTarget)
ARMS = {"nominal": ARROW_BEFORE, "calibrated": ARROW_AFTER}


class Series(AbstractEntity):
    """Numbers of the session at every step.

    `index/O` … `index/O5`, `index/condition`, `index/rank`: what the targets tell. `predicted/position_mm`,
    `predicted/rotation_deg`: mean errors in the region after a calibration. `error/nominal_mm` and
    `error/calibrated_mm` (`_deg`): mean errors on held-out rows, or on the fitted ones where none were.
    `error/diagnosed_geometry_mm` and `error/diagnosed_effects_mm`: the same of the last diagnosis, of the
    geometry alone and with the accepted effects.
    """

    def __init__(self) -> None:
        self._drawn: dict[str, float] = {}

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        session, entry = moment.session, moment.entry
        is_all = entry is not None and not moment.is_passing and not isinstance(entry.command, DRAGS)
        for path, value in (*_score(session.score), *_errors(session), *_diagnosed(session)):
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


class RowErrors(AbstractEntity):
    """`row_error/nominal_mm/N_FIT` and `row_error/calibrated_mm/N_FIT` on the timeline `measured_row`.

    Rows that were drawn can't be taken back, so every fit has a path of its own: N counts identifications.
    """

    def __init__(self) -> None:
        self._identification: object = None
        self._count = 0
        self._drawn: set[str] = set()

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        session = moment.session
        if session.identification is not None and session.identification is not self._identification:
            self._identification = session.identification
            self._count += 1
        rows = session.comparison
        group = f"{self._count}_{session.fit}"
        if rows is None or rows.calibrated is None or group in self._drawn:
            return
        self._drawn.add(group)
        errors = 1e3 * np.array([rows.errors(i) for i in range(len(rows))])
        for values, (name, colour) in zip(errors.T, ARMS.items(), strict=True):
            path = f"row_error/{name}_mm/{group}"
            canvas.log(path, rr.SeriesLines(names=f"{session.fit}: {name} mm", colors=colour), static=True)
            canvas.rows(path, rr.Scalars.columns(scalars=values), len(rows))


class TargetBars(AbstractEntity):
    """`target/index_O`: index O of each target alone (ARIA eq. 17); 0 where it is out of reach."""

    def __init__(self) -> None:
        self._drawn = b""

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        values = np.nan_to_num(moment.session.score.per_target)
        if values.tobytes() != self._drawn:
            self._drawn = values.tobytes()
            numbers = np.arange(1, len(values) + 1)
            begins = numbers - 0.5  # a bar is drawn from its place to the next one's
            canvas.log("target/index_O", rr.BarChart(values, abscissa=begins, color=SELECTED))


def _score(score: Score) -> Iterator[tuple[str, float]]:
    for name, value in score.indices.items():
        yield f"index/{name}", float(value)
    yield "index/condition", float(score.condition)
    yield "index/rank", float(score.rank)
    yield "predicted/position_mm", 1e3 * float(score.position)
    yield "predicted/rotation_deg", math.degrees(float(score.rotation))


def _errors(session: Session) -> Iterator[tuple[str, float]]:
    found = session.identification
    if found is None:
        return
    arms: tuple[tuple[str, Validation | Run], ...] = (
        ("nominal", found.nominal),
        ("calibrated", found.runs[session.fit]),
    )
    for name, validated in arms:
        errors = validated.held_out or validated.train
        yield f"error/{name}_mm", errors.position_mm.mean
        if errors.orientation_deg is not None:
            yield f"error/{name}_deg", errors.orientation_deg.mean


def _diagnosed(session: Session) -> Iterator[tuple[str, float]]:
    found = session.diagnosis
    if found is not None:
        yield "error/diagnosed_geometry_mm", judged(found.before).position_mm.mean
        yield "error/diagnosed_effects_mm", judged(found.after).position_mm.mean
