"""Saving the session's data and results, with the error of each file of the calibrated arm."""

import io

import numpy as np
import viser
from PIL import Image

from workbench.session.export import measurements_csv, plate_toml
from workbench.session.state import Session, Tab
from workbench.views.appearance.colours import SKY, SKY_DARK
from workbench.views.page.html import note
from workbench.views.page.panels.panel import AbstractPanel
from workbench.views.page.panels.saving import ArmFiles

PICTURE = (1200, 1920)
"""Height and width of a saved picture."""
EMPTY_NOTE = "Identify the arm first; then it is saved here."


class FilesPanel(AbstractPanel):
    """The calibrated arm once there is one, and a button per file."""

    tab, order = Tab.EXPORT, 10
    depends = ("loaded", "identification", "fit")

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Calibrated arm"):
            self._nothing = gui.add_html(note(EMPTY_NOTE, "unsaved"))
            self._arm = ArmFiles(self, gui)
        with gui.add_folder("Plate, measurements, picture"):
            self.download("Plate (TOML)", plate_toml, "The plate with its targets and its region.")
            self._rows = self.download(
                "Measurements (CSV)", measurements_csv, "One row per line, with units."
            )
            picture = gui.add_button(
                "Picture of the scene (PNG)",
                icon=viser.Icon.CAMERA,
                color="gray",
                hint="The scene as shown, without the panel.",
            )
        picture.on_click(self._picture)

    def show(self, session: Session) -> None:
        self._rows.disabled = session.loaded is None
        self._nothing.visible = session.identification is None
        self._arm.show(session)

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
