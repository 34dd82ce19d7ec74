"""The whole scene of one arm on one plate; rebuilt for another arm or plate."""

import threading
from collections.abc import Callable
from dataclasses import replace

import viser

from workbench.session.commands.compare import ShowRow
from workbench.session.commands.drag import SelectTarget
from workbench.session.commands.region import ShowCubes
from workbench.session.state import Focus, Session
from workbench.session.worker import Worker
from workbench.views.drawables.subjects import in_motion, on_page
from workbench.views.page.camera import aim_all
from workbench.views.page.first_view import first_view
from workbench.views.page.scene.first_picture import FirstPicture
from workbench.views.page.scene.gizmo import Corners, Gizmo
from workbench.views.page.scene.node import ray_of
from workbench.views.page.scene.player import Player, Run


class Scene:
    """Everything in the scene, drawn together; gestures only send commands.

    Args:
        server: Where.
        worker: What takes the commands.
        session: Its first snapshot.
        drawn: What is there already; None for nothing.

    Attributes:
        moved: Told the share of a trajectory that is done, frame by frame.
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
            is_other = session.robot is not before.robot or session.first_plate is not before.first_plate
            if is_other:
                self._server.scene.reset()
                self._build(session, FirstPicture(self._server, session.robot))
            if is_other or _has_other_rows(before, session):
                self._look(session)
            self._ground.show(session.is_dark)
            self._sink.is_behind = False
            self._sink.draw(on_page(_at(session, self._player.follow(session))))
            self._corners.show(session)
            self.gizmo.show(session)

    def _build(self, session: Session, drawn: FirstPicture) -> None:
        self._ground, self._sink = drawn.ground, drawn.sink
        self._corners = Corners(self._server, self._worker, session)
        self.gizmo = Gizmo(self._server, self._worker, session)

    def _look(self, session: Session) -> None:
        """Every page, and those that are opened later, look at what there is now."""
        aim_all(self._server, *first_view(session))

    def _frame(self, run: Run) -> None:
        """Move all arms to where a run has come."""
        with self._server.atomic(), self._lock:
            if not run.stop.is_set():
                self._sink.update(in_motion(_at(self._session, run.at)))
                self.moved(run.at / run.end)

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        """A click on a target, a measured point or a cube."""
        with self._lock:
            is_of_rows = self._session.focus is Focus.ROW  # those of a given plate lie at its targets
            found = self._sink.picked(ray_of(event), points_first=is_of_rows)
        if found is None:
            return
        path, number = found
        if path == "region/cubes":
            self._worker.submit(ShowCubes(replace(self._worker.session.cube_view, picked=number)))
        elif path.startswith("plate/targets/"):
            self._worker.submit(SelectTarget(number))
        else:
            self._worker.submit(ShowRow(number))


def _has_other_rows(before: Session, now: Session) -> bool:
    """Whether measurements have come or gone, or lie elsewhere because the base is known now."""
    if now.loaded is not before.loaded:
        return True
    return now.loaded is not None and (before.identification is None) > (now.identification is None)


def _at(session: Session, time: float) -> Session:
    """The session with the arm at this time along its trajectory [s]."""
    return session if session.play.at == time else replace(session, play=replace(session.play, at=time))
