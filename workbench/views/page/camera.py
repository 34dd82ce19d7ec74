"""Where a page's camera stands to see some places."""

import numpy as np
import viser
from jaxtyping import Float

from workbench.base.types import Vector3

VIEW = np.array([1.0, -0.86, 0.66])
"""Direction from which everything is looked at first."""
FAR = 3.4
"""Distance from which a ball fills the picture, in its radii."""
LEAST = 0.3
"""Least radius of what is looked at [m]."""


def aim(client: viser.ClientHandle, position: Vector3, look_at: Vector3) -> None:
    """Put a page's camera somewhere, looking at a place.

    The place comes second: viser carries it along with the position.
    """
    with client.atomic():
        client.camera.position = position
        client.camera.look_at = look_at


def look_at(
    client: viser.ClientHandle, places: Float[np.ndarray, "places 3"], *, along: Vector3 = VIEW
) -> None:
    """Move a page's camera so that all places are in the picture.

    Args:
        client: The page.
        places: In the frame of the robot's base [m].
        along: Direction from the places to the camera.
    """
    middle = 0.5 * (places.min(0) + places.max(0))
    radius = max(float(np.linalg.norm(places - middle, axis=1).max()), LEAST)
    aim(client, middle + FAR * radius * along / np.linalg.norm(along), middle)


def from_outside(places: Float[np.ndarray, "places 3"]) -> Vector3:
    """A direction towards the arm's base from beyond some places, a little from the side and above."""
    x, y = places[:, :2].mean(0)
    size = float(np.hypot(x, y))
    outward = np.array([x, y]) / size if size > 0.0 else np.array([1.0, 0.0])
    return np.array([*(outward + 0.7 * np.array([outward[1], -outward[0]])), 0.7])
