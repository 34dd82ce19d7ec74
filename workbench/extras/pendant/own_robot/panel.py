"""One's own robot on the page, by its table or its file, checked against typed poses."""

from collections.abc import Callable

import viser

from workbench.session.commands.arm import LARGEST_MODEL, LoadModel
from workbench.session.export import robot_toml
from workbench.session.page_state import Tab
from workbench.views.page.html import MUTED, block, text
from workbench.views.page.panels.panel import AbstractPanel

HOW = (
    "Type the table of your robot, one joint a line below the headings. Three poses from the pendant (flange "
    "in the robot's base) tell units, signs, zeros and convention. Without a table they check the open robot."
)
TABLE = "theta, d, a, alpha\n0, 399, 0, -90\n-90, 0, 350, 0"
POSES = "One a line, joint positions = x, y, z and three angles: 0, -90, 90, 0, 90, 0 = 9, 2, 500, 180, 0, 90"
CONVENTIONS = {"as the poses tell": "", "standard DH": "dh", "modified DH (Craig)": "craig"}


def build_table(panel: AbstractPanel, gui: viser.GuiApi) -> Callable[[str, bytes], LoadModel]:
    """Fields for a table and poses, and what opens the robot; returns what opens a file likewise."""
    gui.add_html(block(text(HOW), style=f"color:{MUTED}"))
    table = panel.line("DH table", f"Such as {TABLE}", multiline=True)
    convention = panel.dropdown("Convention", CONVENTIONS, "Of the table.")
    poses = panel.line("Poses", POSES, multiline=True)

    def checked(name: str, content: bytes) -> LoadModel:
        return LoadModel(name, content, tuple(filter(None, map(str.strip, poses.typed.splitlines()))))

    def opened() -> LoadModel:
        if not table.typed.strip():
            return checked(*robot_toml(panel.session))
        said = convention.typed and f"# convention = {convention.typed}\n"
        return checked("own-robot.csv", f"{said}{table.typed}".encode())

    hint = "Try every interpretation of table and poses; start over with the arm that fits."
    panel.button("Open and check", opened, viser.Icon.CHECKS, hint, main=True)
    return checked


class OwnRobotPanel(AbstractPanel):
    """A closed folder: what it is, three poses, a check, the robot's file."""

    tab, order = Tab.ROBOT, 20
    keeps_typed = True
    names_robot = "… or its DH table", build_table

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Your own robot", expand_by_default=False):
            checked = build_table(self, gui)
            label, hint = ("… or its file", "Its table (.csv) or description, which has to give these poses.")
            self.upload(label, checked, hint, endings=".csv,.urdf,.xml,.toml", maximum=LARGEST_MODEL)
            self.download("This robot (TOML)", robot_toml, "The robot as it is now, before any calibration.")
