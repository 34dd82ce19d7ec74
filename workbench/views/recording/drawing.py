"""Drawing moments one after the other, with all kinds of entities."""

import logging
import math
from collections.abc import Iterable, Iterator

import rerun as rr

from workbench.views.recording.canvas import Canvas
from workbench.views.recording.entities import (
    AT_ROWS,
    ENTITIES,
    AbstractEntity,
    Moment,
)

INTERVAL = 0.1
"""Least time between two pictures in the middle of a drag, in the beginning [s]."""
OFTEN = 1000
"""Pictures of drags after which the time between them doubles."""
log = logging.getLogger(__name__)


class Pace:
    """How often what is passing is drawn: less often the longer a session becomes, so that it stays small."""

    def __init__(self) -> None:
        self._passing, self._last = 0, -math.inf

    def note(self, moment: Moment, now: float) -> None:
        """A moment was drawn at this time [s]."""
        self._passing += moment.is_passing
        self._last = now

    def wait(self, now: float) -> float:
        """How long the next picture of what is passing has to wait [s]; not positive if it need not."""
        return self._last + INTERVAL * 2.0 ** (self._passing // OFTEN) - now


class Drawing:
    """Draws moments onto a canvas; what can't be drawn is left out, and the rest goes on."""

    def __init__(self, canvas: Canvas):
        self._canvas = canvas
        self._entities = tuple(kind() for kind in ENTITIES)
        self._rows: object = None
        canvas.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)

    def draw(self, moment: Moment) -> None:
        """Draw what is new in this moment."""
        rows = moment.session.comparison
        if rows is not None and rows is not self._rows and len(rows):
            self._canvas.at_rows()
            self._draw(moment, tuple(kind() for kind in AT_ROWS))
        self._rows = rows
        self._canvas.at(moment.step, moment.at)
        self._draw(moment, self._entities)

    def _draw(self, moment: Moment, entities: Iterable[AbstractEntity]) -> None:
        for entity in entities:
            try:
                entity.draw(self._canvas, moment)
            except Exception:
                log.exception("%s could not be drawn", type(entity).__name__)


def thinned(moments: Iterable[Moment]) -> Iterator[Moment]:
    """All decisions and the last moment, and of what is passing at most one in a while."""
    pace, last = Pace(), None
    for moment in moments:
        if last is not None and not moment.is_passing:
            yield last
        last = None
        if moment.is_passing and pace.wait(moment.at) > 0.0:
            last = moment
            continue
        pace.note(moment, moment.at)
        yield moment
    if last is not None:
        yield last
