"""The whole scene of one arm on one plate; made anew for another arm or plate."""

import threading
from dataclasses import replace

import viser

from workbench.session.commands.compare import ShowRow
from workbench.session.commands.drag import SelectTarget
from workbench.session.commands.region import ShowCubes
from workbench.session.state import Session
from workbench.session.worker import Worker
from workbench.views.drawables import in_motion, on_page
from workbench.views.page.camera import aim
from workbench.views.page.scene.corners import Corners
from workbench.views.page.scene.gizmo import Gizmo
from workbench.views.page.scene.ground import Ground, first_view
from workbench.views.page.scene.player import Player, Run
from workbench.views.page.scene.viser_sink import PageSink


class Scene:
    """Everything in the scene, drawn together; gestures only send commands."""

    def __init__(self, server: viser.ViserServer, worker: Worker, session: Session):
        self._server, self._worker = server, worker
        self._lock = threading.Lock()
        self._player = Player(server, worker, self._frame)
        self._session = session
        self._build(session)
        self.show(session)
        server.on_client_disconnect(lambda client: self.gizmo.left(client))

    def show(self, session: Session) -> None:
        """Draw what has changed in this snapshot."""
        with self._lock:
            if (
                session.robot is not self._session.robot
                or session.first_plate is not self._session.first_plate
            ):
                self._server.scene.reset()
                self._build(session)
                for client in self._server.get_clients().values():
                    aim(client, *first_view(session))
            self._session = session
            self._ground.show(session)
            self._sink.draw(on_page(_at(session, self._player.follow(session))))
            self._corners.show(session)
            self.gizmo.show(session)

    def _build(self, session: Session) -> None:
        self._ground = Ground(self._server, session)
        self._sink = PageSink(self._server, self._clicked)
        self._corners = Corners(self._server, self._worker, session)
        self.gizmo = Gizmo(self._server, self._worker, session)

    def _frame(self, run: Run) -> None:
        """Move all arms to where a run has come."""
        with self._server.atomic(), self._lock:
            if not run.stop.is_set():
                self._sink.update(in_motion(_at(self._session, run.at)))

    def _clicked(self, path: str, number: int) -> None:
        if path.startswith("plate/targets/"):
            self._worker.submit(SelectTarget(number))
        elif path == "measured":
            self._worker.submit(ShowRow(number))
        elif path == "region/cubes":
            self._worker.submit(ShowCubes(replace(self._worker.session.cube_view, picked=number)))


def _at(session: Session, time: float) -> Session:
    """The session with the arm at this time along its trajectory [s]."""
    return session if session.play.at == time else replace(session, play=replace(session.play, at=time))
