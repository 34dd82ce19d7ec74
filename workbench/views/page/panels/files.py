"""Saving what the session holds."""

from collections.abc import Callable
from typing import Any

import viser

from workbench.base.errors import WorkbenchError
from workbench.session.commands.messages import Tell
from workbench.session.export import (
    File,
    calibrated_toml,
    calibrated_urdf,
    fixture_zip,
    measurements_csv,
    plate_toml,
    report_zip,
)
from workbench.session.state import Session
from workbench.session.worker import Worker
from workbench.views.page.panels.panel import AbstractPanel

PICTURE = (1200, 1920)
"""Height and width of a saved picture."""


class FilesPanel(AbstractPanel):
    """One button a file; those that have nothing to save yet are off."""

    def build(self, server: viser.ViserServer) -> None:
        gui = server.gui
        with gui.add_folder("Save"):
            self._button(gui, "Plate (TOML)", plate_toml, "The plate with its targets and its region.")
            self._button(
                gui,
                "Plate to make (ZIP)",
                fixture_zip,
                "Solids as STL and 3MF, the drawing as DXF, lists of holes and blocks, and the sheet for the "
                "workshop. Takes a few seconds.",
            )
            self._needs_data = [
                self._button(gui, "Measurements (CSV)", measurements_csv, "One row per line, with units.")
            ]
            self._needs_fit = [
                self._button(
                    gui,
                    "Calibrated robot (TOML)",
                    calibrated_toml,
                    "For the command line, and for the next session.",
                ),
                self._button(
                    gui,
                    "Calibrated robot (URDF)",
                    calibrated_urdf,
                    "For other programs; effects are left out.",
                ),
                self._button(
                    gui,
                    "Report (ZIP)",
                    report_zip,
                    "Tables and figures of the identification as an HTML page.",
                ),
            ]
            picture = gui.add_button(
                "Picture of the scene (PNG)",
                icon=viser.Icon.CAMERA,
                color="gray",
                hint="The scene as shown, without the panel.",
            )
            picture.on_click(self._picture)

    def parts(self, session: Session) -> tuple[Any, ...]:
        return session.loaded is None, session.identification is None

    def show(self, session: Session) -> None:
        for button in self._needs_data:
            button.disabled = session.loaded is None
        for button in self._needs_fit:
            button.disabled = session.identification is None

    def _button(
        self, gui: viser.GuiApi, label: str, make: Callable[[Session], File], hint: str
    ) -> viser.GuiButtonHandle:
        button = gui.add_button(label, icon=viser.Icon.DOWNLOAD, color="gray", hint=hint)
        button.on_click(lambda event: save(event, self._worker, make))
        return button

    def _picture(self, event: viser.GuiEvent) -> None:
        if event.client is None:
            return
        import imageio.v3 as images  # comes with viser

        height, width = PICTURE
        pixels = event.client.get_render(height, width, timeout=30.0)
        content = images.imwrite("<bytes>", pixels, extension=".png")
        event.client.send_file_download("workbench.png", content, save_immediately=True)


def save(event: viser.GuiEvent, worker: Worker, make: Callable[[Session], File]) -> None:
    """Download a file; what goes wrong is shown on the page instead of lost in viser's thread pool."""
    try:
        name, content = make(worker.session)
        if event.client is not None:
            event.client.send_file_download(name, content, save_immediately=True)
    except WorkbenchError as error:
        worker.submit(Tell(str(error)))
    except Exception as error:
        worker.submit(Tell(f"the file could not be made ({type(error).__name__}: {error})"))
