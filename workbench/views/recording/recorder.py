"""The recorder: follows a session in a thread of its own, so that no command waits for a picture.

The worker only puts a moment into a queue. Transient moments (the middle of a drag) are superseded by later
ones, in the queue and by time; decisions are all drawn.
"""

import logging
import math
import os
import threading
import time
from collections import deque
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.session.page_state import Severity
from workbench.session.state import Session
from workbench.session.view import AbstractKeeper, Entry, Moment, Notify

if TYPE_CHECKING:  # rerun is read by the recorder's thread
    from workbench.views.recording.canvas import Canvas

STEM = "session"
INTERVAL = 0.1
"""Minimum time between two pictures in the middle of a drag, in the beginning [s]."""
OFTEN = 1000
"""Pictures of drags after which the time between them doubles, so that a long session stays small."""
MAX_WAITING = 5000
"""Moments in the queue beyond which the oldest are left out of the recording."""
PATIENCE = 20.0
"""How long the end of a session waits for its last pictures [s]."""
log = logging.getLogger(__name__)


class Recorder(AbstractKeeper):
    """Draws a session while it goes on.

    Args:
        open_canvas: Makes the canvas for the session as it stands; called in the recorder's own thread.
        after: How long the thread waits at first [s].
    """

    def __init__(
        self, open_canvas: Callable[[Session, Callable[[str], None]], "Canvas"], *, after: float = 0.0
    ):
        self._open, self._after = open_canvas, after
        self._queue: deque[Moment] = deque()
        self._changed = threading.Condition()
        self._passing, self._last = 0, -math.inf
        self._closing = False
        self._notify: Notify = lambda severity, text: None
        self._thread = threading.Thread(target=self._run, name="workbench-recorder", daemon=True)

    def begin(self, session: Session, *, step: int, at: float, notify: Notify) -> None:
        self._notify = notify
        self._put(Moment(step, at, session))
        self._thread.start()

    def note(self, step: int, entry: Entry, session: Session) -> None:
        self._put(Moment(step, entry.at, session, entry))

    def close(self) -> None:
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        if self._thread.ident is not None:
            self._thread.join(PATIENCE)

    def _put(self, moment: Moment) -> None:
        with self._changed:
            if self._queue and moment.replaces(self._queue[-1]):
                self._queue.pop()
            elif len(self._queue) >= MAX_WAITING:
                self._queue.popleft()
            self._queue.append(moment)
            self._changed.notify_all()

    def _run(self) -> None:
        with self._changed:
            self._changed.wait_for(lambda: self._closing, self._after)
        try:
            from workbench.views.recording.contents import MomentDrawing

            last = self._next()
            assert last is not None
            canvas = self._open(last.session, lambda text: self._notify(Severity.WARNING, text))
        except Exception as error:
            self._notify(Severity.WARNING, f"this session is not recorded for the rerun viewer: {error}")
            return
        try:
            drawing = MomentDrawing(canvas)
            drawing.draw(last)
            canvas.flush()  # a disk without room is told at the beginning
            while (moment := self._next()) is not None:
                drawing.draw(moment)
                self._passing, self._last = self._passing + moment.is_passing, time.monotonic()
                last = moment
            drawing.end(last.step)
        except Exception:
            log.exception("the recording was cut short")
        finally:
            canvas.close()

    def _next(self) -> Moment | None:
        """The next moment, once it is due; None when the session has ended and all is drawn."""
        with self._changed:
            self._changed.wait_for(lambda: self._queue or self._closing)
            if self._queue and self._queue[0].is_passing:
                due = self._last + INTERVAL * 2.0 ** (self._passing // OFTEN)
                wait = max(0.0, due - time.monotonic())
                self._changed.wait_for(lambda: len(self._queue) > 1 or self._closing, wait)
            return self._queue.popleft() if self._queue else None


def recorder(folder: Path | None, *, live: str | None = None, after: float = 0.0) -> Recorder:
    """Draws a session into its folder, and into an open viewer.

    Args:
        folder: The session's recording; None if there is none.
        live: Address of a viewer; None if there is none.
        after: How long it waits before it draws anything [s]: to read rerun takes a second of a processor.
    """

    def open_canvas(session: Session, notify: Callable[[str], None]) -> "Canvas":
        from workbench.views.recording.canvas import Canvas
        from workbench.views.recording.rerun_output import AbstractOutlet, FileOutlet, ViewerOutlet

        name = "session" if folder is None else folder.name
        outlets: list[AbstractOutlet] = []
        if folder is not None:
            files = (folder / f"{STEM}{'' if k == 1 else f'-{k}'}.rrd" for k in count(1))
            free = next(file for file in files if not os.path.lexists(file))  # nothing is written over
            outlets.append(FileOutlet(free, name, notify=notify))
        if live is not None:
            outlets.append(ViewerOutlet(live, name))
        return Canvas(outlets)

    return Recorder(open_canvas, after=after)


def parts(folder: Path) -> list[Path]:
    """Pictures of a recording: one file for every time that it was opened; links and pipes are none."""
    found = folder.glob(f"{STEM}*.rrd")
    return sorted(
        (path for path in found if path.is_file() and not path.is_symlink()),
        key=lambda p: (len(p.name), p.name),
    )
