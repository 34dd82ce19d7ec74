"""Measured rows: where the tool was, how either arm errs there, and which row is looked at."""

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from workbench.base import se3
from workbench.session.comparison import Comparison
from workbench.session.state import Focus, Session
from workbench.views.appearance.colours import ARROW_AFTER, ARROW_BEFORE, FITTED, HELD_OUT, LEFT_OUT, MARK
from workbench.views.appearance.shapes import Solid, ball
from workbench.views.drawables.drawable import Arrows, Axes, Colour, Mesh, Points
from workbench.views.drawables.item import Item

MOST_ROWS = 400
"""Rows drawn at most; of more, evenly chosen ones."""


def measured(session: Session) -> Iterator[Item]:
    """A ball at every measured place, and arrows from there to where either arm is predicted."""
    rows, overlay = session.comparison, session.overlay
    if rows is None:
        return
    is_shown = overlay.frames and session.focus is not Focus.TRACK
    yield Item("measured", _points, (rows, session.left_out), shown=is_shown)
    is_compared = rows.calibrated is not None and session.focus in (Focus.ROW, Focus.JOG)
    arms = (("nominal", rows.nominal, ARROW_BEFORE), ("calibrated", rows.calibrated, ARROW_AFTER))
    for name, poses, colour in arms:
        if poses is not None:
            inputs = rows, poses, overlay.exaggeration, colour
            yield Item(f"errors/{name}", _arrows, inputs, shown=is_compared and overlay.arrows)


def looked_at(session: Session) -> Iterator[Item]:
    """Measured orientations, and the place of the row that is looked at."""
    rows = session.comparison
    if rows is None:
        return
    is_shown = session.overlay.frames and session.focus is not Focus.TRACK
    yield Item("row/frames", _axes, (rows,), shown=is_shown)
    place = rows.measured[session.row] if session.focus is Focus.ROW else None
    if place is not None and np.isfinite(place).all():
        yield Item("row/mark", mark, (0.012, place, 0.75))


def mark(radius: float, place: np.ndarray, opacity: float = 1.0) -> Mesh:
    """A yellow ball."""
    return Mesh(solid=_ball(radius), colour=MARK, opacity=opacity, pose=se3.pose(np.eye(3), place))


def _points(rows: Comparison, left_out: frozenset[int]) -> Points | None:
    """Coloured by what the row is for: fitted, held out, or left out by hand."""
    chosen = _chosen(rows)
    out = np.isin(rows.number, list(left_out)) & ~rows.held_out
    colours = np.where(rows.held_out[:, None], HELD_OUT, FITTED)
    colours = np.where(out[:, None], LEFT_OUT, colours).astype(np.uint8)
    places = rows.measured[chosen]
    return (
        Points(places=places, colours=colours[chosen], radius=0.006, numbers=chosen) if len(chosen) else None
    )


def _arrows(rows: Comparison, poses: np.ndarray, times: float, colour: Colour) -> Arrows | None:
    chosen = _chosen(rows)
    starts = rows.measured[chosen]
    ends = starts + times * (poses[chosen, :3, 3] - starts)
    return Arrows(starts=starts, ends=ends, colour=colour) if len(chosen) else None


def _axes(rows: Comparison) -> Axes | None:
    chosen = _chosen(rows)
    if rows.rotation is None or not len(chosen) or not np.isfinite(rows.rotation[chosen]).all():
        return None
    return Axes(places=rows.measured[chosen], rotations=rows.rotation[chosen])


def _chosen(rows: Comparison) -> np.ndarray:
    """Numbers of the rows that are drawn."""
    known = np.flatnonzero(np.isfinite(rows.measured).all(1))
    return known[:: max(1, -(-len(known) // MOST_ROWS))]


@lru_cache(maxsize=4)
def _ball(radius: float) -> Solid:
    return ball(radius, np.zeros(3))
