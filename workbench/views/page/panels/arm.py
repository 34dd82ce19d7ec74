"""Which arm, from the list or a file, and what is known of it."""

import viser

from workbench.arm.built_in_arms import load_robot
from workbench.arm.robot import Robot
from workbench.base.assets import built_in_robots
from workbench.report.blocks import ResultTable
from workbench.report.result_display import as_html
from workbench.session.commands.arm import LARGEST_ARCHIVE, ChooseRobot, LoadModel
from workbench.session.commands.messages import Tell
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import block, bullets, heading, text
from workbench.views.page.panels.panel import AbstractPanel, set_value

MODELS = ".toml,.urdf,.xml,.zip"
CHOSEN = "choose …"
"""In a list of robots while the session's is none that was chosen there."""


class ArmPanel(AbstractPanel):
    """Choosing starts over with another arm."""

    tab, order = Tab.ROBOT, 10
    depends = ("robot", "is_idle")

    def build(self, gui: viser.GuiApi) -> None:
        arms, at_first = (CHOSEN, *built_in_robots()), "aria"
        self._choice = gui.add_dropdown("Robot", arms, initial_value=at_first, hint="The built-in arms.")
        hint = "Start again with this arm, on its own plate, or on yours if it reaches half of the targets."
        self.button(
            "Change to this robot",
            self._chosen,
            viser.Icon.ROBOT,
            hint,
            disabled=lambda s: s.page.job is not None,
        )
        self.upload(
            "Open a robot or plate",
            LoadModel,
            "A robot as TOML or URDF (with its meshes: a ZIP file of both), or a plate as TOML; measurements "
            "go to the Measure tab.",
            endings=MODELS,
            maximum=LARGEST_ARCHIVE,
        )
        self.html(lambda s: block(facts(s.robot), testid="arm", style="margin:6px 0"))

    def _chosen(self) -> ChooseRobot | Tell:
        unchosen = Tell("choose a robot from the list first, or open your own")
        return unchosen if self._choice.value == CHOSEN else ChooseRobot(self._choice.value)

    def show(self, session: Session) -> None:
        shown = self._choice.value
        if shown != CHOSEN and session.is_idle and load_robot(shown).name != session.robot.name:
            set_value(self._choice, CHOSEN)  # it is of a file, or was chosen elsewhere


def facts(robot: Robot) -> str:
    """What is known of an arm, in HTML."""
    items = [
        ("Name", robot.name),
        ("Joints", f"{robot.dof}"),
        ("Masses", "known" if robot.has_masses else "unknown: of loads, only sagging joints are found"),
    ]
    notes = bullets(map(text, robot.notes))
    return as_html([ResultTable("", (), items, words=2)]) + (heading("Notes") + notes if notes else "")
