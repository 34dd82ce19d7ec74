"""Moving the arm by hand: a slider for each joint, and a pose to go to."""

from functools import partial

import numpy as np
import viser

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import JointKind, Robot
from workbench.base import se3
from workbench.session.commands.arm import Jog, JogTo, standing
from workbench.session.state import Session, Units
from workbench.session.worker import Worker
from workbench.views.page.panels.coordinates import Coordinates, Quantity
from workbench.views.page.panels.panel import (
    AbstractPanel,
    on_change,
    on_press,
    set_value,
)


class JogPanel(AbstractPanel):
    """The sliders follow the arm, whatever moves it; made anew for another arm."""

    def __init__(self, worker: Worker):
        self._worker = worker
        self._robot: Robot | None = None
        self._q: np.ndarray | None = None
        self._units: Units | None = None
        self._sliders: list[viser.GuiSliderHandle] = []

    def build(self, server: viser.ViserServer) -> None:
        gui = self._gui = server.gui
        self._folder = gui.add_folder("Joints")
        with gui.add_folder("Tool"):
            self._xyz = Coordinates(
                gui, "Position", Quantity.LENGTH, hint="Where the tool is, or is to go, from the base."
            )
            self._rpy = Coordinates(
                gui, "Angles", Quantity.ANGLE, hint="Roll, pitch and yaw that it has, or is to have."
            )
            go = gui.add_button(
                "Go to this pose",
                icon=viser.Icon.ARROW_RIGHT,
                color="gray",
                hint="Bring the tool there by the solution next to where the arm stands.",
            )
            on_press(go, self._go)

    def show(self, session: Session) -> None:
        if session.robot is not self._robot:
            self._rebuild(session.robot)
        elif session.drag is not None:
            return  # many controls: they follow when the target is let go
        q = standing(session)
        for slider, value, joint in zip(self._sliders, q, session.robot.moving, strict=True):
            shown = 1e3 * value if joint.kind is JointKind.PRISMATIC else np.rad2deg(value)
            set_value(slider, float(np.clip(round(float(shown), 1), slider.min, slider.max)))
        tool = se3.inverse(session.robot.base.pose) @ tool_poses(session.robot, Motion(q[None]))[0]
        if q is not self._q or session.units is not self._units:  # what is being typed stays
            self._q, self._units = q, session.units
            self._xyz.show(tool[:3, 3], session.units)
            self._rpy.show(se3.matrix_to_rpy(tool[:3, :3]), session.units)

    def _rebuild(self, robot: Robot) -> None:
        self._robot = robot
        for slider in self._sliders:
            slider.remove()
        self._sliders = []
        with self._folder:
            for i, joint in enumerate(robot.moving):
                slides = joint.kind is JointKind.PRISMATIC
                scale = 1e3 if slides else float(np.rad2deg(1.0))
                low, high = (scale * v for v in robot.search_limits[i])
                slider = self._gui.add_slider(
                    f"Joint {i + 1} [{'mm' if slides else '°'}]",
                    float(np.floor(10 * low) / 10),
                    float(np.ceil(10 * high) / 10),
                    0.1,
                    float(np.clip(0.0, low, high)),
                    hint="Turn this joint by hand; the nominal and the calibrated arm follow.",
                )
                on_change(slider, partial(self._jog, i))
                self._sliders.append(slider)

    def _jog(self, moved: int) -> None:
        """The moved joint from its slider, the others as they stand."""
        session = self._worker.session
        q = standing(session).copy()
        slides = session.robot.moving[moved].kind is JointKind.PRISMATIC
        value = float(self._sliders[moved].value)
        value = 1e-3 * value if slides else float(np.deg2rad(value))
        q[moved] = float(np.clip(value, *session.robot.search_limits[moved]))
        self._worker.submit(Jog(tuple(q.tolist())))

    def _go(self) -> None:
        self._worker.submit(JogTo(self._xyz.typed, self._rpy.typed))
