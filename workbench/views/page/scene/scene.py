"""The whole scene of one arm on one plate, rebuilt for another arm or plate."""

import threading

import numpy as np
import viser

from workbench.session.commands.compare import ShowRow
from workbench.session.commands.drag import SelectTarget
from workbench.session.state import Focus, Session
from workbench.session.worker import Worker
from workbench.views.drawables.scene_contents import items
from workbench.views.drawables.viewpoint import first_view, occasion
from workbench.views.page.camera import aim_all
from workbench.views.page.scene.gizmo import Gizmo, Slice
from workbench.views.page.scene.ground import add_ground
from workbench.views.page.scene.viser_sink import PageSink
from workbench.views.page.style import name_pages


class Scene:
    """Everything in the scene; gestures only send commands."""

    def __init__(self, server: viser.ViserServer, worker: Worker, session: Session):
        self._server, self._worker = server, worker
        self._lock = threading.Lock()
        self._session = session
        self._build(session)
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
            now, then = occasion(session), occasion(before)
            if now[:2] != then[:2]:
                self._server.scene.reset()
                self._build(session)
            if now != then:
                self._look(session)
            self._sink.is_behind = False
            self._sink.draw(items(session, on_page=True))
            self._slice.show(session)
            self.gizmo.show(session)

    def _build(self, session: Session) -> None:
        add_ground(self._server, session.robot)
        self._sink = PageSink(self._server)
        name_pages(self._server, session.robot.name)
        self._slice = Slice(self._server, self._worker, session)
        self.gizmo = Gizmo(self._server, self._worker, session)

    def _look(self, session: Session) -> None:
        """Every page, and those that are opened later, look at what there is now."""
        aim_all(self._server, *first_view(session))

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        """A click on a target or a measured point."""
        with self._lock:
            is_of_rows = self._session.playback.focus is Focus.ROW  # a given plate has targets there, too
            ray = np.array(event.ray_origin), np.array(event.ray_direction)
            found = self._sink.picked(ray, points_first=is_of_rows)
        if found is None:
            return
        path, number = found
        if path.startswith("plate/targets/"):
            self._worker.submit(SelectTarget(number))
        else:
            self._worker.submit(ShowRow(number))
