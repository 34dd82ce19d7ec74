"""Handles on the selected target: arrows along the base's axes, and rings about the tool's.

Whoever grabs a handle owns the target until releasing it; drags from other pages are reverted at once.
Callbacks only send commands; while a handle is dragged its own pose is left alone, everything else follows
the session.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import viser

from workbench.base import se3
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget, plain
from workbench.session.commands.region import ShowCubes
from workbench.session.cube_fields import are_shown, shown_layer
from workbench.session.state import CubeView, Focus, Session
from workbench.session.worker import Worker
from workbench.views.drawables.sink import is_same
from workbench.views.page.viser_internals import set_pose

ARROWS, RINGS = "arrows", "rings"


class Gizmo:
    """Both handles of the selected target."""

    def __init__(self, server: viser.ViserServer, worker: Worker, session: Session):
        self._server = server
        self._worker = worker
        self._session = session
        self._dragged: tuple[str, int] | None = None
        self._turned = b""
        add, size = server.scene.add_transform_controls, 0.17 * session.robot.reach
        both: dict[str, Any] = {"disable_sliders": True, "line_width": 4.0, "depth_test": False}
        self.handles = {
            ARROWS: add("/handles/arrows", scale=size, disable_rotations=True, **both),
            RINGS: add("/handles/rings", scale=0.72 * size, disable_axes=True, **both),
        }
        for kind, handle in self.handles.items():
            self._listen(kind, handle)
        self.show(session)

    def show(self, session: Session) -> None:
        """Follow the selected target."""
        self._session, is_locked = session, session.plate.targets[session.selected].locked
        for kind, handle in self.handles.items():
            handle.visible = session.playback.focus is Focus.TARGET and not is_locked
            if self._dragged is None or self._dragged[0] != kind:
                self._put(kind)

    def _put(self, kind: str, *, is_elsewhere: bool = False) -> None:
        """Put a handle at the target; also where it `is_elsewhere` on a page and the server has it there."""
        target, handle = self._session.plate.targets[self._session.selected], self.handles[kind]
        if is_elsewhere or not np.array_equal(handle.position, target.xyz):
            set_pose(handle, target.xyz)
        if kind == RINGS and (is_elsewhere or target.rpy.tobytes() != self._turned):
            set_pose(handle, wxyz=se3.matrix_to_quaternion(target.pose[:3, :3]))
            self._turned = target.rpy.tobytes()

    def _listen(self, kind: str, handle: viser.TransformControlsHandle) -> None:
        @handle.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            client = -1 if event.client_id is None else event.client_id
            is_new, held = event.phase == "start", self._dragged
            if is_new and held is not None and held[1] not in self._server.get_clients():
                self._release(held[1])  # a program that showed no page: viser does not tell when it leaves
            if is_new and self._dragged is None:
                self._dragged = (kind, client)
                self._worker.submit(GrabTarget(self._session.selected, client + 1))
            if self._dragged != (kind, client):  # the page of one who does not own the target
                self._put(kind, is_elsewhere=True)
            elif event.phase == "end":
                self._release(client)
            elif event.phase == "update":
                if kind == RINGS:
                    self._turned = b""
                self._move(kind, event.target, client)

    def _move(self, kind: str, handle: viser.TransformControlsHandle, client: int) -> None:
        session = self._session
        if session.drag is not None and session.drag.client != client + 1:
            return  # as the demo's: it was refused
        target = session.plate.targets[session.selected]
        xyz, rpy = target.xyz, target.rpy
        if kind == ARROWS:
            xyz = np.array(handle.position)
        elif np.isfinite(handle.wxyz).all() and np.linalg.norm(handle.wxyz) > 0.1:
            rpy = se3.matrix_to_rpy(se3.quaternion_to_matrix(np.array(handle.wxyz)))
        self._worker.submit(MoveTarget(session.selected, plain(xyz), plain(rpy), client + 1))

    def _release(self, client: int) -> None:
        self._dragged = None
        self._worker.submit(DropTarget(client + 1))

    def left(self, client: viser.ClientHandle) -> None:
        """Release the target of a page that has disconnected."""
        if self._dragged is not None and self._dragged[1] == client.client_id:
            self._release(client.client_id)


class Slice:
    """The face of the cuboid that is cut is dragged along any axis."""

    def __init__(self, server: viser.ViserServer, worker: Worker, session: Session):
        self._worker, self._is_dragged = worker, False
        self._begun, self._shown = np.zeros(3), tuple[Any, ...]()
        self._handle = server.scene.add_transform_controls(
            "/handles/slice",
            scale=0.07 * session.robot.reach,
            disable_rotations=True,
            disable_sliders=True,
            line_width=3.0,
            depth_test=False,
            visible=False,
        )
        self._handle.on_update(self._moved)
        self.show(session)

    def show(self, session: Session) -> None:
        """Follow the region."""
        now = session.plate.region, session.region.view, are_shown(session) and session.drag is None
        if self._is_dragged or (self._shown and all(map(is_same, now, self._shown))):
            return
        self._shown = now
        self._handle.visible = now[2] and now[1].cut is not None
        set_pose(self._handle, _face(session))

    async def _moved(self, event: viser.TransformControlsEvent) -> None:
        session, place = self._worker.session, np.array(event.target.position)
        if event.phase == "end":
            self._is_dragged, self._shown = False, ()
            self.show(session)
        elif np.isfinite(place).all():
            if event.phase == "start":
                self._is_dragged, self._begun = True, place
            self._worker.submit(ShowCubes(_cut_at(session, place, place - self._begun)))


def _face(session: Session) -> np.ndarray:
    """Where the face that is cut has its handle: above the region's farthest edge."""
    region, cut = session.plate.region, session.region.view.cut
    place = np.array([*(0.5 * (region.min + region.max))[:2], region.max[2]])
    if cut is not None:
        place[cut] = region.min[cut] + region.size[cut] / region.shape[cut] * (shown_layer(session) + 0.5)
    return place


def _cut_at(session: Session, place: np.ndarray, way: np.ndarray) -> CubeView:
    """The face through a place, across the axis along which it has moved there, if it has."""
    region, view = session.plate.region, session.region.view
    axis = int(np.argmax(np.abs(way))) if way.any() else view.cut or 0
    layer = int(np.clip((place - region.min)[axis] * region.shape[axis] // region.size[axis], 0, None))
    return replace(view, is_chosen=True, cut=axis, layer=min(layer, region.shape[axis] - 1))
