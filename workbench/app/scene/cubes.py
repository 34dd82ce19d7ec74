"""The cubes of the region, coloured by the chosen field: one batched mesh, however many there are."""

import time
from dataclasses import replace

import numpy as np
import viser
from jaxtyping import Bool, Float

from workbench.app.scene.nodes import linear
from workbench.app.scene.part import AbstractPart
from workbench.appearance.colours import NO_VALUE, UNBOUNDED, scale_colours
from workbench.appearance.shapes import box
from workbench.design.region import Region
from workbench.session.commands import ShowCubes
from workbench.session.cubes import LARGER_IS_BETTER, CubeValues, seen, values
from workbench.session.state import CubeView, Field, Session
from workbench.session.worker import Worker

FILL = 0.42
"""Edge of a drawn cube, as a share of the room that it has: one sees the arm between them."""
PICKED = 0.85
"""The same for the cube that was clicked."""
RECOLOURED = 0.25
"""Least time between two colourings during a drag [s]: the numbers in the panel go first."""
UP = np.array([1.0, 0.0, 0.0, 0.0])


class CubesPart(AbstractPart):
    """Made anew for another region; recoloured where the numbers change. A click shows a cube's numbers."""

    def __init__(self, server: viser.ViserServer, worker: Worker, session: Session):
        self._server, self._worker = server, worker
        self._mesh: viser.BatchedMeshHandle | None = None
        self._region: Region | None = None
        self._drawn: tuple[object, ...] = ()
        self._when = 0.0
        self._sizes = np.zeros((0, 3), np.float32)
        self.show(session)

    def show(self, session: Session) -> None:
        """Draw what has changed."""
        view, region = session.cube_view, session.plate.region
        if view.field is Field.NONE:
            self._remove()
            return
        basis = (view, region, session.cubes, session.comparison, self._score(session))
        if len(basis) == len(self._drawn) and all(a is b for a, b in zip(basis, self._drawn, strict=True)):
            return
        if session.holder is not None and time.monotonic() - self._when < RECOLOURED:
            return  # the last step of a drag is drawn in any case, when the target is let go
        self._drawn, self._when = basis, time.monotonic()
        numbers = values(session)
        if numbers is None:
            self._remove()
            return
        if self._mesh is None or region is not self._region:
            self._make(region)
        assert self._mesh is not None
        self._mesh.batched_colors = linear(cube_colours(view.field, numbers))
        sizes = cube_sizes(region, view, seen(session, view, numbers))
        if not np.array_equal(sizes, self._sizes):
            self._sizes = sizes
            self._mesh.batched_scales = sizes

    def _score(self, session: Session) -> object:
        return session.score if session.cube_view.field is Field.PREDICTED else None

    def _make(self, region: Region) -> None:
        self._remove()
        self._region = region
        count = region.cubes
        solid = box(np.ones(3))
        self._mesh = self._server.scene.add_batched_meshes_simple(
            "/cubes",
            solid.vertices + 0.5 * np.eye(3)[2],
            solid.faces,
            batched_wxyzs=np.tile(UP, (count, 1)),
            batched_positions=region.centres,
            batched_scales=np.zeros((count, 3), np.float32),
            batched_colors=np.zeros((count, 3), np.uint8),
            flat_shading=True,
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )

        @self._mesh.on_click
        async def _(event: viser.SceneNodePointerEvent) -> None:
            view = self._worker.session.cube_view
            self._worker.submit(ShowCubes(replace(view, picked=event.instance_index)))

    def _remove(self) -> None:
        if self._mesh is not None:
            self._mesh.remove()
            self._mesh, self._drawn = None, ()
            self._sizes = self._sizes[:0]


def cube_colours(field: Field, numbers: CubeValues) -> np.ndarray:
    """Colour of every cube: from bad to good; grey where there is no number, dark red where unbounded."""
    shares = np.nan_to_num(numbers.shares)
    colours = scale_colours(shares if field in LARGER_IS_BETTER else 1.0 - shares)
    colours[np.isnan(numbers.numbers)] = NO_VALUE
    colours[np.isinf(numbers.numbers)] = UNBOUNDED
    return colours


def cube_sizes(
    region: Region, view: CubeView, shown: Bool[np.ndarray, " cubes"]
) -> Float[np.ndarray, "cubes 3"]:
    """Edges of every drawn cube [m]; zero where it is hidden."""
    room = (region.size / region.shape).astype(np.float32)
    sizes = np.where(shown[:, None], FILL * room, 0.0).astype(np.float32)
    if view.picked is not None and view.picked < len(sizes) and shown[view.picked]:
        sizes[view.picked] = PICKED * room
    return sizes
