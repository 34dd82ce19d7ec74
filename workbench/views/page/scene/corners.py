"""Two handles on the corners of the region."""

import numpy as np
import viser

from workbench.plate.region import Region
from workbench.session.commands.region import SetRegion, corner
from workbench.session.state import Session
from workbench.session.worker import Worker
from workbench.views.page.scene.node import put

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
            for name in ("least", "greatest")
        ]
        for which, handle in enumerate(self._handles):
            self._listen(which, handle)
        self.show(session)

    def show(self, session: Session) -> None:
        """Follow the region."""
        region = session.plate.region
        for which, handle in enumerate(self._handles):
            handle.visible = session.cube_view.corners
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
