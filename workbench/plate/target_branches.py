"""Branches: in which inverse-kinematics solution each target of a plate is to be measured.

The same ten targets, measured in ten different postures, say far more about the arm than in ten alike:
for the paper's Table 2 plate the predicted error over its region falls about sevenfold. The choice is an
exchange over the solutions of each target, by the predicted error over poses that matter.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.inverse import solve as inverse
from workbench.arm.inverse.branch import roomy
from workbench.arm.inverse.solve import Branch, Task
from workbench.arm.robot import Robot
from workbench.base.errors import DataError
from workbench.base.progress import part_of
from workbench.base.types import Outcome, frozen
from workbench.plate.collision import hits, unobstructed
from workbench.plate.exchange import of_information
from workbench.plate.free_constants import visible, visible_basis
from workbench.plate.observability import goal_index
from workbench.plate.plate import AUTO, Kind, Plate
from workbench.plate.poses.sampling import in_base
from workbench.plate.predicted_error import predicted_error
from workbench.plate.target_readings import SEAT, linearise_targets

THERE = 1e-6
"""Joint angles put the tool there if no entry of its pose is off by more [m, 1]."""
Solutions = Sequence[Sequence[Branch]]

STARTS = 20
"""Random mixes to start from, beside every single branch."""


@dataclass(frozen=True, eq=False)
class BranchChoice:
    """In which branch each target is measured, and what that is worth.

    Args:
        q: Joint positions at the targets [rad or m].
        branches: Name of each target's branch.
        cost: Predicted root mean square position error over the poses that matter [m], infinite where the
            targets leave it open.
        single: The same cost for each branch that reaches all targets, measured alone.
    """

    q: Float[np.ndarray, "targets n"]
    branches: tuple[str, ...]
    cost: float
    single: dict[str, float]
    outcome: Outcome


def plate_solutions(robot: Robot, plate: Plate) -> tuple[tuple[Branch, ...], ...]:
    """Every solution within limits of every target; of a target with joint angles only the one meant."""
    solutions, away = _solutions(robot, plate)
    for number, why in enumerate(away, start=1):
        if why:
            raise DataError(f"target {number} of plate '{plate.name}' is {why}", target=number - 1)
    return solutions


def _solutions(robot: Robot, plate: Plate) -> tuple[tuple[tuple[Branch, ...], ...], tuple[str, ...]]:
    """The solutions of every target, and why it is out of reach; empty where it is not."""
    plate.check_joints(robot)
    poses = robot.base.pose @ plate.poses
    solutions: list[tuple[Branch, ...]] = [()] * len(plate)
    away = [""] * len(plate)
    for task, rows in _by_task(robot, plate).items():
        for row, result in zip(rows, inverse.solve_many(robot, poses[rows], task=task), strict=True):
            if not result.reachable:
                away[row] = str(result.reason)
                continue
            given = plate.targets[row].q
            meant = None if given is None else inverse.choose(result, branch=given)
            solutions[row] = result.within_limits if meant is None else (meant,)
    return tuple(solutions), tuple(away)


@dataclass(frozen=True, eq=False)
class Measurable:
    """The targets of a plate that an arm can visit.

    Args:
        rows: Their numbers, counted from 0.
        plate: With these targets alone.
        solutions: Solutions of each in which the arm runs into nothing.
        hits: What it would run into at each target of the whole plate; empty for those that it can stand at.
        away: Why it can't reach each target; empty for those that it can.
    """

    rows: Int[np.ndarray, " measurable"]
    plate: Plate
    solutions: tuple[tuple[Branch, ...], ...]
    hits: tuple[str, ...]
    away: tuple[str, ...]

    @property
    def lacking(self) -> dict[int, str]:
        """The targets that it can't visit, counted from 0, with the reason in words."""
        both = enumerate(zip(self.hits, self.away, strict=True))
        bad = ((i, hit, away) for i, (hit, away) in both if hit or away)
        return {i: f"blocked: {hit}" if hit else away for i, hit, away in bad}


def measurable(robot: Robot, plate: Plate) -> Measurable:
    """The targets that the arm reaches clear of plate and blocks, in a branch that the target means."""
    plate.check_targets()
    every, away = _solutions(robot, plate)
    meant = [
        tuple(b for b in found if target.branch in (AUTO, b.name) or target.q is not None) or found
        for target, found in zip(plate.targets, every, strict=True)
    ]
    clear = [roomy(unobstructed(robot, plate, i, found)) for i, found in enumerate(meant)]
    hit = tuple(
        "" if free or not found else hits(robot, plate, [i], found[0].q[None])[0]
        for i, (free, found) in enumerate(zip(clear, meant, strict=True))
    )
    rows = [i for i, free in enumerate(clear) if free]
    part = replace(plate, targets=tuple(plate.targets[i] for i in rows))
    can = Measurable(np.array(rows, int), part, tuple(clear[i] for i in rows), hit, away)
    if not rows:
        raise DataError(
            f"no target of plate '{plate.name}' can be measured: target 1 is {can.lacking[0]}; move the "
            "plate, or choose other branches",
            target=0,
        )
    return can


