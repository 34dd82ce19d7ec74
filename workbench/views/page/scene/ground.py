"""What an arm stands on: light, grid and axes of its size."""

import numpy as np
import viser

from workbench.arm.kinematics.skeleton import height_above_floor
from workbench.arm.robot import Robot
from workbench.views.appearance.colours import GRID, GRID_DARK, GRID_SECTION, GRID_SECTION_DARK


class Ground:
    """Set up for arms of this size; only light and dark change it."""

    def __init__(self, server: viser.ViserServer, robot: Robot):
        self._server = server
        self._reach = reach = robot.reach
        self._height = height_above_floor(robot)
        self._is_dark: bool | None = None
        server.scene.set_up_direction("+z")
        _light(server)
        server.scene.add_frame(
            "/base_axes", axes_length=0.17 * reach, axes_radius=0.0035 * reach, origin_radius=0.0
        )
        server.initial_camera.fov = np.deg2rad(42.0)

    def show(self, is_dark: bool) -> None:
        """Draw the grid, light or dark; the sky is the page's own (`style.py`)."""
        if is_dark is self._is_dark:
            return
        self._is_dark = is_dark
        cell = 0.1 if self._reach < 3.0 else 0.5
        self._server.scene.add_grid(
            "/ground",
            width=4.0 * self._reach,
            height=4.0 * self._reach,
            cell_size=cell,
            section_size=5.0 * cell,
            cell_color=GRID_DARK if is_dark else GRID,
            section_color=GRID_SECTION_DARK if is_dark else GRID_SECTION,
            fade_distance=5.0 * self._reach,
            fade_from="origin",
            shadow_opacity=0.0,
            position=(0.0, 0.0, -0.001 - self._height),
        )


def _light(server: viser.ViserServer) -> None:
    scene = server.scene
    scene.add_light_hemisphere(
        "/light/sky", sky_color=(255, 255, 255), ground_color=(95, 105, 140), intensity=2.1
    )
    scene.add_light_directional(
        "/light/key", color=(255, 250, 240), intensity=3.2, position=(3.5, 1.0, 6.0), cast_shadow=False
    )
    scene.add_light_directional(
        "/light/fill", color=(225, 235, 255), intensity=1.4, position=(1.0, -4.0, 1.0), cast_shadow=False
    )
