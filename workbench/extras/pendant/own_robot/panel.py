"""One's own robot on the page, checked against typed poses."""

import viser

from workbench.base.assets import built_in_robots
from workbench.session.command import AbstractCommand
from workbench.session.commands.arm import LARGEST_MODEL, ChooseRobot, LoadModel
from workbench.session.commands.messages import Tell
from workbench.session.export import robot_toml
from workbench.session.page_state import Tab
from workbench.views.page.html import MUTED, block, text
from workbench.views.page.panels.panel import AbstractPanel, set_value

KINDS = ".csv,.urdf,.xml,.toml"
A_FILE = "a file"
HOW = (
    "At least three poses as shown on the pendant, flange in the robot's base, one per line: joint positions "
    "= x, y, z and three angles. Units, signs, offsets and the convention are determined automatically."
)
EXAMPLE = "0, -90, 90, 0, 90, 0 = 392.3, 109.2, 500, 180, 0, 90"


class OwnRobotPanel(AbstractPanel):
    """A closed folder: what it is, three poses, a check, the robot's file."""

    tab, order = Tab.ROBOT, 20
    keeps_typed = True
    _file: tuple[str, bytes] | None = None

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Your own robot", expand_by_default=False):
            gui.add_html(block(text(HOW), style=f"color:{MUTED}"))
            arms, hint = (A_FILE, *built_in_robots()), "A file below, or a built-in arm to check."
            self._source = self.dropdown("It is", arms, hint)
            self._upload = self.upload(
                "DH table or URDF",
                self._keep,
                "A table with columns theta, d, a, alpha (.csv), or a description of the robot.",
                endings=KINDS,
                maximum=LARGEST_MODEL,
            )
            self._poses = self.line("Poses", f"Such as {EXAMPLE}", multiline=True)
            self.button(
                "Check against these poses",
                self._check,
                viser.Icon.CHECKS,
                "Try every interpretation of the table and the numbers; start over with the arm that fits.",
                main=True,
            )
            self.download("This robot (TOML)", robot_toml, "The robot as it is now, before any calibration.")

    def _keep(self, name: str, content: bytes) -> None:
        self._file, self._upload.label = (name, content), name[-40:]
        set_value(self._source.control, A_FILE)

    def _check(self) -> AbstractCommand:
        poses = tuple(line.strip() for line in self._poses.typed.splitlines() if line.strip())
        if not poses:
            return Tell(f"enter three poses from the pendant, one per line, such as {EXAMPLE}")
        if self._source.typed != A_FILE:
            return ChooseRobot(self._source.typed, poses=poses)
        if self._file is None:
            return Tell("choose a file with the robot's table or description, or a known arm")
        return LoadModel(*self._file, poses=poses)
