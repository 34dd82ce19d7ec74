"""What an arm stands on: light, grid and axes of its size."""

import numpy as np
import viser

from workbench.arm.kinematics.skeleton import height_above_floor
from workbench.arm.robot import Robot
from workbench.views.appearance.colours import GRID


def add_ground(server: viser.ViserServer, robot: Robot) -> None:
    """What stays as long as the arm; the sky is the page's own (`style.py`)."""
    reach, cell = robot.reach, 0.1 if robot.reach < 3.0 else 0.5
    server.scene.set_up_direction("+z")
    server.scene.add_light_hemisphere(
        "/light/sky", sky_color=(255, 255, 255), ground_color=(95, 105, 140), intensity=2.1
    )
    server.scene.add_light_directional(
        "/light/key", color=(255, 250, 240), intensity=3.2, position=(3.5, 1.0, 6.0), cast_shadow=False
    )
    server.scene.add_light_directional(
        "/light/fill", color=(225, 235, 255), intensity=1.4, position=(1.0, -4.0, 1.0), cast_shadow=False
    )
    server.scene.add_frame(
        "/base_axes", axes_length=0.17 * reach, axes_radius=0.0035 * reach, origin_radius=0.0
    )
    server.initial_camera.fov = np.deg2rad(42.0)
    server.scene.add_grid(
        "/ground",
        width=4.0 * reach,
        height=4.0 * reach,
        cell_size=cell,
        section_size=5.0 * cell,
        cell_color=GRID,
        cell_thickness=0.42,
        section_color=GRID,
        section_thickness=0.6,
        fade_distance=5.0 * reach,
        fade_from="origin",
        shadow_opacity=0.0,
        position=(0.0, 0.0, -0.001 - height_above_floor(robot)),
    )
