"""The ground, the base's axes, the camera and the light: what never changes."""

import numpy as np
import viser

from workbench.appearance.colours import GRID, GRID_SECTION
from workbench.session.state import Session


def add_ground(server: viser.ViserServer, session: Session) -> None:
    """Set the scene up for arms of this size."""
    reach = session.robot.reach
    server.scene.set_up_direction("+z")
    server.scene.configure_default_lights(cast_shadow=False)
    server.scene.set_background_image(np.full((2, 2, 3), (246, 248, 251), np.uint8))
    cell = 0.1 if reach < 3.0 else 0.5
    server.scene.add_grid(
        "/ground",
        width=4.0 * reach,
        height=4.0 * reach,
        cell_size=cell,
        section_size=5.0 * cell,
        cell_color=GRID,
        section_color=GRID_SECTION,
        fade_distance=5.0 * reach,
        fade_from="origin",
        shadow_opacity=0.0,
        position=(0.0, 0.0, -0.001),
    )
    server.scene.add_frame(
        "/base_axes", axes_length=0.17 * reach, axes_radius=0.0035 * reach, origin_radius=0.0
    )
    middle = 0.5 * (session.plate.region.min + session.plate.region.max)
    look_at = np.array([0.62 * middle[0], 0.62 * middle[1], 0.24 * reach])
    server.initial_camera.position = look_at + reach * np.array([1.0, -0.86, 0.66])
    server.initial_camera.look_at = look_at
    server.initial_camera.fov = np.deg2rad(42.0)
