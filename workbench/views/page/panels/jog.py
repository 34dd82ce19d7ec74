"""Jogging the arm: a slider for each joint, and a tool pose to move to."""

from functools import partial

import numpy as np
import viser

from workbench.arm.joint_units import joint_titles, shown_joints, shown_units
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import Matrix4
from workbench.session.commands.arm import Jog, JogTo, drawn_joints
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.panels.form import ANGLE, LENGTH
from workbench.views.page.panels.panel import AFTERWARDS, AbstractPanel, set_value

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
