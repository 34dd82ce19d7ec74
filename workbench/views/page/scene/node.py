"""What every drawable becomes on the page."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import viser

from workbench.base import se3
from workbench.base.types import Matrix3, Vector3

Ray = tuple[Vector3, Vector3]
"""Where the camera is, and the direction from there through the pointer."""


@dataclass(frozen=True, eq=False)
class Node:
    """A node, with all that is below it.

    `change` takes an old and a new drawable to what is sent of the difference; False: it must be made anew.
    """

    root: viser.SceneNodeHandle
    change: Callable[[Any, Any], bool] = lambda old, new: False


def put(node: viser.SceneNodeHandle, place: Vector3, rotation: Matrix3 | None = None) -> None:
    """Give a node a pose, of which only what differs is sent."""
    if not np.array_equal(node.position, place):
        node.position = place
    if rotation is not None:
        node.wxyz = se3.matrix_to_quaternion(rotation)


def place_out_of_sight(node: viser.SceneNodeHandle) -> None:
    """Give a new node a pose that no other has, so that the next one is sent whatever it is.

    A page keeps the pose of an older node of the same name, and viser does not send a pose that is the
    default one.
    """
    node.position, node.wxyz = (0.0, 0.0, -1e3), (0.0, 1.0, 0.0, 0.0)
