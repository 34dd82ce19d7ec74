"""Camera poses that bring given points into view."""

import numpy as np
import viser
from jaxtyping import Float

from workbench.arm.kinematics.skeleton import height_above_floor
from workbench.arm.robot import Robot
from workbench.base.types import Vector3
from workbench.plate.region import Region

VIEW = np.array([1.0, -0.86, 0.66])
"""Direction from which everything is looked at first."""
BALL_FILLS_PICTURE = 3.4
"""Distance from which a ball fills the picture, in its radii."""
WIDE = 1.1
"""Width of the pictures that views are made for, as a share of their height, at least."""
MIN_RADIUS = 0.3
"""Minimum radius of what is looked at [m]."""


def aim(
    client: viser.ClientHandle, position: Vector3, look_at: Vector3, *, aspect: float | None = None
) -> None:
    """Put a page's camera somewhere, looking at a place; farther away in a picture that is higher than wide.

    The place comes second: viser carries it along with the position.
    """
    farther = max(1.0, WIDE / (aspect or client.camera.aspect or WIDE))
    with client.atomic():
        client.camera.position = look_at + farther * (position - look_at)
        client.camera.look_at = look_at


def aim_all(server: viser.ViserServer, position: Vector3, look_at: Vector3) -> None:
    """The same on every page, and on those that are opened later."""
    server.initial_camera.position = position
    server.initial_camera.look_at = look_at
    for client in server.get_clients().values():
        aim(client, position, look_at)


def look_at(
    client: viser.ClientHandle, places: Float[np.ndarray, "places 3"], *, along: Vector3 = VIEW
) -> None:
    """Move a page's camera so that all places are in the picture, seen along this direction towards it."""
    aim(client, *view_of(places, along=along))


def view_of(places: Float[np.ndarray, "places 3"], *, along: Vector3 = VIEW) -> tuple[Vector3, Vector3]:
    """Camera position and point of view that show all given points [m]."""
    middle = 0.5 * (places.min(0) + places.max(0))
    radius = max(float(np.linalg.norm(places - middle, axis=1).max()), MIN_RADIUS)
    return middle + BALL_FILLS_PICTURE * radius * along / np.linalg.norm(along), middle


def view_of_region(robot: Robot, region: Region) -> tuple[Vector3, Vector3]:
    """Camera position and point of view that show an arm and what is in front of it [m]."""
    middle = 0.5 * (region.min + region.max)
    height = 0.24 * robot.reach - height_above_floor(robot)
    look_at = np.array([0.62 * middle[0], 0.62 * middle[1], height])
    return look_at + robot.reach * np.array([1.0, -0.86, 0.66]), look_at


def from_outside(places: Float[np.ndarray, "places 3"]) -> Vector3:
    """A direction towards the arm's base from beyond some places, a little from the side and above."""
    x, y = places[:, :2].mean(0)
    size = float(np.hypot(x, y))
    outward = np.array([x, y]) / size if size > 0.0 else np.array([1.0, 0.0])
    return np.array([*(outward + 0.7 * np.array([outward[1], -outward[0]])), 0.7])
