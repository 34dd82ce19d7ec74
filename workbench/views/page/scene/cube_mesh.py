"""The cubes of the region as one batched mesh, however many there are.

Only their outer faces are drawn, those that no other shown cube covers, and none that looks away, so that a
computer without a graphics card keeps pace; a cut shows those inside. All are translucent: arm and targets
are seen behind them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import viser
from jaxtyping import Bool, Int

from workbench.base import se3
from workbench.plate.region import Region
from workbench.views.appearance.colours import linear
from workbench.views.drawables.drawable import FILL, Cubes
from workbench.views.drawables.sink import differences

OPACITY = 0.7
SQUARE = 0.5 * np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])
NORMALS = np.concatenate([-np.eye(3), np.eye(3)])
"""Outward directions of a cube's six faces."""
ACROSS = np.roll(np.abs(NORMALS), 1, axis=1)
"""The axis along a face's first edge."""
FACE_ROTATIONS = np.stack([ACROSS, np.cross(NORMALS, ACROSS), NORMALS], axis=-1)
"""Rotation that takes the square to each face."""


@dataclass(frozen=True, eq=False)
class Node:
    """A node, with all that is below it.

    `change` takes an old and a new drawable to what is sent of the difference; False: it must be made anew.
    """

    root: viser.SceneNodeHandle
    change: Callable[[Any, Any], bool] = lambda old, new: False


def add_cubes(server: viser.ViserServer, name: str, cubes: Cubes) -> Node:
    """The outer faces of cubes."""
    region, (numbers, side) = cubes.region, outer_faces(cubes.region, cubes.shown).T
    size = FILL * (region.size / region.shape)
    lengths = np.abs(np.swapaxes(FACE_ROTATIONS, 1, 2) @ size)  # of a face's square, along its axes
    mesh = server.scene.add_batched_meshes_simple(
        name,
        SQUARE,
        HALVES,
        batched_wxyzs=se3.matrix_to_quaternion(FACE_ROTATIONS)[side],
        batched_positions=region.centres[numbers] + 0.5 * size * NORMALS[side],
        batched_scales=lengths[side].astype(np.float32),
        batched_colors=linear(cubes.colours)[numbers],
        flat_shading=True,
        lod="off",
        side="front",
        opacity=OPACITY,
        cast_shadow=False,
        receive_shadow=False,
    )

    def change(old: Cubes, new: Cubes) -> bool:
        changed = differences(old, new)
        if changed & {"region", "shown"}:
            return False
        if "colours" in changed:
            mesh.batched_colors = linear(new.colours)[numbers]
        return True

    return Node(mesh, change)


def outer_faces(region: Region, shown: Bool[np.ndarray, " cubes"]) -> Int[np.ndarray, "faces 2"]:
    """Cube and side of every face of the shown cubes that no other shown cube covers."""
    grid = np.pad(shown.reshape(region.shape), 1)
    found = []
    for side, normal in enumerate(NORMALS.astype(int)):
        covered = np.roll(grid, -normal, axis=(0, 1, 2))
        cubes = np.flatnonzero((grid & ~covered)[1:-1, 1:-1, 1:-1])
        found.append(np.stack([cubes, np.full(len(cubes), side)], -1))
    return np.concatenate(found)
