"""The arm as its effects bend it, exaggerated, over the one that stands straight."""

import numpy as np
import viser

from workbench.app.scene.arm import Arm
from workbench.app.scene.part import AbstractPart
from workbench.appearance.colours import BENT
from workbench.robots.robot import Robot
from workbench.session.bending import bend, bending_robot
from workbench.session.commands.arm import standing
from workbench.session.state import Overlay, Session

OPACITY = 0.42


class BentArm(AbstractPart):
    """A translucent arm that is made when an arm with effects is shown first."""

    def __init__(self, server: viser.ViserServer, session: Session):
        self._server = server
        self._robot: Robot | None = None
        self._arm: Arm | None = None
        self._q: np.ndarray | None = None
        self._overlay: Overlay | None = None
        self.show(session)

    def show(self, session: Session) -> None:
        """Stand where the solid arm does, bent by its loads there."""
        robot, overlay, q = bending_robot(session), session.overlay, standing(session)
        if robot is self._robot and overlay is self._overlay and q is self._q:
            return
        if robot is not self._robot:
            self._replace(robot)
        self._overlay, self._q = overlay, q
        if self._arm is None or robot is None:
            return
        self._arm.visible = overlay.bent
        if overlay.bent:
            self._arm.stand(robot, q, shift=overlay.bending * bend(robot, q).shift)

    def _replace(self, robot: Robot | None) -> None:
        if self._arm is not None:
            self._arm.remove()
        self._robot = robot
        if robot is None:
            self._arm = None
            return
        self._arm = Arm(self._server, "/bent", robot, ghost=BENT, opacity=OPACITY, swell=1.0, has_foot=False)
