"""Cameras of pages."""

import viser

from workbench.base.types import Vector3

WIDE = 1.1
"""Width of the pictures that views are made for, as a share of their height, at least."""


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
