"""Drawing moments one after the other, with all kinds of entities."""

import logging
from collections.abc import Iterable, Iterator

import rerun as rr

from workbench.record.canvas import Canvas
from workbench.record.entities import ENTITIES, Moment

INTERVAL = 0.1
"""Least time between two pictures in the middle of a drag [s]."""
log = logging.getLogger(__name__)


class Drawing:
    """Draws moments onto a canvas; what can't be drawn is left out, and the rest goes on."""

    def __init__(self, canvas: Canvas):
        self._canvas = canvas
        self._entities = tuple(kind() for kind in ENTITIES)
        canvas.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)

    def draw(self, moment: Moment) -> None:
        """Draw what is new in this moment."""
        self._canvas.at(moment.step, moment.at)
        for entity in self._entities:
            try:
                entity.draw(self._canvas, moment)
            except Exception:
                log.exception("%s could not be drawn", type(entity).__name__)


def thinned(moments: Iterable[Moment]) -> Iterator[Moment]:
    """All decisions and the last moment, and of what is passing at most one in a while."""
    drawn, last = -INTERVAL, None
    for moment in moments:
        if last is not None and last.is_passing and not moment.is_passing:
            yield last
        last = None
        if moment.is_passing and moment.at - drawn < INTERVAL:
            last = moment
            continue
        drawn = moment.at
        yield moment
    if last is not None:
        yield last
