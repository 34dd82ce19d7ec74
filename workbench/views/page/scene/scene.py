"""The whole scene of one arm on one plate, rebuilt for another arm or plate."""

import threading

import numpy as np
import viser

from workbench.arm.kinematics.skeleton import height_above_floor
from workbench.arm.robot import Robot
from workbench.base.types import Vector3
from workbench.session.commands.compare import ShowRow
from workbench.session.commands.drag import SelectTarget
from workbench.session.state import Focus, Session
from workbench.session.worker import Worker
from workbench.views.appearance.colours import GRID
from workbench.views.drawables.scene_contents import first_view, items, occasion
from workbench.views.page.scene.gizmo import Gizmo, Slice
from workbench.views.page.scene.viser_sink import PageSink
from workbench.views.page.style import name_pages

WIDE = 1.1
"""Width of the pictures that views are made for, as a share of their height, at least."""


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


def add_ground(server: viser.ViserServer, robot: Robot) -> None:
    """What stays as long as the arm; the sky is the page's own (`style.py`)."""
    reach, cell = robot.reach, 0.1 if robot.reach < 3.0 else 0.5
    server.scene.set_up_direction("+z")
    server.scene.add_light_hemisphere(
        "/light/sky", sky_color=(255, 255, 255), ground_color=(95, 105, 140), intensity=2.1
    )
    server.scene.add_light_directional(
        "/light/key", color=(255, 250, 240), intensity=3.2, position=(3.5, 1.0, 6.0), cast_shadow=False
    )
    server.scene.add_light_directional(
        "/light/fill", color=(225, 235, 255), intensity=1.4, position=(1.0, -4.0, 1.0), cast_shadow=False
    )
    server.scene.add_frame(
        "/base_axes", axes_length=0.17 * reach, axes_radius=0.0035 * reach, origin_radius=0.0
    )
    server.initial_camera.fov = np.deg2rad(42.0)
    server.scene.add_grid(
        "/ground",
        width=4.0 * reach,
        height=4.0 * reach,
        cell_size=cell,
        section_size=5.0 * cell,
        cell_color=GRID,
        cell_thickness=0.42,
        section_color=GRID,
        section_thickness=0.6,
        fade_distance=5.0 * reach,
        fade_from="origin",
        shadow_opacity=0.0,
        position=(0.0, 0.0, -0.001 - height_above_floor(robot)),
    )


def aim(
    client: viser.ClientHandle, position: Vector3, look_at: Vector3, *, aspect: float | None = None
) -> None:
    """Put a page's camera somewhere, looking at a place; farther away in a picture that is higher than wide.

    The place comes second: viser carries it along with the position.
    """
    farther = max(1.0, WIDE / (aspect or client.camera.aspect or WIDE))
    with client.atomic():
        client.camera.position = look_at + farther * (position - look_at)
        client.camera.look_at = look_at


def aim_all(server: viser.ViserServer, position: Vector3, look_at: Vector3) -> None:
    """The same on every page, and on those that are opened later."""
    server.initial_camera.position = position
    server.initial_camera.look_at = look_at
    for client in server.get_clients().values():
        aim(client, position, look_at)
