"""Which arm, from the list or from a file, and what is known of it."""

import numpy as np
import viser

from workbench.arm.joint_units import sliding
from workbench.arm.kinematics.envelope import outstretched
from workbench.arm.robot import Robot
from workbench.base.assets import built_in_robots
from workbench.session.commands.arm import LARGEST_MODEL, ChooseRobot, LoadModel
from workbench.session.state import Session
from workbench.views.page.html import block, bullets, heading, pairs, text
from workbench.views.page.panels.panel import AbstractPanel, ask

MODELS = ".toml,.urdf,.xml"


class ArmPanel(AbstractPanel):
    """Choosing starts over with another arm."""

    depends = ("robot", "is_idle")

    def build(self, gui: viser.GuiApi) -> None:
        self._choice = gui.add_dropdown(
            "Robot", list(built_in_robots()), initial_value="aria", hint="The built-in arms."
        )
        self._change = gui.add_button(
            "Change to this robot",
            icon=viser.Icon.ROBOT,
            color="gray",
            hint="Start over with this arm, on its plate or on yours if it reaches half of it.",
        )
        self._change.on_click(self._choose)
        self.upload(
            "Open a robot or plate",
            LoadModel,
            "A robot as TOML or URDF, or a plate as TOML; measurements go to the Measure tab.",
            endings=MODELS,
            most=LARGEST_MODEL,
        )
        self._facts = gui.add_html("")

    def _choose(self, event: viser.GuiEvent) -> None:
        """Change the robot; ask first where that puts measurements away."""
        name, loaded = self._choice.value, self._worker.session.loaded
        if loaded is None:
            self._worker.submit(ChooseRobot(name))
            return
        fit = "" if self._worker.session.identification is None else " and what was found from them"
        question = f"The measurements ({loaded.name}){fit} are put away; Undo brings them back."
        ask(event, question, f"Change to {name}", lambda: self._worker.submit(ChooseRobot(name)))

    def show(self, session: Session) -> None:
        self._change.disabled = session.job is not None
        self._facts.content = block(facts(session.robot), testid="arm", style="margin:6px 0")


def facts(robot: Robot) -> str:
    """What is known of an arm, in HTML."""
    slides = int(sliding(robot).sum())
    masses = "known" if robot.has_masses else "unknown: effects that depend on loads can't be found"
    limited = int(np.isfinite(robot.limits).all(1).sum())
    items = [
        ("Name", robot.name),
        ("Joints", f"{robot.dof}" + (f", {slides} of them sliding" if slides else "")),
        ("Limits", f"of {limited} joints"),
        ("Reach", f"about {1e3 * outstretched(robot):.0f} mm"),
        ("Convention", robot.convention),
        ("Free parameters", f"{len(robot.default_free)}"),
        ("Masses", masses),
    ]
    notes = bullets(map(text, robot.notes))
    return pairs(items) + (heading("Notes") + notes if notes else "")
