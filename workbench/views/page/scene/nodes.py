"""Small helpers for viser nodes: poses in its conventions, solids without shadows."""

import numpy as np
import viser
from jaxtyping import Float, UInt8

from workbench.base import se3
from workbench.views.appearance.shapes import Solid

GAMMA = 2.2


def put(node: viser.SceneNodeHandle, pose: Float[np.ndarray, "4 4"]) -> None:
    """Give a node a pose (viser does not send one that it already has)."""
    node.position = pose[:3, 3]
    node.wxyz = se3.matrix_to_quaternion(pose[:3, :3])


def unsettle(node: viser.SceneNodeHandle) -> None:
    """Give a new node a pose that no other has, so that the next one is sent whatever it is.

    A page keeps the pose of an older node of the same name, and viser does not send a pose that is the
    default one.
    """
    node.position, node.wxyz = (0.0, 0.0, -1e3), (0.0, 1.0, 0.0, 0.0)


def linear(colours: UInt8[np.ndarray, "n 3"]) -> UInt8[np.ndarray, "n 3"]:
    """Colours of a batched mesh, which the page takes for linear ones."""
    return np.round(255.0 * (colours / 255.0) ** GAMMA).astype(np.uint8)


def add_solid(
    server: viser.ViserServer,
    name: str,
    solid: Solid,
    colour: tuple[int, int, int],
    *,
    flat: bool = False,
    opacity: float | None = None,
) -> viser.MeshHandle:
    """A solid as a mesh."""
    return server.scene.add_mesh_simple(
        name,
        solid.vertices,
        solid.faces,
        color=colour,
        flat_shading=flat,
        opacity=opacity,
        cast_shadow=False,
        receive_shadow=False,
    )
