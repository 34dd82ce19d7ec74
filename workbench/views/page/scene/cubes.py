"""The cubes of the region, coloured by the chosen field: one batched mesh, however many there are.

Only their outer faces are drawn, those that no other shown cube covers, and none that looks away: one sees
arm and targets between them, and a computer without a graphics card keeps pace. A cut shows those inside.
"""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import viser
from jaxtyping import Bool, Float, Int

from workbench.base import se3
from workbench.plate.region import Region
from workbench.session.commands.region import ShowCubes
from workbench.session.cubes import (
    LARGER_IS_BETTER,
    CubeValues,
    seen,
    values,
)
from workbench.session.state import Field, Session
from workbench.session.worker import Worker
from workbench.views.appearance.colours import NO_VALUE, UNBOUNDED, scale_colours
from workbench.views.page.scene.nodes import linear
from workbench.views.page.scene.part import AbstractPart

FILL = 0.6
"""Edge of a drawn cube, as a share of the room that it has: one sees the arm between them."""
PICKED = 0.95
"""The same for the faces of the cube that was clicked."""
RECOLOURED = 0.25
"""Least time between two colourings during a drag [s]: the numbers in the panel go first."""
SQUARE = 0.5 * np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])
NORMALS = np.concatenate([-np.eye(3), np.eye(3)])
"""Outward directions of a cube's six faces."""
ACROSS = np.roll(np.abs(NORMALS), 1, axis=1)
"""The axis along a face's first edge."""
TURNS = np.stack([ACROSS, np.cross(NORMALS, ACROSS), NORMALS], axis=-1)
"""Rotation that takes the square to each face."""


class CubesPart(AbstractPart):
    """Made anew for other cubes; recoloured where the numbers change. A click shows a cube's numbers."""

    def __init__(self, server: viser.ViserServer, worker: Worker, session: Session):
        self._server, self._worker = server, worker
        self._shell: _Shell | None = None
        self._region: Region | None = None
        self._drawn: tuple[object, ...] = ()
        self._when = 0.0
        self._made = 0
        self.show(session)

    def show(self, session: Session) -> None:
        view, region = session.cube_view, session.plate.region
        if view.field is Field.NONE:
            self._remove()
            self._drawn = ()
            return
        basis = (view, region, session.cubes, session.comparison, self._score(session))
        if len(basis) == len(self._drawn) and all(a is b for a, b in zip(basis, self._drawn, strict=True)):
            return
        if session.drag is not None and time.monotonic() - self._when < RECOLOURED:
            return  # the last step of a drag is drawn in any case, when the target is let go
        self._drawn, self._when = basis, time.monotonic()
        numbers = values(session)
        faces = None if numbers is None else outer_faces(region, seen(session, view, numbers))
        if numbers is None or faces is None or not len(faces):
            self._remove()
            return
        shell = self._placed(region, faces)
        shell.paint(linear(cube_colours(view.field, numbers)))
        shell.mark(view.picked)

    def _score(self, session: Session) -> object:
        return session.score if session.cube_view.field is Field.PREDICTED else None

    def _placed(self, region: Region, faces: Int[np.ndarray, "faces 2"]) -> "_Shell":
        """These faces in the scene."""
        now = self._shell
        if now is not None and region is self._region and np.array_equal(now.faces, faces):
            return now
        if now is not None:
            now.remove()
        self._made += 1  # under the same name, a page would go on with the old instances' numbers
        name = f"/cubes/{self._made}"
        self._region, self._shell = region, _Shell(self._server, name, region, faces, self._pick)
        return self._shell

    def _pick(self, cube: int) -> None:
        self._worker.submit(ShowCubes(replace(self._worker.session.cube_view, picked=cube)))

    def _remove(self) -> None:
        if self._shell is not None:
            self._shell.remove()
            self._shell = None


class _Shell:
    """Some faces of a region's cubes, as one batched mesh.

    Args:
        server: Where.
        name: Of its node.
        region: Whose cubes.
        faces: Cube and side (of `NORMALS`) of each.
        pick: Told which cube was clicked.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        name: str,
        region: Region,
        faces: Int[np.ndarray, "faces 2"],
        pick: Callable[[int], None],
    ):
        self.faces = faces
        self._cubes, side = faces.T
        room = region.size / region.shape
        self._edges = np.abs(np.swapaxes(TURNS, 1, 2) @ room)[side].astype(np.float32)
        self._picked: int | None = None
        self._mesh = server.scene.add_batched_meshes_simple(
            name,
            SQUARE,
            HALVES,
            batched_wxyzs=se3.matrix_to_quaternion(TURNS)[side],
            batched_positions=region.centres[self._cubes] + 0.5 * FILL * room * NORMALS[side],
            batched_scales=self._sizes(None),
            batched_colors=np.zeros((len(faces), 3), np.uint8),
            flat_shading=True,
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )

        @self._mesh.on_click
        async def _(event: viser.SceneNodePointerEvent) -> None:
            if event.instance_index is not None:
                pick(int(faces[event.instance_index, 0]))

    def paint(self, colours: np.ndarray) -> None:
        """Give its cubes their colours of all."""
        self._mesh.batched_colors = colours[self._cubes]

    def mark(self, picked: int | None) -> None:
        """Enlarge this cube alone."""
        if picked != self._picked:
            self._picked = picked
            self._mesh.batched_scales = self._sizes(picked)

    def remove(self) -> None:
        """Take it out of the scene."""
        self._mesh.remove()

    def _sizes(self, picked: int | None) -> Float[np.ndarray, "faces 3"]:
        share = np.where(self._cubes == (-1 if picked is None else picked), PICKED, FILL)
        return share[:, None].astype(np.float32) * self._edges


def cube_colours(field: Field, numbers: CubeValues) -> np.ndarray:
    """Colour of every cube: from bad to good; grey where there is no number, dark red where unbounded."""
    shares = np.nan_to_num(numbers.shares)
    colours = scale_colours(shares if field in LARGER_IS_BETTER else 1.0 - shares)
    colours[np.isnan(numbers.numbers)] = NO_VALUE
    colours[np.isinf(numbers.numbers)] = UNBOUNDED
    return colours


def outer_faces(region: Region, shown: Bool[np.ndarray, " cubes"]) -> Int[np.ndarray, "faces 2"]:
    """Cube and side of every face of the shown cubes that no other shown cube covers."""
    grid = np.pad(shown.reshape(region.shape), 1)
    found = []
    for side, normal in enumerate(NORMALS.astype(int)):
        covered = np.roll(grid, -normal, axis=(0, 1, 2))
        cubes = np.flatnonzero((grid & ~covered)[1:-1, 1:-1, 1:-1])
        found.append(np.stack([cubes, np.full(len(cubes), side)], -1))
    return np.concatenate(found)
