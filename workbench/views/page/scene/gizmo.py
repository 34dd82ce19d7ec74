"""Handles on the selected target: arrows along the base's axes, and rings about the tool's.

Whoever grabs a handle owns the target until releasing it. Drags from other pages are reverted at once, and
nudged once more at their end, because viser does not send a pose that it already has. Callbacks only send
commands; while a handle is dragged its own pose is left alone, everything else follows the session.
"""

from typing import Any

import numpy as np
import viser

from workbench.base import se3
from workbench.plate.region import Region
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget
from workbench.session.commands.region import SetRegion, corner
from workbench.session.state import Focus, Session
from workbench.session.worker import Worker
from workbench.views.page.scene.node import put

ARROWS, RINGS = "arrows", "rings"
NUDGE = 1e-3


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

    def _put(self, kind: str, *, off: float = 0.0) -> None:
        """Put a handle at the target, or a little off in place [m] and angle [rad]."""
        target = self._session.plate.targets[self._session.selected]
        turned = None
        if kind == RINGS and (off or target.rpy.tobytes() != self._turned):
            turned = target.pose[:3, :3] @ se3.rotvec_to_matrix(np.full(3, off))
            self._turned = b"" if off else target.rpy.tobytes()
        put(self.handles[kind], target.xyz + off, turned)

    def _listen(self, kind: str, handle: viser.TransformControlsHandle) -> None:
        @handle.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            client = -1 if event.client_id is None else event.client_id
            if event.phase == "start":
                self._release_lost()
            if event.phase == "start" and self._dragged is None:
                self._dragged = (kind, client)
                self._worker.submit(GrabTarget(self._session.selected, client + 1))
            if self._dragged != (kind, client):  # the page of one who does not own the target
                if event.phase == "end":
                    self._put(kind, off=NUDGE)
                self._put(kind)
            elif event.phase == "end":
                self._release(client)
            elif event.phase == "update":
                if kind == RINGS:
                    self._turned = b""
                self._move(kind, event.target, client)

    def _move(self, kind: str, handle: viser.TransformControlsHandle, client: int) -> None:
        session = self._session
        target = session.plate.targets[session.selected]
        xyz, rpy = target.xyz, target.rpy
        if kind == ARROWS:
            xyz = np.array(handle.position)
        elif np.isfinite(handle.wxyz).all() and np.linalg.norm(handle.wxyz) > 0.1:
            rpy = se3.matrix_to_rpy(se3.quaternion_to_matrix(np.array(handle.wxyz)))
        (x, y, z), (roll, pitch, yaw) = xyz.tolist(), rpy.tolist()
        self._worker.submit(MoveTarget(session.selected, (x, y, z), (roll, pitch, yaw), client + 1))

    def _release(self, client: int) -> None:
        self._dragged = None
        self._worker.submit(DropTarget(client + 1))

    def _release_lost(self) -> None:
        """Release the target of a program that never showed a page: viser does not tell when it leaves."""
        if self._dragged is not None and self._dragged[1] not in self._server.get_clients():
            self._release(self._dragged[1])

    def left(self, client: viser.ClientHandle) -> None:
        """Release the target of a page that has disconnected."""
        if self._dragged is not None and self._dragged[1] == client.client_id:
            self._release(client.client_id)


THINNEST = 0.02
"""Corners keep this distance along every axis [m]."""


class Corners:
    """Corners are dragged along the axes; the cuboid keeps its sense, whatever the hand does."""

    def __init__(self, server: viser.ViserServer, worker: Worker, session: Session):
        self._worker = worker
        self._dragged: int | None = None
        self._handles = [
            server.scene.add_transform_controls(
                f"/corners/{name}",
                scale=0.12 * session.robot.reach,
                disable_rotations=True,
                disable_sliders=True,
                line_width=3.0,
                depth_test=False,
                visible=False,
            )
            for name in ("minimum", "maximum")
        ]
        for which, handle in enumerate(self._handles):
            self._listen(which, handle)
        self.show(session)

    def show(self, session: Session) -> None:
        """Follow the region."""
        region = session.plate.region
        for which, handle in enumerate(self._handles):
            handle.visible = session.region.view.corners
            if which != self._dragged:
                put(handle, (region.min, region.max)[which])

    def _listen(self, which: int, handle: viser.TransformControlsHandle) -> None:
        @handle.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            if event.phase == "start":
                self._dragged = which
                self._submit(self._worker.session.plate.region, step=True)
            elif event.phase == "update":
                place = np.array(event.target.position)
                if np.isfinite(place).all():
                    self._submit(dragged(self._worker.session.plate.region, which, place), step=False)
            else:
                self._dragged = None
                put(handle, np.array(event.target.position) + 1e-3)
                self.show(self._worker.session)

    def _submit(self, region: Region, *, step: bool) -> None:
        self._worker.submit(SetRegion(corner(region.min), corner(region.max), region.cube, step=step))


def dragged(region: Region, which: int, place: np.ndarray) -> Region:
    """The region with one corner elsewhere, at least as thin as `THINNEST`."""
    if which == 0:
        return Region(min=np.minimum(place, region.max - THINNEST), max=region.max, cube=region.cube)
    return Region(min=region.min, max=np.maximum(place, region.min + THINNEST), cube=region.cube)
