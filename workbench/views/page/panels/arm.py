"""Which arm, from the list or a file, and what is known of it; one's own, checked against typed poses."""

import numpy as np
import viser

from workbench.arm.built_in_arms import load_robot
from workbench.arm.joint_units import sliding
from workbench.arm.kinematics.envelope import maximum_reach
from workbench.arm.robot import Robot
from workbench.base.assets import built_in_robots
from workbench.session.command import AbstractCommand
from workbench.session.commands.arm import LARGEST_MODEL, ChooseRobot, LoadModel
from workbench.session.commands.messages import Tell
from workbench.session.export import robot_toml
from workbench.session.state import Session, Tab
from workbench.views.page.html import MUTED, block, bullets, folded, heading, pairs, text
from workbench.views.page.panels.panel import AbstractPanel, ask, set_value

MODELS = ".toml,.urdf,.xml"
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
        self._change = self.press("Change to this robot", self._choose, viser.Icon.ROBOT, hint)
        self.upload(
            "Open a robot or plate",
            LoadModel,
            "A robot as TOML or URDF, or a plate as TOML; measurements go to the Measure tab.",
            endings=MODELS,
            maximum=LARGEST_MODEL,
            question=lambda content: "" if b"[[target]]" in content else self._lost(),
        )
        self._facts = gui.add_html("")

    def _choose(self, event: viser.GuiEvent) -> None:
        """Change the robot; ask first where that puts measurements away."""
        if (name := self._choice.value) == CHOSEN:
            self._worker.submit(Tell("choose a robot from the list first, or open your own"))
            return
        if not (question := self._lost()):
            self._worker.submit(ChooseRobot(name))
            return
        ask(event, question, f"Change to {name}", lambda: self._worker.submit(ChooseRobot(name)))

    def _lost(self) -> str:
        """What another robot puts away; empty if nothing."""
        loaded = self._worker.session.measurements.loaded
        if loaded is None:
            return ""
        fit = "" if self._worker.session.results.identification is None else " and the results based on them"
        return f"The measurements ({loaded.name}){fit} will be removed; Undo restores them."

    def show(self, session: Session) -> None:
        self._change.disabled = session.page.job is not None
        shown = self._choice.value
        if shown != CHOSEN and session.is_idle and load_robot(shown).name != session.robot.name:
            set_value(self._choice, CHOSEN)  # it is of a file, or was chosen elsewhere
        self._facts.content = block(facts(session.robot), testid="arm", style="margin:6px 0")


def facts(robot: Robot) -> str:
    """What is known of an arm, in HTML."""
    slides = int(sliding(robot).sum())
    masses = "known" if robot.has_masses else "unknown: effects that depend on loads can't be found"
    limited = int(np.isfinite(robot.limits).all(1).sum())
    items = [
        ("Name", robot.name),
        ("Joints", f"{robot.dof}" + (f", {slides} of them sliding" if slides else "")),
        ("Reach", f"about {1e3 * maximum_reach(robot):.0f} mm"),
        ("Masses", masses),
    ]
    details = [
        ("Limits", f"of {limited} joints"),
        ("Convention", robot.convention),
        ("Free parameters", f"{len(robot.default_free)}"),
    ]
    notes = bullets(map(text, robot.notes))
    return (
        pairs(items)
        + (heading("Notes") + notes if notes else "")
        + folded("Details of the arm", pairs(details))
    )


KINDS = ".csv,.urdf,.xml,.xacro,.toml"
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
            self._source = gui.add_dropdown(
                "It is", (A_FILE, *built_in_robots()), hint="A file below, or a built-in arm to check."
            )
            self._upload = self.upload(
                "DH table, URDF, xacro",
                self._keep,
                "A table with columns theta, d, a, alpha (.csv), or a description of the robot.",
                endings=KINDS,
                maximum=LARGEST_MODEL,
            )
            self._poses = gui.add_text("Poses", "", multiline=True, hint=f"Such as {EXAMPLE}")
            self.button(
                "Check against these poses",
                self._check,
                viser.Icon.CHECKS,
                "Try every interpretation of the table and the numbers; start over with the arm that fits.",
                main=True,
            )
            self.download("This robot (TOML)", robot_toml, "The robot as it is now, before any calibration.")

    def show(self, session: Session) -> None:
        """Nothing here depends on the session."""

    def _keep(self, name: str, content: bytes) -> None:
        self._file, self._upload.label = (name, content), name[-40:]
        set_value(self._source, A_FILE)

    def _check(self) -> AbstractCommand:
        poses = tuple(line.strip() for line in self._poses.value.splitlines() if line.strip())
        if not poses:
            return Tell(f"enter three poses from the pendant, one per line, such as {EXAMPLE}")
        if self._source.value != A_FILE:
            return ChooseRobot(self._source.value, poses=poses)
        if self._file is None:
            return Tell("choose a file with the robot's table or description, or a known arm")
        return LoadModel(*self._file, poses=poses)
