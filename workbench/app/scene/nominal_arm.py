"""The nominal arm: at the selected target, or at the measured row that is looked at."""

import numpy as np
import viser

from workbench.app.scene.arm import Arm
from workbench.app.scene.part import AbstractPart
from workbench.session.state import Focus, Session


class NominalArm(AbstractPart):
    """The arm that follows the selected target."""

    def __init__(self, server: viser.ViserServer, session: Session):
        self._arm = Arm(server, "/arm", session.robot)
        self._q: np.ndarray | None = None
        self.show(session)

    def show(self, session: Session) -> None:
        """Stand where the focus is."""
        rows = session.comparison if session.focus is Focus.ROW else None
        q = session.states[session.selected].q if rows is None else rows.q[session.row]
        self._arm.visible = session.overlay.nominal or rows is None
        if q is not self._q and (self._q is None or not np.array_equal(q, self._q)):
            self._q = q
            self._arm.stand(session.robot, q)
