"""Plays a trajectory. The session says that it is played, and since where; the moving itself is the page's.

One thread moves the arms, so that neither the worker nor the panels wait for a frame.
"""

import threading
import time
from collections.abc import Callable
from typing import final

import numpy as np
import viser

from workbench.session.commands.trajectory import PlaceTrack
from workbench.session.planned_trajectory import Play, Track
from workbench.session.state import Session
from workbench.session.worker import Worker
from workbench.views.page.camera import from_outside, look_at

RATE = 25.0
"""Frames a second."""
HIGH = 0.5
"""How high an arm may stand above its first frame, as a share of its reach."""


class Player:
    """Knows how far along its trajectory the arm is while it moves.

    Args:
        server: Whose pages look at a new trajectory.
        worker: Told where the arm has stopped.
        frame: Draws the arms; called by the thread for every frame, with what advances the arm.
    """

    def __init__(self, server: viser.ViserServer, worker: Worker, frame: Callable[["Run"], None]):
        self._server, self._worker, self._frame = server, worker, frame
        self._track: Track | None = None
        self._play: Play | None = None
        self._run: Run | None = None
        self._at = 0.0

    def follow(self, session: Session) -> float:
        """Begin, go on, or stop as the session says.

        Returns:
            The time along the trajectory where the arm stands now [s].
        """
        if session.track is not self._track:
            self._stop()
            self._look(session.track)
            self._track = session.track
        if session.is_playing:
            self._go_on(session)
        elif self._run is not None:
            self._at = self._run.at
            self._stop()
            self._worker.submit(PlaceTrack(self._at))
        if self._run is not None:
            self._at = self._run.at
        elif not session.is_underway:
            self._at = session.play.at
        return self._at

    def _go_on(self, session: Session) -> None:
        """Begin a thread for what was asked for last."""
        if self._play == session.play and self._run is not None:
            return
        assert session.track is not None
        at = session.play.at
        if self._run is not None and self._play is not None and self._play.at == session.play.at:
            at = self._run.at  # another pace: go on from here
        self._stop()
        self._play = session.play
        self._run = Run(at, session.track.duration, session.play.pace, self._step)

    def _step(self, run: "Run") -> None:
        self._frame(run)
        if run.is_done and not run.stop.is_set():
            self._worker.submit(PlaceTrack(run.at))

    def _stop(self) -> None:
        if self._run is not None:
            self._run.stop.set()
        self._run = self._play = None

    def _look(self, track: Track | None) -> None:
        """Every page looks at a new trajectory once."""
        old = self._track
        if track is None or (old is not None and (old.kind, old.robot) == (track.kind, track.robot)):
            return
        arm = np.outer([0.0, HIGH * track.robot.reach], [0.0, 0.0, 1.0])
        for client in self._server.get_clients().values():
            look_at(client, np.vstack([track.wanted, arm]), along=from_outside(track.wanted))


@final
class Run:
    """The thread of one run.

    Args:
        at: From this time on [s].
        end: Up to this one [s].
        pace: So many times faster than its own time.
        step: Called for every frame.
    """

    def __init__(self, at: float, end: float, pace: float, step: Callable[["Run"], None]):
        self.at, self.stop = at, threading.Event()
        self.end, self._pace, self._step = end, pace, step
        threading.Thread(target=self._go, name="workbench-track", daemon=True).start()

    @property
    def is_done(self) -> bool:
        """Whether the end is reached."""
        return self.at >= self.end

    def _go(self) -> None:
        last = time.monotonic()
        while not self.stop.wait(1.0 / RATE):
            now = time.monotonic()
            self.at, last = min(self.at + self._pace * (now - last), self.end), now
            self._step(self)
            if self.is_done:
                return
