"""What every drawable becomes on the page."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import viser

from workbench.base.types import Vector3

Ray = tuple[Vector3, Vector3]
"""Where the camera is, and the direction from there through the pointer."""


@dataclass(frozen=True, eq=False)
class Node:
    """A node, with all that is below it.

    `change` takes an old and a new drawable to what is sent of the difference; False: it must be made anew.
    """

    root: viser.SceneNodeHandle
    change: Callable[[Any, Any], bool] = lambda old, new: False
