"""Commands that change the set of targets: add, delete, lock, choose branches."""

from dataclasses import replace

import numpy as np

from workbench.base.errors import OptionError
from workbench.base.types import frozen
from workbench.plate.patterns import MAX_TARGETS
from workbench.plate.plate import AUTO
from workbench.session.command import AbstractChange, computed
from workbench.session.commands.drag import check_place, plain
from workbench.session.state import Session
from workbench.session.target_postures import branches_to, place
from workbench.session.target_steps import (
    AbstractTargetStep,
    check_free,
    check_unlocked,
    move_targets,
    place_plate,
    with_target,
)

STEP = 0.06
"""Distance of a new target from all others, and of the places that are tried for it [m]."""


class AddTarget(AbstractChange):
    """A new target at the angles of the selected one.

    Args:
        place: Where [m].
    """

    title = "Add a target"

    place: tuple[float, float, float]

    def check(self, session: Session) -> None:
        check_free(session)
        check_place("the new target", self.place, ())
        if len(session.plate) >= MAX_TARGETS:
            raise OptionError(f"a plate can have at most {MAX_TARGETS} targets; delete one first")

    def apply(self, session: Session) -> Session:
        model = session.plate.targets[session.selected]
        target = replace(model, xyz=frozen(np.array(self.place)), q=None, locked=False)
        state = place(session.robot, target, session.states[session.selected].q)
        plate = replace(session.plate, targets=(*session.plate.targets, target))
        session = replace(session, selected=len(plate) - 1)
        return move_targets(session, plate, (*session.states, state))


class DeleteTarget(AbstractChange):
    """Take a target away."""

    target: int

    title = computed(lambda self: f"Delete target {self.target + 1}")

    def check(self, session: Session) -> None:
        check_unlocked(session, self.target)
        check_free(session)
        if len(session.plate) == 1:
            raise OptionError("the last target can't be deleted; move it instead")

    def apply(self, session: Session) -> Session:
        both, i = (session.plate.targets, session.states), self.target
        targets, states = ((*items[:i], *items[i + 1 :]) for items in both)
        return move_targets(session, replace(session.plate, targets=targets), states)


class LockTarget(AbstractTargetStep):
    """Lock a target in its place, or unlock it."""

    target: int
    locked: bool

    title = computed(lambda self: f"{'Lock' if self.locked else 'Unlock'} target {self.target + 1}")
    key = computed(lambda self: ("lock", self.target))

    def apply(self, session: Session) -> Session:
        target = replace(session.plate.targets[self.target], locked=self.locked)
        return move_targets(session, *with_target(session, self.target, target, session.states[self.target]))


class MovePlate(AbstractTargetStep):
    """Put the plate elsewhere, with all its targets, which the arm then reaches in branches chosen anew.

    Args:
        xyz: Centre of its top in the robot's base [m].
        rpy: Its roll, pitch, yaw [rad].
    """

    title = "Move the plate"

    xyz: tuple[float, float, float]
    rpy: tuple[float, float, float]

    def check(self, session: Session) -> None:
        super().check(session)
        check_place("the plate", self.xyz, self.rpy)

    def apply(self, session: Session) -> Session:
        xyz, rpy = frozen(np.array(self.xyz)), frozen(np.array(self.rpy))
        return place_plate(session, session.plate.moved(xyz, rpy))


def free_place(session: Session) -> tuple[float, float, float]:
    """Nearest the region's middle at the selected target's height, `STEP` from all targets.

    It is the middle itself if the region is full.
    """
    plate, height = session.plate, float(session.plate.targets[session.selected].xyz[2])
    low, high = plate.region.min[:2], plate.region.max[:2]
    counts = [np.arange(-n, n + 1) for n in (0.5 * (high - low) / STEP).astype(int)]
    offsets = STEP * np.stack(np.meshgrid(*counts, indexing="ij"), axis=-1).reshape(-1, 2)
    nearest_first = offsets[np.argsort(np.linalg.norm(offsets, axis=1), kind="stable")]
    places = np.column_stack([0.5 * (low + high) + nearest_first, np.full(len(offsets), height)])
    taken = np.array([target.xyz for target in plate.targets])
    gaps = np.linalg.norm(places[:, None] - taken, axis=-1).min(axis=1)
    return plain(places[np.argmax(gaps > 0.999 * STEP)])


class ChooseBranch(AbstractTargetStep):
    """Measure a target in the branch of this name, or leave that to the program (`auto`)."""

    target: int
    branch: str

    title = computed(lambda self: f"Target {self.target + 1}: branch {self.branch}")
    key = computed(lambda self: ("branch", self.target))

    def check(self, session: Session) -> None:
        super().check(session)
        found = branches_to(session.robot, session.plate.targets[self.target])
        if self.branch not in (AUTO, *(branch.name for branch in found)):
            raise OptionError(f"target {self.target + 1} has no branch '{self.branch}' within the limits")

    def apply(self, session: Session) -> Session:
        target = replace(session.plate.targets[self.target], branch=self.branch, q=None)
        state = place(session.robot, target, session.states[self.target].q)
        session = replace(session, selected=self.target)
        return move_targets(session, *with_target(session, self.target, target, state))
