"""The arm as its effects bend it, exaggerated, over the one that stands straight."""

import numpy as np
import viser

from workbench.arm.robot import Robot
from workbench.session.bending import bend, bending_robot
from workbench.session.commands.arm import standing
from workbench.session.state import Session
from workbench.views.appearance.colours import BENT
from workbench.views.page.scene.arm import Arm
from workbench.views.page.scene.part import AbstractPart

OPACITY = 0.42


class BentArm(AbstractPart):
    """A translucent arm that is made when an arm with effects is shown first."""

    def __init__(self, server: viser.ViserServer, session: Session):
        self._server = server
        self._robot: Robot | None = None
        self._arm: Arm | None = None
        self._q: np.ndarray | None = None
        self._overlay = session.overlay
        self.show(session)

    def show(self, session: Session) -> None:
        robot, overlay = bending_robot(session), session.overlay
        if robot is not self._robot:
            self._replace(robot)
        if overlay is not self._overlay or self._arm is None:
            self._overlay, self._q = overlay, None
        if self._arm is not None:
            self._arm.visible = overlay.bent
        if not session.is_underway:
            self.move(standing(session))

    def move(self, q: np.ndarray) -> None:
        """Stand at these joint positions, bent by the loads there."""
        if self._arm is None or self._robot is None or not self._overlay.bent or q is self._q:
            return
        self._q = q
        self._arm.stand(self._robot, q, shift=self._overlay.bending * bend(self._robot, q).shift)

    def _replace(self, robot: Robot | None) -> None:
        if self._arm is not None:
            self._arm.remove()
        self._robot, self._q = robot, None
        if robot is None:
            self._arm = None
            return
        self._arm = Arm(self._server, "/bent", robot, ghost=BENT, opacity=OPACITY, swell=1.0, has_foot=False)
