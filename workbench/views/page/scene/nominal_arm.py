"""The nominal arm: at the selected target, at the measured row that is looked at, or where it was jogged."""

import numpy as np
import viser

from workbench.session.commands.arm import standing
from workbench.session.state import Focus, Session
from workbench.views.page.scene.arm import Arm
from workbench.views.page.scene.part import AbstractPart


class NominalArm(AbstractPart):
    """The arm that follows the selected target."""

    def __init__(self, server: viser.ViserServer, session: Session):
        self._arm = Arm(server, "/arm", session.robot)
        self._q: np.ndarray | None = None
        self.show(session)

    def show(self, session: Session) -> None:
        self._robot = session.robot
        self._arm.visible = session.overlay.nominal or session.focus is not Focus.ROW
        if not session.is_underway:
            self.move(standing(session))

    def move(self, q: np.ndarray) -> None:
        """Stand at these joint positions."""
        if q is not self._q and (self._q is None or not np.array_equal(q, self._q)):
            self._q = q
            self._arm.stand(self._robot, q)
