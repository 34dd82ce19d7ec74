"""Faint arms: the other branches that reach the selected target."""

import numpy as np
import viser

from workbench.session.state import Field, Focus, Session
from workbench.views.appearance.colours import BRANCH
from workbench.views.page.scene.arm import Arm
from workbench.views.page.scene.part import AbstractPart

OPACITY = 0.13
MOST = 8
"""Arms of so many branches are drawn at most."""
SAME = 1e-6
"""Joint positions this near are one posture [rad or m]."""


class BranchGhosts(AbstractPart):
    """Arms are made when they are first needed; hidden during a drag, and among cubes."""

    def __init__(self, server: viser.ViserServer, session: Session):
        self._server = server
        self._arms: list[Arm] = []
        self._drawn: object = None
        self.show(session)

    def show(self, session: Session) -> None:
        is_shown = (
            session.focus is Focus.TARGET
            and session.drag is None
            and session.overlay.ghosts
            and session.cube_view.field is Field.NONE
            and session.branches_of is session.plate.targets[session.selected]
        )
        basis = (session.branches, session.states[session.selected]) if is_shown else None
        if basis == self._drawn:
            return
        self._drawn = basis
        ways = other_ways(session) if is_shown else []
        while len(self._arms) < len(ways):
            name = f"/branches/{len(self._arms)}"
            self._arms.append(
                Arm(
                    self._server,
                    name,
                    session.robot,
                    ghost=BRANCH,
                    opacity=OPACITY,
                    swell=0.9,
                    is_plain=True,
                )
            )
        for i, arm in enumerate(self._arms):
            arm.visible = i < len(ways)
            if i < len(ways):
                arm.stand(session.robot, ways[i])


def other_ways(session: Session) -> list[np.ndarray]:
    """Joint positions of the branches that the arm does not take."""
    now = session.states[session.selected].q
    return [w.q for w in session.branches if np.abs(w.q - now).max() > SAME][:MOST]
