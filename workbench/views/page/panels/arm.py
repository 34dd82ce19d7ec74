"""Which arm, from the list or a file, and what is known of it."""

import viser

from workbench.arm.built_in_arms import load_robot
from workbench.arm.robot import Robot
from workbench.base.assets import built_in_robots
from workbench.report.blocks import ResultTable
from workbench.report.result_display import as_html
from workbench.session.commands.arm import LARGEST_ARCHIVE, ChooseRobot, LoadModel
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import block, bullets, heading, text
from workbench.views.page.panels.panel import AbstractPanel

MODELS = ".toml,.urdf,.xml,.zip"
CHOSEN = "choose …"
"""In a list of robots while the session's is of a file."""


class ArmPanel(AbstractPanel):
    """Choosing starts over with another arm."""

    tab, order = Tab.ROBOT, 10
    depends = ("robot", "is_idle")

    def build(self, gui: viser.GuiApi) -> None:
        arms = (CHOSEN, *built_in_robots())
        hint = "Start again with this arm, on its own plate, or on yours if it reaches half of the targets."
        self._arm = self.dropdown("Robot", arms, hint, self._open, disabled=lambda s: not s.is_idle)
        self.form(lambda name: None if name == CHOSEN else ChooseRobot(name), self._arm)
        self.upload(
            "Open a robot or plate",
            LoadModel,
            "A robot as TOML or URDF (with its meshes: a ZIP file of both), or a plate as TOML; measurements "
            "go to the Measure tab.",
            endings=MODELS,
            maximum=LARGEST_ARCHIVE,
        )
        self.html(lambda s: block(facts(s.robot), testid="arm", style="margin:6px 0"))

    def _open(self, session: Session) -> str:
        """The open arm, unless it is of a file; while another one comes, that one."""
        arms, own = built_in_robots(), session.robot.name
        open_ = (n for n in (self._arm.typed, own.lower()) if n in arms and load_robot(n).name == own)
        return next(open_, CHOSEN) if session.is_idle else self._arm.typed


def facts(robot: Robot) -> str:
    """What is known of an arm, in HTML."""
    items = [
        ("Name", robot.name),
        ("Joints", f"{robot.dof}"),
        ("Masses", "known" if robot.has_masses else "unknown: of loads, only sagging joints are found"),
    ]
    notes = bullets(map(text, robot.notes))
    return as_html([ResultTable("", (), items, words=2)]) + (heading("Notes") + notes if notes else "")
