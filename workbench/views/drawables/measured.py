"""Measured rows: tool positions, errors of both arms, and the selected row."""

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from workbench.base import se3
from workbench.session.comparison import STAGES, Comparison, ModelStage
from workbench.session.state import Focus, Session
from workbench.views.appearance.colours import (
    CALIBRATED,
    EXCLUDED,
    FITTED,
    MARK,
    NOMINAL,
    SET_APART,
    ErrorScale,
)
from workbench.views.appearance.shapes import Solid, ball
from workbench.views.drawables.drawable import Arrows, Axes, Colour, Mesh, Points
from workbench.views.drawables.sink import Item

MAX_ARROW_ROWS = 120
"""Rows with arrows or frames at most; of more, evenly chosen ones."""
RADIUS, SMALLEST, FEW = 0.005, 0.0018, 300
"""Radius of each of few measured points, and of each of very many [m]: together they cover the same area."""
FEW_ARROWS = 30
"""Arrows of full thickness; more are thinner, so that together they cover the same area."""
EARLIER = 0.5
"""Radius of points before the last event, as a part of the others'."""


def measured(session: Session) -> Iterator[Item]:
    """A round point at every fitted place, a square one where held out; arrows to where arms expect it."""
    rows, overlay = session.results.comparison, session.choices.overlay
    if rows is None:
        return
    is_shown = overlay.points and session.playback.focus is not Focus.TRACK
    inputs = rows, rows.nearest_stage(overlay.stage), session.measurements.left_out
    for path, *which in (
        ("measured", False, False),
        ("measured/before", False, True),
        ("measured/held_out", True, False),
        ("measured/held_out/before", True, True),
    ):
        if not which[1] or rows.over is not None:
            yield Item(path, _points, (*inputs, *which), shown=is_shown)
    yield Item("measured/set_apart", _set_apart, (rows,), shown=is_shown)
    is_compared = rows.calibrated is not None and session.playback.focus in (Focus.ROW, Focus.JOG)
    arms = (
        ("nominal", rows.nominal, overlay.exaggeration, NOMINAL),
        ("calibrated", rows.calibrated, overlay.exaggeration_after, CALIBRATED),
    )
    for name, poses, times, colour in arms:
        if poses is not None:
            yield Item(
                f"errors/{name}", _arrows, (rows, poses, times, colour), shown=is_compared and overlay.arrows
            )


def selected_row_marks(session: Session) -> Iterator[Item]:
    """Measured orientations, and the position of the selected row."""
    rows = session.results.comparison
    if rows is None:
        return
    is_shown = session.choices.overlay.frames and session.playback.focus is not Focus.TRACK
    yield Item("row/frames", _axes, (rows,), shown=is_shown)
    is_marked = session.playback.focus is Focus.ROW and session.choices.overlay.points
    place = rows.measured[session.results.row] if is_marked else None
    if place is not None and np.isfinite(place).all():
        yield Item("row/mark", mark, (0.012, place, 0.75))


@lru_cache(maxsize=4)
def error_scale(rows: Comparison) -> ErrorScale:
    return ErrorScale.of(rows.stage_errors)


def mark(radius: float, place: np.ndarray, opacity: float = 1.0) -> Mesh:
    """A yellow ball."""
    return Mesh(solid=_ball(radius), colour=MARK, opacity=opacity, pose=se3.pose(np.eye(3), place))


def _points(
    rows: Comparison, stage: ModelStage, left_out: frozenset[int], held_out: bool, before: bool
) -> Points | None:
    """Coloured by the error at a stage; of one colour before there is any, grey where left out by hand.

    Those before the last event are small.
    """
    known = np.isfinite(rows.measured).all(1)
    chosen = np.flatnonzero(known & (rows.held_out == held_out) & (rows.is_earlier == before))
    if not len(chosen):
        return None
    colours = np.tile(np.array(FITTED, np.uint8), (len(chosen), 1))
    if rows.stages:
        colours = error_scale(rows).colours(rows.stage_errors[chosen, STAGES.index(stage)])
    if not held_out:
        colours[np.isin(rows.number[chosen], list(left_out))] = EXCLUDED
    return Points(
        places=rows.measured[chosen],
        colours=colours,
        radius=point_radius(int(np.count_nonzero(known))) * (EARLIER if before else 1.0),
        numbers=chosen,
        are_squares=held_out,
    )


def point_radius(number: int) -> float:
    """Radius of each of so many points [m]."""
    return max(SMALLEST, RADIUS * min(1.0, (FEW / max(number, 1)) ** 0.5))


def _set_apart(rows: Comparison) -> Points | None:
    """Red balls where rows were measured that no arm explains; clicks go through them."""
    count = len(rows.set_apart)
    if not count:
        return None
    return Points(
        places=rows.set_apart,
        colours=np.tile(np.array(SET_APART, np.uint8), (count, 1)),
        radius=2.0 * RADIUS,
        numbers=np.full(count, -1),
    )


def _arrows(rows: Comparison, poses: np.ndarray, times: float, colour: Colour) -> Arrows | None:
    chosen = _chosen(rows)
    starts = rows.measured[chosen]
    ends = starts + times * (poses[chosen, :3, 3] - starts)
    if not len(chosen):
        return None
    return Arrows(starts=starts, ends=ends, colour=colour, thick=min(1.0, (FEW_ARROWS / len(chosen)) ** 0.5))


def _axes(rows: Comparison) -> Axes | None:
    chosen = _chosen(rows)
    if rows.rotation is None or not len(chosen) or not np.isfinite(rows.rotation[chosen]).all():
        return None
    return Axes(places=rows.measured[chosen], rotations=rows.rotation[chosen])


def _chosen(rows: Comparison) -> np.ndarray:
    """Numbers of the rows with arrows and frames."""
    known = np.flatnonzero(np.isfinite(rows.measured).all(1))
    return known[:: max(1, -(-len(known) // MAX_ARROW_ROWS))]


@lru_cache(maxsize=4)
def _ball(radius: float) -> Solid:
    return ball(radius, np.zeros(3))
