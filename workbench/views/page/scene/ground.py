"""The ground, the base's axes, the light and the first view."""

import numpy as np
import viser

from workbench.arm.kinematics.skeleton import height_above_floor
from workbench.session.state import Focus, Session
from workbench.views.appearance.colours import GRID, GRID_DARK, GRID_SECTION, GRID_SECTION_DARK
from workbench.views.page.camera import view_of_rows


class Ground:
    """Set up for arms of this size; only light and dark change it."""

    def __init__(self, server: viser.ViserServer, session: Session):
        self._server = server
        self._reach = reach = session.robot.reach
        self._height = height_above_floor(session.robot)
        self._is_dark: bool | None = None
        server.scene.set_up_direction("+z")
        _light(server)
        server.scene.add_frame(
            "/base_axes", axes_length=0.17 * reach, axes_radius=0.0035 * reach, origin_radius=0.0
        )
        server.initial_camera.fov = np.deg2rad(42.0)
        self.show(session)

    def show(self, session: Session) -> None:
        """Draw the grid, light or dark; the sky is the page's own (`style.py`)."""
        if session.is_dark is self._is_dark:
            return
        self._is_dark = session.is_dark
        cell = 0.1 if self._reach < 3.0 else 0.5
        self._server.scene.add_grid(
            "/ground",
            width=4.0 * self._reach,
            height=4.0 * self._reach,
            cell_size=cell,
            section_size=5.0 * cell,
            cell_color=GRID_DARK if session.is_dark else GRID,
            section_color=GRID_SECTION_DARK if session.is_dark else GRID_SECTION,
            fade_distance=5.0 * self._reach,
            fade_from="origin",
            shadow_opacity=0.0,
            position=(0.0, 0.0, -0.001 - self._height),
        )


def _light(server: viser.ViserServer) -> None:
    """Three plain lights."""
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


def first_view(session: Session) -> tuple[np.ndarray, np.ndarray]:
    """Where the camera stands and looks at first [m]: at the measured rows, or else at the plate."""
    rows, loaded = session.comparison, session.loaded
    if rows is not None and loaded is not None and (loaded.virtual or session.focus is Focus.ROW):
        return view_of_rows(session.robot, rows)
    reach = session.robot.reach
    middle = 0.5 * (session.plate.region.min + session.plate.region.max)
    height = 0.24 * reach - height_above_floor(session.robot)
    look_at = np.array([0.62 * middle[0], 0.62 * middle[1], height])
    return look_at + reach * np.array([1.0, -0.86, 0.66]), look_at
