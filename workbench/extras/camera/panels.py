"""Pictures of a board on the page: what takes a folder of them, larger than files of measurements may be."""

import viser

from workbench.extras.camera.session_commands import LARGEST_FOLDER, LoadPictures
from workbench.session.commands.identify import Identify
from workbench.session.page_state import Tab
from workbench.views.page.html import note
from workbench.views.page.panels.panel import AbstractPanel, Door

HOW_TO_TAKE = (
    "Print a board ('workbench board' writes its target.toml too). Take 15 to 30 pictures from different "
    "directions, with the arm at rest. Give a ZIP of the folder with the pictures, target.toml and a table "
    "with one row per picture: image, q1[deg] …"
)
PICTURES = "Choose the robot, then a ZIP of its pictures with target.toml and a table of the joints."


def upload(panel: AbstractPanel, gui: viser.GuiApi) -> None:
    """What takes a ZIP archive of the folder of the pictures: in the panel, and on the start card."""
    panel.upload(
        "Pictures in a folder (ZIP)",
        LoadPictures,
        "Pictures of a board or of tags, or a table of their corners, target.toml, and a table of the joints "
        f"with a column 'image'. Up to {LARGEST_FOLDER // 2**20} MiB.",
        endings=".zip",
        maximum=LARGEST_FOLDER,
    )


class CamerasPanel(AbstractPanel):
    """How to take pictures, and what takes them."""

    tab, order = Tab.MEASURE, 30
    build_door = staticmethod(upload)
    door = Door("Pictures of a board", viser.Icon.CAMERA, Identify, asks=PICTURES, build=build_door)

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Pictures of a board", expand_by_default=True):
            gui.add_html(note(HOW_TO_TAKE, "steps-of-pictures"))
            upload(self, gui)
