"""Commands that place targets: snap one, enter the whole table, arrange them in a pattern."""

from dataclasses import replace
from enum import StrEnum

import numpy as np

from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.base.types import Vector3, frozen
from workbench.plate.patterns import MAX_TARGETS, pattern
from workbench.plate.plate import Plate, Target
from workbench.session.command import AbstractChange, computed
from workbench.session.commands.drag import MoveTarget, check_place
from workbench.session.reach import solve_all_targets
from workbench.session.state import Session
from workbench.session.target_steps import check_free, check_unlocked, move_targets

GRID = 0.01
"""Pitch of the grid that targets snap to [m]."""
HEIGHT = 0.05
"""Height of a target above the plate that it snaps to [m], as in ARIA Fig. 6."""


class Snap(StrEnum):
    """What a target snaps to."""

    PLATE = "plate"
    GRID = "grid"
    CUBE = "cube"


class SnapTarget(AbstractChange):
    """Move a target to the nearest position above the plate, on the grid, or at the centre of a cube."""

    target: int
    to: str

    title = computed(lambda self: f"Snap target {self.target + 1} to {self.to}")

    def check(self, session: Session) -> None:
        check_unlocked(session, self.target)
        check_free(session)
        if self.to not in list(Snap):
            raise OptionError(f"targets snap to plate, grid or cube, got '{self.to}'")

    def apply(self, session: Session) -> Session:
        target = session.plate.targets[self.target]
        x, y, z = snapped(session.plate, target.xyz, Snap(self.to)).tolist()
        roll, pitch, yaw = target.rpy.tolist()
        return MoveTarget(self.target, (x, y, z), (roll, pitch, yaw)).apply(session)


class PlaceTargets(AbstractChange):
    """The whole table of targets, typed: position [m] and roll, pitch, yaw [rad] of each.

    Targets keep what else is known of them by their number; more rows are new targets, fewer delete the last.
    """

    rows: tuple[tuple[float, ...], ...]

    title = computed(lambda self: f"Set the coordinates of {len(self.rows)} targets")

    def check(self, session: Session) -> None:
        check_free(session)
        if not 1 <= len(self.rows) <= MAX_TARGETS:
            raise OptionError(f"the table must have 1 to {MAX_TARGETS} targets, got {len(self.rows)}")
        for i, row in enumerate(self.rows):
            if len(row) != 6:
                raise OptionError(f"line {i + 1} must have 6 numbers (x y z roll pitch yaw), got {len(row)}")
            check_place(i, row[:3], row[3:])
        for i, target in enumerate(session.plate.targets):
            if target.locked and (i >= len(self.rows) or not _same(target, self.rows[i])):
                check_unlocked(session, i)

    def apply(self, session: Session) -> Session:
        old = session.plate.targets
        targets = []
        for i, row in enumerate(self.rows):
            if i < len(old) and _same(old[i], row):
                targets.append(old[i])
                continue
            model = old[min(i, len(old) - 1)]
            xyz, rpy = frozen(np.array(row[:3])), frozen(np.array(row[3:]))
            targets.append(replace(model, xyz=xyz, rpy=rpy, q=None, locked=model.locked and i < len(old)))
        return place_targets(session, tuple(targets))


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

    title = computed(lambda self: f"{self.number} targets in a {self.name}")

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


def snapped(plate: Plate, xyz: Vector3, to: Snap) -> Vector3:
    """The nearest place of that kind [m]."""
    if to is Snap.GRID:
        return np.round(xyz / GRID) * GRID
    if to is Snap.CUBE:
        centres = plate.region.centres
        return centres[np.argmin(np.linalg.norm(centres - xyz, axis=1))]
    local = se3.apply(se3.inverse(plate.pose), xyz)
    return se3.apply(plate.pose, np.array([local[0], local[1], HEIGHT]))


def _same(target: Target, row: tuple[float, ...]) -> bool:
    return (*target.xyz.tolist(), *target.rpy.tolist()) == row
