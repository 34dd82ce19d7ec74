"""Saving the session's data and results."""

import io

import numpy as np
import viser
from PIL import Image

from workbench.session.export import (
    calibrated_toml,
    calibrated_urdf,
    measurements_csv,
    plate_toml,
    report_zip,
)
from workbench.session.state import Session
from workbench.views.appearance.colours import SKY, SKY_DARK
from workbench.views.page.panels.panel import AbstractPanel

PICTURE = (1200, 1920)
"""Height and width of a saved picture."""


class FilesPanel(AbstractPanel):
    """One button per file, disabled if there is nothing to save yet."""

    depends = ("loaded", "identification")

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Save"):
            self.download("Plate (TOML)", plate_toml, "The plate with its targets and its region.")
            self._needs_data = [
                self.download("Measurements (CSV)", measurements_csv, "One row per line, with units.")
            ]
            self._needs_fit = [
                self.download(
                    "Calibrated robot (TOML)",
                    calibrated_toml,
                    "For the command line, and for the next session.",
                ),
                self.download(
                    "Calibrated robot (URDF)",
                    calibrated_urdf,
                    "For other programs: the best geometry without effects.",
                ),
                self.download(
                    "Report (ZIP)", report_zip, "Tables and figures of the identification as an HTML page."
                ),
            ]
            picture = gui.add_button(
                "Picture of the scene (PNG)",
                icon=viser.Icon.CAMERA,
                color="gray",
                hint="The scene as shown, without the panel.",
            )
            picture.on_click(self._picture)

    def show(self, session: Session) -> None:
        for button in self._needs_data:
            button.disabled = session.loaded is None
        for button in self._needs_fit:
            button.disabled = session.identification is None

    def _picture(self, event: viser.GuiEvent) -> None:
        if event.client is None:
            return
        height, width = PICTURE
        sky = np.array(SKY_DARK if self._worker.session.is_dark else SKY)
        pixels = event.client.get_render(height, width, transport_format="png", timeout=30.0)
        share = pixels[..., 3:] / 255.0
        scene = np.round(pixels[..., :3] * share + sky * (1.0 - share)).astype(np.uint8)
        picture = io.BytesIO()
        Image.fromarray(scene).save(picture, format="PNG")
        event.client.send_file_download("workbench.png", picture.getvalue(), save_immediately=True)
