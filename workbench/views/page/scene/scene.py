"""The whole scene of one arm on one plate, rebuilt for another arm or plate; and trajectories played in it.

The session says that a trajectory is played, and since where; the moving itself is the page's. One thread
moves the arms, so that neither the worker nor the panels wait for a frame.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import final

import numpy as np
import viser

from workbench.session.commands.compare import ShowRow
from workbench.session.commands.drag import SelectTarget
from workbench.session.commands.playing import PlaceTrack
from workbench.session.commands.region import ShowCubes
from workbench.session.played_motion import AbstractMotion, Played
from workbench.session.state import Focus, Session
from workbench.session.worker import Worker
from workbench.views.drawables.scene_contents import in_motion, on_page
from workbench.views.drawables.viewpoint import first_view, from_outside, view_of
from workbench.views.page.camera import aim, aim_all
from workbench.views.page.scene.gizmo import Corners, Gizmo
from workbench.views.page.scene.start_scene import FirstPicture
from workbench.views.page.style import name_pages


class Scene:
    """Everything in the scene, drawn together, on from what is `drawn` already; gestures only send commands.

    `moved` is told the share of a trajectory that is done, frame by frame.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        worker: Worker,
        session: Session,
        *,
        drawn: FirstPicture | None = None,
    ):
        self._server, self._worker = server, worker
        self._lock = threading.Lock()
        self.moved: Callable[[float], None] = lambda share: None
        self._player = Player(server, worker, self._frame)
        self._session = session
        if drawn is not None and not drawn.ground.suits(session.robot):  # it has changed since
            server.scene.reset()
            drawn = None
        self._build(session, drawn or FirstPicture(server, session.robot))
        self._look(session)
        self.show(session)
        server.on_client_disconnect(lambda client: self.gizmo.left(client))
        server.scene.on_click()(self._clicked)

    @property
    def is_behind(self) -> bool:
        """Whether something keeps an older picture for now."""
        return self._sink.is_behind

    def show(self, session: Session) -> None:
        """Draw what has changed in this snapshot."""
        with self._lock:
            before, self._session = self._session, session
            first, former = session.history.first.plate, before.history.first.plate
            is_other = session.robot is not before.robot or first is not former
            if is_other:
                self._server.scene.reset()
                self._build(session, FirstPicture(self._server, session.robot))
            if is_other or _has_other_rows(before, session):
                self._look(session)
            self._ground.show(session.page.is_dark)
            self._sink.is_behind = False
            self._sink.draw(on_page(_at(session, self._player.follow(session))))
            self._corners.show(session)
            self.gizmo.show(session)

    def _build(self, session: Session, drawn: FirstPicture) -> None:
        self._ground, self._sink = drawn.ground, drawn.sink
        name_pages(self._server, session.robot.name)
        self._corners = Corners(self._server, self._worker, session)
        self.gizmo = Gizmo(self._server, self._worker, session)

    def _look(self, session: Session) -> None:
        """Every page, and those that are opened later, look at what there is now."""
        aim_all(self._server, *first_view(session))

    def _frame(self, run: "TrackRun") -> None:
        """Move all arms to where a run has come."""
        with self._server.atomic(), self._lock:
            if not run.stop.is_set():
                self._sink.update(in_motion(_at(self._session, run.at)))
                self.moved(run.at / run.end)

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        """A click on a target, a measured point or a cube."""
        with self._lock:
            is_of_rows = (
                self._session.playback.focus is Focus.ROW
            )  # those of a given plate lie at its targets
            ray = np.array(event.ray_origin), np.array(event.ray_direction)
            found = self._sink.picked(ray, points_first=is_of_rows)
        if found is None:
            return
        path, number = found
        if path == "region/cubes":
            self._worker.submit(ShowCubes(replace(self._worker.session.region.view, picked=number)))
        elif path.startswith("plate/targets/"):
            self._worker.submit(SelectTarget(number))
        else:
            self._worker.submit(ShowRow(number))


def _has_other_rows(before: Session, now: Session) -> bool:
    """Whether plate or measurements have come or gone, or lie elsewhere because the base is known now."""
    loaded = now.measurements.loaded
    if loaded is not before.measurements.loaded or now.shows_plate is not before.shows_plate:
        return True
    was, here = (s.results.identification is not None for s in (before, now))
    return loaded is not None and here and not was


def _at(session: Session, time: float) -> Session:
    """The session with the arm at this time along its trajectory [s]."""
    played = session.part(Played)
    return session if played is None or played.at == time else session.with_part(replace(played, at=time))


RATE = 25.0
"""Frames a second."""
HIGH = 0.5
"""How high an arm may stand above its first frame, as a share of its reach."""


class Player:
    """Knows how far along its trajectory the arm is while it moves.

    `frame` draws the arms: it is called by the run's thread, with what advances the arm.
    """

    def __init__(self, server: viser.ViserServer, worker: Worker, frame: Callable[["TrackRun"], None]):
        self._server, self._worker, self._frame = server, worker, frame
        self._motion: AbstractMotion | None = None
        self._played: Played | None = None
        self._run: TrackRun | None = None
        self._at = 0.0

    def follow(self, session: Session) -> float:
        """Begin, go on, or stop as the session says; returns the time along the trajectory now [s]."""
        played = session.part(Played)
        if (motion := played and played.motion) is not self._motion:
            self._stop()
            self._look(motion, session.robot.reach)
            self._motion = motion
        if played is not None and session.is_playing:
            self._go_on(played)
        elif self._run is not None:
            self._at = self._run.at
            self._stop()
            self._worker.submit(PlaceTrack(self._at))
        if self._run is not None:
            self._at = self._run.at
        elif not session.is_track_active:
            self._at = 0.0 if played is None else played.at
        return self._at

    def _go_on(self, played: Played) -> None:
        """Begin a thread for what was asked for last."""
        if self._played == played and self._run is not None:
            return
        at = played.at
        if self._run is not None and self._played is not None and self._played.at == at:
            at = self._run.at  # another pace: go on from here
        self._stop()
        self._played = played
        self._run = TrackRun(at, played.motion.duration, played.pace, self._step)

    def _step(self, run: "TrackRun") -> None:
        self._frame(run)
        if run.is_done and not run.stop.is_set():
            self._worker.submit(PlaceTrack(run.at))

    def _stop(self) -> None:
        if self._run is not None:
            self._run.stop.set()
        self._run = self._played = None

    def _look(self, motion: AbstractMotion | None, reach: float) -> None:
        """Every page looks at a new trajectory once."""
        if motion is None or (self._motion is not None and motion.looks_like(self._motion)):
            return
        path, arm = motion.view(), np.outer([0.0, HIGH * reach], [0.0, 0.0, 1.0])
        for client in self._server.get_clients().values():
            aim(client, *view_of(np.vstack([path, arm]), along=from_outside(path)))


@final
class TrackRun:
    """The thread of one run, from one time to another [s], `pace` times as fast; `step` draws every frame."""

    def __init__(self, at: float, end: float, pace: float, step: Callable[["TrackRun"], None]):
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
