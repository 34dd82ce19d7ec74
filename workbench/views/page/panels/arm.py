"""Which arm, from the list or a file, and what is known of it; jogging it: a slider for each joint, and a
tool pose to move to."""

from functools import partial

import numpy as np
import viser

from workbench.arm.built_in_arms import load_robot
from workbench.arm.joint_units import joint_titles, shown_joints, shown_units
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.base.types import Matrix4
from workbench.report.blocks import ResultTable
from workbench.report.result_display import as_html
from workbench.session.commands.arm import LARGEST_ARCHIVE, ChooseRobot, Jog, JogTo, LoadModel, drawn_joints
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import block, bullets, heading, text
from workbench.views.page.panels.form import ANGLE, LENGTH
from workbench.views.page.panels.panel import AFTERWARDS, AbstractPanel, set_value

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


ROUNDED = 1e-6
"""What numbers may be off by conversion of units; a limit of 180° is not shown as 180.1°."""


class JogPanel(AbstractPanel):
    """The sliders follow the arm, whatever moves it; another arm has as many as it has joints."""

    tab, order = Tab.ROBOT, 30
    pause = AFTERWARDS
    depends = ("robot", drawn_joints)

    _robot: Robot | None = None

    def build(self, gui: viser.GuiApi) -> None:
        self._sliders: list[viser.GuiSliderHandle] = []
        self._folder = gui.add_folder("Joints")
        self._fit(self._worker.session.robot)

    def show(self, session: Session) -> None:
        if session.robot is not self._robot:
            self._fit(session.robot)
        shown = shown_joints(session.robot, drawn_joints(session))
        for slider, value in zip(self._sliders, shown.round(1).tolist(), strict=False):
            set_value(slider, min(max(value, slider.min), slider.max))

    def _fit(self, robot: Robot) -> None:
        """A slider for each joint; those that are there stay."""
        self._robot = robot
        with self._folder:
            for i in range(len(self._sliders), robot.dof):
                hint = "Move this joint of both arms."
                joint = self.slider(f"Joint {i + 1}", (-1.0, 1.0, 0.1), hint, value=0.0)
                self.sends(joint, partial(self._jog, i))
                self._sliders.append(joint.control)
        ends = shown_joints(robot, robot.search_limits.T).T
        settings = zip(self._sliders, ends, shown_units(robot), joint_titles(robot), strict=False)
        for slider, (low, high), unit, title in settings:
            slider.label = f"{title} [{unit.strip()}]"
            slider.min = float(np.floor(10 * low + ROUNDED) / 10)
            slider.max = float(np.ceil(10 * high - ROUNDED) / 10)
        for i, slider in enumerate(self._sliders):
            slider.visible = i < robot.dof

    def _jog(self, moved: int) -> Jog:
        """The moved joint from its slider, the others as they stand."""
        session = self._worker.session
        q = drawn_joints(session).copy()
        size = shown_joints(session.robot, np.ones(len(q)))[moved]
        q[moved] = float(np.clip(self._sliders[moved].value / size, *session.robot.search_limits[moved]))
        return Jog(tuple(q.tolist()))


class ToolPanel(AbstractPanel):
    """Where the tool is, and a pose for it to go to."""

    tab, order = Tab.ROBOT, 40
    pause = AFTERWARDS
    keeps_typed = True
    depends = ("robot", drawn_joints)

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Tool"):
            hint = "Position of the tool in the base frame; enter the desired one."
            xyz = self.coordinates("Tool x, y, z", LENGTH, hint, lambda s: _tool(s)[:3, 3])
            hint = "Roll, pitch and yaw of the tool; enter the desired ones."
            turn = self.coordinates("Tool angles", ANGLE, hint, lambda s: se3.matrix_to_rpy(_tool(s)[:3, :3]))
            self.button(
                "Go to this pose",
                lambda: JogTo(xyz.typed, turn.typed),
                viser.Icon.ARROW_RIGHT,
                "Move the tool there, by the inverse-kinematics solution closest to the current posture.",
            )


def _tool(session: Session) -> Matrix4:
    """The tool in the robot's base."""
    tool = tool_poses(session.robot, Motion(drawn_joints(session)[None]))[0]
    return se3.inverse(session.robot.base.pose) @ tool
