"""Measured rows: tool positions, errors of the nominal and of the shown model, and the selected row."""

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from workbench.base import se3
from workbench.session.comparison import STAGES, Comparison, ModelStage
from workbench.session.stages import shown_stage
from workbench.session.state import Focus, Session
from workbench.views.appearance import colours
from workbench.views.appearance.colours import ErrorScale
from workbench.views.appearance.shapes import Solid, ball
from workbench.views.drawables.drawable import Arrows, Colour, Label, Mesh, Points
from workbench.views.drawables.sink import Item

MAX_ARROW_ROWS = 120
"""Rows with arrows at most; of more, evenly chosen ones."""
RADIUS, SMALLEST, FEW = 0.005, 0.0018, 300
"""Radius of each of few measured points, and of each of very many [m]: together they cover the same area."""
FEW_ARROWS = 30
"""Arrows of full thickness; more are thinner, so that together they cover the same area."""
LONGEST_SAMPLE = 0.1
"""Longest arrow that shows how long an error is drawn, in reaches."""
SAMPLE_ASIDE = 0.22
"""How far beside the base's axis the arrow stands that shows how long an error is drawn, in reaches."""


def measured(session: Session) -> Iterator[Item]:
    """A round point at every fitted place, a square one where held out; arrows from where arms expect it."""
    rows, overlay = session.results.comparison, session.choices.overlay
    if rows is None:
        return
    is_shown, stage = session.seen_rows is not None, shown_stage(session, rows)
    inputs = rows, stage, session.measurements.left_out
    for path, is_held_out in (("measured", False), ("measured/held_out", True)):
        yield Item(path, _points, (*inputs, is_held_out), shown=is_shown)
    yield Item("measured/set_apart", _set_apart, (rows, inputs[2]), shown=is_shown)
    is_compared = bool(rows.stages) and overlay.arrows and session.playback.focus in (Focus.ROW, Focus.JOG)
    times = overlay.exaggeration
    nominal = rows, ModelStage.NOMINAL, times, colours.NOMINAL
    yield Item("errors/nominal", _arrows, nominal, shown=is_compared)
    is_other = is_compared and stage is not ModelStage.NOMINAL
    shown = rows, stage, times, colours.STAGE_COLOURS[stage]
    yield Item("errors/calibrated", _arrows, shown, shown=is_other)
    scale = rows, times, session.robot.reach
    yield Item("errors/sample", lambda *of: _sample(*of)[0], scale, shown=is_compared)
    yield Item("errors/sample_words", lambda *of: _sample(*of)[1], scale, shown=is_compared)


def selected_row_mark(session: Session) -> Iterator[Item]:
    """The position of the selected row."""
    rows, overlay = session.results.comparison, session.choices.overlay
    if rows is None:
        return
    is_marked = session.playback.focus is Focus.ROW and overlay.points
    place = rows.measured[session.results.row] if is_marked else None
    if place is not None and np.isfinite(place).all():
        yield Item("row/mark", mark, (0.012, place, 0.75))


@lru_cache(maxsize=4)
def error_scale(rows: Comparison) -> ErrorScale:
    return ErrorScale.of(rows.stage_errors)


def mark(radius: float, place: np.ndarray, opacity: float = 1.0) -> Mesh:
    """A yellow ball."""
    return Mesh(solid=_ball(radius), colour=colours.MARK, opacity=opacity, pose=se3.pose(np.eye(3), place))


def _points(rows: Comparison, stage: ModelStage, left_out: frozenset[int], held_out: bool) -> Points | None:
    """Coloured by the error at a stage; of one colour before there is any, grey where left out by hand."""
    known = np.isfinite(rows.measured).all(1)
    chosen = np.flatnonzero(known & (rows.held_out == held_out))
    if not len(chosen):
        return None
    radius = max(SMALLEST, RADIUS * min(1.0, (FEW / max(int(known.sum()), 1)) ** 0.5))
    inks = np.tile(np.array(colours.FITTED, np.uint8), (len(chosen), 1))
    if rows.stages:
        inks = error_scale(rows).colours(rows.stage_errors[chosen, STAGES.index(stage)])
    inks[np.isin(rows.number[chosen], list(left_out))] = colours.EXCLUDED
    places = rows.measured[chosen]
    return Points(places=places, colours=inks, radius=radius, numbers=chosen, are_squares=held_out)


def _set_apart(rows: Comparison, left_out: frozenset[int]) -> Points | None:
    """Red balls where rows were measured that no arm explains, unless left out; clicks go through them."""
    places = rows.measured[rows.set_apart & ~np.isin(rows.number, list(left_out))]
    if not (count := len(places := places[np.isfinite(places).all(1)])):
        return None
    inks = np.tile(np.array(colours.SET_APART, np.uint8), (count, 1))
    return Points(places=places, colours=inks, radius=2.0 * RADIUS, numbers=np.full(count, -1))


def _arrows(rows: Comparison, stage: ModelStage, times: float, colour: Colour) -> Arrows | None:
    known = np.flatnonzero(np.isfinite(rows.measured).all(1) & ~rows.kept_out)
    chosen = known[:: max(1, -(-len(known) // MAX_ARROW_ROWS))]
    off = -rows.residuals[chosen, STAGES.index(stage)]
    chosen, off = chosen[np.isfinite(off).all(1)], off[np.isfinite(off).all(1)]
    if not len(chosen):
        return None
    starts = rows.measured[chosen] - off
    thick = min(1.0, (FEW_ARROWS / len(chosen)) ** 0.5)
    return Arrows(starts=starts, ends=starts + times * off, colour=colour, thick=thick)


def _sample(rows: Comparison, times: float, reach: float) -> tuple[Arrows, Label]:
    """An upright arrow beside the base, on the right of the rows as one looks at the arm from there."""
    x, y = np.nanmean(rows.measured[:, :2], axis=0)
    start = SAMPLE_ASIDE * reach / max(float(np.hypot(x, y)), 1e-9) * np.array([y, -x, 0.0])
    error = colours.rounded(LONGEST_SAMPLE * reach / times, up=False)
    end = start + np.array([0.0, 0.0, times * error])
    below = start - np.array([0.0, 0.0, 0.05 * reach])  # what happened to the base has its words above
    words = Label(text=f"this long = {1e3 * error:g} mm", place=below)
    return Arrows(starts=start[None], ends=end[None], colour=colours.MARK, thick=2.0), words


@lru_cache(maxsize=4)
def _ball(radius: float) -> Solid:
    return ball(radius, np.zeros(3))