def _by_task(robot: Robot, plate: Plate) -> dict[Task | None, list[int]]:
    """Targets by what of them the tool has to meet: seats all that the arm can, others their position.

    Joint angles that put the tool as the target says, as a designed plate gives them, are met as they are.
    """
    tasks: dict[Task | None, list[int]] = {}
    for row, target in enumerate(plate.targets):
        is_whole = target.kind is Kind.SEAT
        if not is_whole and target.q is not None:
            is_whole = np.abs(in_base(robot, target.q[None])[0] - target.pose).max() < THERE
        tasks.setdefault(None if is_whole else Task.POSITION, []).append(row)
    return tasks


def single_branches(solutions: Solutions) -> dict[str, Float[np.ndarray, "targets n"]]:
    """Joint positions of every branch name that all targets share."""
    rows = [{branch.name: branch.q for branch in target} for target in solutions]
    shared = [name for name in rows[0] if all(name in row for row in rows)]
    return {name: np.stack([row[name] for row in rows]) for name in shared}


def choose_branches(
    robot: Robot,
    plate: Plate,
    solutions: Solutions,
    *,
    goal: Float[np.ndarray, "rows n"],
    rng: np.random.Generator,
    names: tuple[str, ...] | None = None,
    sigma: tuple[float, float] = SEAT,
) -> BranchChoice:
    """Choose a branch for every target; targets with a named branch keep it.

    Args:
        robot: Geometry at which the measurements are linearised.
        solutions: Solutions of each target within limits, from `plate_solutions`.
        goal: Joint positions of poses that matter (see `plate.region_poses`), whose error is made small.
        names: Constants to be identified; the robot's default free ones if None.
        sigma: Standard deviations of the instrument's positions [m] and rotations [rad].
    """
    slots = np.repeat(np.arange(len(solutions)), [len(target) for target in solutions])
    labels = [branch.name for target in solutions for branch in target]
    q = np.array([branch.q for target in solutions for branch in target])
    at = partial(linearise_targets, robot, plate, names=names, sigma=sigma)
    linearisation = at(q, slots=slots)
    basis = visible_basis(robot, names)
    seen = visible(linearisation, basis)  # sockets and points give their position only
    starts_of = np.searchsorted(seen.measurement, np.arange(1, seen.measurements))
    options = np.stack([block.T @ block for block in np.split(seen.scaled, starts_of)])
    allowed = _allowed(plate, slots, labels)
    index = goal_index(goal, robot, linearisation, basis)
    place = {key: i for i, key in enumerate(zip(slots.tolist(), labels, strict=True))}
    single = {
        name: np.array([place[slot, name] for slot in range(len(solutions))])
        for name in single_branches(solutions)
    }
    random = [np.array([rng.choice(np.flatnonzero(row)) for row in allowed]) for _ in range(STARTS)]
    valid = [choice for choice in single.values() if allowed[np.arange(len(choice)), choice].all()]
    with part_of(0.0, 1.0, "choosing branches"):
        search = of_information(options, index, len(solutions), allowed=allowed)
        found = search.from_each([*valid, *random])

    def cost_of(choice: np.ndarray) -> float:
        """The cost without the ridge of the index, which would gloss over unseen parameters."""
        return predicted_error(at(q[choice]), robot, goal).position_rms

    return BranchChoice(
        q=frozen(q[found.choice]),
        branches=tuple(labels[i] for i in found.choice),
        cost=cost_of(found.choice),
        single={name: cost_of(choice) for name, choice in single.items()},
        outcome=found.outcome,
    )


def _allowed(plate: Plate, slots: np.ndarray, labels: list[str]) -> np.ndarray:
    allowed = slots[None] == np.arange(len(plate))[:, None]
    for slot, target in enumerate(plate.targets):
        if not allowed[slot].any():
            raise DataError(f"target {slot + 1} of plate '{plate.name}' has no solution within limits")
        if target.branch == AUTO or target.q is not None:
            continue
        mine = [labels[i] for i in np.flatnonzero(allowed[slot])]
        if target.branch not in mine:
            raise DataError(
                f"target {slot + 1} of plate '{plate.name}' has no branch '{target.branch}' within limits; "
                f"it has {', '.join(mine)}",
                target=slot,
                found=target.branch,
            )
        allowed[slot] &= np.array([label == target.branch for label in labels])
    return allowed
