"""Targets arranged in a pattern, and plates that are put in place of the present one."""

from dataclasses import replace

import numpy as np

from workbench.base.wording import plural
from workbench.plate.patterns import pattern
from workbench.plate.plate import Plate, Target
from workbench.session.command import AbstractChange, computed
from workbench.session.commands.drag import check_place
from workbench.session.reach import solve_all_targets
from workbench.session.state import Session
from workbench.session.target_steps import check_free, move_targets


class ApplyPattern(AbstractChange):
    """Arrange the targets in a pattern (ARIA §4.3); locked targets stay, and count towards the number.

    Args:
        name: circle, line, grid or spiral.
        number: How many targets.
        centre: Middle of the pattern, robot's base [m].
        radius: Half its width [m].
        tilts: Roll angles given to the targets in turn [rad].
    """

    name: str
    number: int
    centre: tuple[float, float, float]
    radius: float
    tilts: tuple[float, ...]

    title = computed(lambda self: f"{plural(self.number, 'target')} in a {self.name}")

    def check(self, session: Session) -> None:
        check_free(session)
        for i, target in enumerate(self._targets()):
            check_place(i, tuple(target.xyz), tuple(target.rpy))

    def apply(self, session: Session) -> Session:
        old = session.plate.targets
        new = [old[i] if i < len(old) and old[i].locked else t for i, t in enumerate(self._targets())]
        return place_targets(session, (*new, *(t for t in old[len(new) :] if t.locked)))

    def _targets(self) -> tuple[Target, ...]:
        centre = np.array(self.centre)
        return pattern(self.name, self.number, centre=centre, radius=self.radius, tilts=self.tilts)


def place_targets(session: Session, targets: tuple[Target, ...]) -> Session:
    """The session with these targets, the arm in the best mix of branches."""
    return place_plate(session, replace(session.plate, targets=targets))


def place_plate(session: Session, plate: Plate, *, selected: int | None = None, seed: int = 0) -> Session:
    """The session with this plate, the arm in the best of the mixes of branches that are tried."""
    states = solve_all_targets(session.robot, plate, region_q=session.region_q, seed=seed)
    return move_targets(session, plate, states, selected=selected)
