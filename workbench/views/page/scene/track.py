"""A trajectory in the scene: its way, the arms that move along it, and behind them the trail of errors.

The session says that it is played, and since where; the moving itself is a matter of the view. One thread
moves the arms, so that neither the worker nor the panels wait for a frame.
"""

import itertools
import threading
import time
from collections.abc import Callable
from typing import final

import numpy as np
import viser
from jaxtyping import Float, Int, UInt8

from workbench.session.commands.track import PlaceTrack
from workbench.session.state import Focus, Play, Session
from workbench.session.track import Track
from workbench.session.worker import Worker
from workbench.views.appearance.colours import (
    GHOST,
    MARK,
    REGION,
    scale_colours,
)
from workbench.views.page.camera import from_outside, look_at
from workbench.views.page.scene.arm import Arm
from workbench.views.page.scene.nodes import linear
from workbench.views.page.scene.part import AbstractPart

RATE = 25.0
"""Frames a second."""
PIECES = 48
"""Parts in which the trail grows."""
HIGH = 0.5
"""How high an arm may stand above its first frame, as a share of its reach."""
LEAST = 1e-6
"""Errors below this are none [m]."""


class TrackPart(AbstractPart):
    """Drawn anew for another trajectory or exaggeration.

    Args:
        server: Where.
        worker: Told where the arm has stopped.
        session: To begin with.
        moves: Move the arms that are drawn elsewhere to joint positions along the way.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        worker: Worker,
        session: Session,
        *moves: Callable[[np.ndarray], None],
    ):
        self._server, self._worker, self._moves = server, worker, moves
        self._lock = threading.Lock()
        self._track: Track | None = None
        self._times = 0.0
        self._play: Play | None = None
        self._ghost: Arm | None = None
        self._nodes: list[viser.SceneNodeHandle] = []
        self._trail: list[viser.LineSegmentsHandle] = []
        self._ends = np.zeros(0, int)
        self._mark: viser.IcosphereHandle | None = None
        self._run: _Run | None = None
        self.show(session)

    def show(self, session: Session) -> None:
        with self._lock:
            self._show(session)

    def _show(self, session: Session) -> None:
        track, times = session.track, session.overlay.exaggeration
        if track is not self._track:
            self._stop()
            self._draw_arm(track)
            self._look(track)
        if track is not self._track or times != self._times:
            self._track, self._times = track, times
            self._draw_way(track, times)
        is_shown = session.focus is Focus.TRACK and track is not None
        for node in self._nodes:
            node.visible = is_shown
        if self._ghost is not None:
            self._ghost.visible = is_shown and session.overlay.calibrated
        if session.is_playing:
            self._go_on(session)
            return
        at = session.play.at if self._run is None else self._run.at
        if self._run is not None:
            self._stop()
            self._worker.submit(PlaceTrack(at))
        if track is not None:
            self._stand(track, at, is_shown=is_shown)

    def _draw_arm(self, track: Track | None) -> None:
        if self._ghost is not None:
            self._ghost.remove()
            self._ghost = None
        if track is not None and track.actual is not None:
            self._ghost = Arm(
                self._server, "/track/arm", track.actual, ghost=GHOST, is_plain=True, has_foot=False
            )

    def _look(self, track: Track | None) -> None:
        """Every page looks at another way when it is first there."""
        old = self._track
        if track is None or (old is not None and (old.kind, old.robot) == (track.kind, track.robot)):
            return
        arm = np.outer([0.0, HIGH * track.robot.reach], [0.0, 0.0, 1.0])
        for client in self._server.get_clients().values():
            look_at(client, np.vstack([track.wanted, arm]), along=from_outside(track.wanted))

    def _draw_way(self, track: Track | None, times: float) -> None:
        for node in (*self._nodes, *self._trail, *([] if self._mark is None else [self._mark])):
            node.remove()
        self._nodes, self._trail, self._mark = [], [], None
        if track is None:
            return
        add = self._server.scene
        way = np.stack([track.wanted[:-1], track.wanted[1:]], axis=1)
        self._nodes.append(line_of(add, "/track/way", way, np.array(REGION), 1.5))
        shown = track.wanted + times * (track.reached - track.wanted)
        segments, colours = np.stack([shown[:-1], shown[1:]], axis=1), trail_colours(track.errors)
        self._ends = piece_ends(len(segments))
        for i, (begin, end) in enumerate(itertools.pairwise([0, *self._ends.tolist()])):
            line = line_of(add, f"/track/trail{i}", segments[begin:end], colours[begin:end], 5.0)
            line.visible = False
            self._trail.append(line)
        self._mark = add.add_icosphere(
            "/track/mark", radius=0.008, color=MARK, cast_shadow=False, receive_shadow=False
        )

    def _stand(self, track: Track, at: float, *, is_shown: bool = True) -> None:
        """The erring arm, the mark and the trail at this time."""
        row = float(np.interp(at, track.time, np.arange(len(track.time))))
        for end, piece in zip(self._ends, self._trail, strict=True):
            piece.visible = is_shown and bool(end <= row + 1e-9)
        if self._mark is not None:
            self._mark.visible = is_shown
            self._mark.position = np.array([np.interp(at, track.time, c) for c in track.wanted.T])
        if self._ghost is not None and track.actual is not None and is_shown:
            self._ghost.stand(track.actual, track.at(at))

    def _go_on(self, session: Session) -> None:
        """Begin a thread for what was asked for last."""
        if self._play == session.play and self._run is not None:
            return
        at = session.play.at
        if self._run is not None and self._play is not None and self._play.at == session.play.at:
            at = self._run.at  # another pace: go on from here
        self._stop()
        self._play = session.play
        self._run = _Run(self, session.track, at, session.play.pace)

    def _stop(self) -> None:
        if self._run is not None:
            self._run.stop.set()
        self._run = self._play = None

    def frame(self, run: "_Run") -> None:
        """Move all arms to where a run has come; its thread calls this."""
        with self._server.atomic(), self._lock:
            if run.stop.is_set():
                return
            for move in self._moves:
                move(run.track.at(run.at))
            self._stand(run.track, run.at)
        if run.at >= run.track.duration:
            self._worker.submit(PlaceTrack(run.track.duration))


@final
class _Run:
    """The thread of one run.

    Args:
        part: What it moves.
        track: Along this.
        at: From this time on [s].
        pace: So many times faster than its own time.
    """

    def __init__(self, part: TrackPart, track: Track, at: float, pace: float):
        self.track, self.at, self.stop = track, at, threading.Event()
        self._part, self._pace = part, pace
        threading.Thread(target=self._go, name="workbench-track", daemon=True).start()

    def _go(self) -> None:
        last = time.monotonic()
        while not self.stop.wait(1.0 / RATE):
            now = time.monotonic()
            self.at, last = min(self.at + self._pace * (now - last), self.track.duration), now
            self._part.frame(self)
            if self.at >= self.track.duration:
                return


def line_of(
    scene: viser.SceneApi, name: str, segments: np.ndarray, colours: np.ndarray, pixels: float
) -> viser.LineSegmentsHandle:
    """Segments as wide as so many pixels, from near and far."""
    return scene.add_line_segments(name, segments, colors=colours, thickness=pixels, thickness_units="screen")


def trail_colours(errors: Float[np.ndarray, " rows"]) -> UInt8[np.ndarray, "segments 2 3"]:
    """Colours of the trail's segments: from good where the error is least to bad where it is greatest."""
    low, high = float(errors.min()), float(errors.max())
    shares = 1.0 - (errors - low) / max(high - low, LEAST) if high > LEAST else np.ones(len(errors))
    colours = linear(scale_colours(shares))
    return np.stack([colours[:-1], colours[1:]], axis=1)


def piece_ends(segments: int) -> Int[np.ndarray, " pieces"]:
    """Segments after which the pieces of a trail end."""
    return np.unique(np.linspace(0, segments, PIECES + 1).round().astype(int))[1:]
