"""The plate optimiser: which blocks, where and in which branch each, so that an arm is right in a region.

The variables are every target's place and orientation on the plate and the inverse-kinematics branch in which
it is measured; the objective is the predicted position error over poses that matter (I-optimality), with the
targets' own uncertainty counted; the constraints are reach with a margin to the joint limits, clearance of
the arm and its probe from plate, blocks, table and itself, also during the retreat from each target, spacing
and the plate's size. First a pool of candidates is drawn, then targets are exchanged from several starts,
then polished (`search`). The given plate is one of the starts.
"""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TypedDict

import numpy as np
from jaxtyping import Float

import workbench.plate.report.design  # noqa: F401 how results are shown
from workbench.arm.linearisation import linearise
from workbench.arm.robot import Robot
from workbench.base.arguments import admit
from workbench.base.errors import DataError, OptionError
from workbench.base.progress import Cancelled, part_of, progress
from workbench.base.types import Outcome
from workbench.plate.exchange import exchange
from workbench.plate.optimality_criterion import RegionCriterion
from workbench.plate.optimiser.candidates import (
    BlockSolutions,
    Candidates,
    Neighbours,
    Setting,
    draw_pool,
    given_solutions,
)
from workbench.plate.optimiser.clearance import arm_shape
from workbench.plate.optimiser.constraints import Constraints, check_base, check_room, conflict, half_size
from workbench.plate.optimiser.result import PlateDesign, branches_of, describe, set_error
from workbench.plate.optimiser.search import Search
from workbench.plate.optimiser.shapes import plate_hull
from workbench.plate.optimiser.target_blocks import Blocks
from workbench.plate.plate import Plate
from workbench.plate.predicted_error import position_weight
from workbench.plate.target_readings import TargetReading
from workbench.plate.tolerances import Production

VAGUE = 3.0
"""Standard deviation of a constant before anything is measured, as the tool feels it [m]: next to nothing is
known, but enough to tell sets apart that leave something open."""
POOL_BLOCKS = 2500
"""Random blocks in the pool."""
STARTS = 3
"""Exchanges from different starts."""
POOL_SHARE = 0.6
"""Progress at which the pool is done."""
EXCHANGE_SHARE = 0.8
"""Progress at which the exchange is done."""


class Postures(StrEnum):
    """In which branches the targets are measured."""

    MIXED = "mixed"
    SINGLE = "single"


@dataclass(frozen=True, eq=False, kw_only=True)
class DesignRequest:
    """Requirements for a fixture.

    Args:
        number: How many targets; as many as the given plate has if None.
        postures: Branches mixed at will, or one branch for all targets.
        blocks: Shapes that may be chosen from.
        constraints: Clearances that every target keeps.
        production: Tolerances of production; as the given plate says if None.
        shapes: How many different blocks may be made; any number if None.
        places: Random blocks in the pool.
        starts: Exchanges from different starts.
    """

    number: int | None = None
    postures: Postures = Postures.MIXED
    blocks: Blocks = field(default_factory=Blocks)
    constraints: Constraints = field(default_factory=Constraints)
    production: Production | None = None
    shapes: int | None = None
    places: int = POOL_BLOCKS
    starts: int = STARTS

    def __post_init__(self):
        admit(self)
        if self.places < 1 or self.starts < 1:
            raise OptionError(f"places and starts must be at least 1, got {self.places} and {self.starts}")
        if self.shapes is not None and self.shapes < 1:
            raise OptionError(
                f"the number of block shapes must be at least 1, got {self.shapes}",
                option="shapes",
                found=self.shapes,
            )


class RequestFields(TypedDict, total=False):
    """The fields of `DesignRequest` as keyword arguments, for type checkers and editors."""

    number: int | None
    postures: Postures
    blocks: Blocks
    constraints: Constraints
    production: Production | None
    shapes: int | None
    places: int
    starts: int


def optimise_plate(
    robot: Robot,
    plate: Plate,
    *,
    reading: TargetReading,
    goal: Float[np.ndarray, "rows n"],
    rng: np.random.Generator,
    request: DesignRequest | None = None,
    names: tuple[str, ...] | None = None,
) -> PlateDesign:
    """The plate with the smallest predicted error that keeps all constraints.

    Args:
        plate: Where the plate lies and how large it is; its targets are one of the starts, and those that
            are locked stay.
        reading: What is read at a target, and how well.
        goal: Joint positions of poses that matter [rad or m], see `plate.region_poses`.
        request: What is asked for.
        names: Constants to be identified; the robot's default free ones if None.

    Returns:
        The design; where the given plate keeps the constraints, never a worse one.

    Raises:
        OptionError: a plate without size or inside the robot's base, more targets than fit.
        DataError: too few targets keep all constraints; names two that conflict.
    """
    request, names = request or DesignRequest(), robot.default_free if names is None else names
    setting = Setting(
        robot=robot,
        plate=plate,
        arm=arm_shape(robot, request.constraints.clearance),
        constraints=request.constraints,
        reading=reading,
        production=plate.production if request.production is None else request.production,
        names=names,
        scales=linearise(robot, np.zeros((1, robot.dof)), names=names).weights,
    )
    return _Optimisation(setting, goal, rng, request).result()


class _Optimisation:
    """One optimisation; keeps the best targets so far for whoever cancels."""

    def __init__(self, setting: Setting, goal: np.ndarray, rng: np.random.Generator, request: DesignRequest):
        plate = setting.plate
        self.setting, self.request, self.goal, self.rng, self.given = setting, request, goal, rng, plate
        self.number = len(plate) if request.number is None else request.number
        self.half = half_size(plate, request.constraints)
        check_room(plate, self.number, self.half, setting.spacing)
        check_base(setting.arm, plate, plate_hull(plate), request.constraints.clearance)
        self.search = _search(self.setting, goal, rng)
        self.best: Candidates | None = None
        self.best_cost = np.inf
        self.start_cost, self.start_kept = np.inf, False
        self.kept: dict[str, np.ndarray] = {}
        self.locked: Candidates | None = None
        self.locked_slots = [i for i, target in enumerate(plate.targets) if target.locked]

    def result(self) -> PlateDesign:
        outcome = Outcome.CONVERGED
        with part_of(0.0, 0.0, "looking at the given plate"):
            start, exact = self._start()
        try:
            self._search(start, exact)
        except Cancelled:
            outcome = Outcome.CANCELLED
        if self.best is None:
            if outcome is Outcome.CANCELLED:
                cost = self.start_cost
                return PlateDesign(
                    plate=self.given, cost=cost, rotation=np.nan, start_cost=cost, outcome=outcome
                )
            raise conflict(self.given, self.number, self.kept)
        progress(1.0, "done")
        return describe(
            self.setting,
            self.best.take(self._in_order()),
            goal=self.goal,
            start_cost=self.start_cost,
            start_kept=self.start_kept,
            notes=self._notes(),
            history=tuple(np.sqrt(self.search.history)),
            outcome=outcome,
        )

    def _in_order(self) -> np.ndarray:
        """Locked targets, which come first in the search, at their old numbers, the others in between."""
        order = list(range(len(self.locked_slots), self.number))
        for row, slot in enumerate(self.locked_slots):
            order.insert(min(slot, len(order)), row)
        return np.array(order)

    def _notes(self) -> tuple[str, ...]:
        worse = "the given plate, in its best branches, does not keep all constraints; the new one does"
        is_worse = np.isfinite(self.start_cost) and not self.start_kept
        return (self.setting.arm.source, *([worse] if is_worse else []))

    def _start(self) -> tuple[Candidates | None, np.ndarray | None]:
        """Candidates that the given plate offers, and, where it keeps everything, itself among them."""
        if not len(self.given):
            return None, None
        solutions = given_solutions(self.setting, self.given)
        fits = self.request.blocks.fit(solutions.places, self.half)
        good, kept = self.setting.examine(*(part[fits] for part in solutions[1:]))
        fine = np.flatnonzero(fits)[np.logical_and.reduce(list(kept.values()))]
        is_whole = len(np.unique(solutions.slots)) == len(self.given) == self.number
        choice = self._choose(solutions) if is_whole else np.zeros(0, int)
        free = self._lock(good, solutions.slots[fine], np.isin(fine, choice))
        if not is_whole:
            return good.take(free), None
        self.start_cost = self._error(solutions.q[choice], solutions.places[choice])
        rows = np.searchsorted(fine, choice)
        inside = rows < len(fine)
        if not inside.all() or not (fine[rows] == choice).all():
            return good.take(free), None
        near = Neighbours(self.setting, good)
        together = all(near.clear(int(r), rows[:i].tolist()) for i, r in enumerate(rows))
        spaced = all(near.spaced(rows[:i].tolist())[r] for i, r in enumerate(rows))
        self.start_kept = together and spaced
        rows = np.delete(rows, self.locked_slots)
        return good.take(free), np.searchsorted(free, rows) if self.start_kept else None

    def _lock(self, good: Candidates, slots: np.ndarray, is_chosen: np.ndarray) -> np.ndarray:
        """Hold a posture of every locked target, the chosen one if possible; returns the other rows."""
        rows = []
        for slot in self.locked_slots:
            mine = np.flatnonzero(slots == slot)
            if not len(mine):
                raise DataError(
                    f"target {slot + 1} is locked where the arm does not keep the margins; unlock or move it",
                    target=int(slot),
                )
            rows.append(int(mine[np.argmax(is_chosen[mine])]))
        self.locked = good.take(np.array(rows)) if rows else None
        return np.flatnonzero(~np.isin(slots, self.locked_slots))

    def _with_locked(self, candidates: Candidates) -> Candidates:
        return candidates if self.locked is None else self.locked.join(candidates)

    def _choose(self, solutions: BlockSolutions) -> np.ndarray:
        """The best branches for the given plate, collisions or not."""
        blocks = self.setting.rows(solutions.q, solutions.places)
        allowed = solutions.slots[None] == np.arange(len(self.given))[:, None]
        starts = [np.array([self.rng.choice(np.flatnonzero(row)) for row in allowed]) for _ in range(10)]
        everywhere = [self._everywhere(solutions, name) for name in np.unique(solutions.branches)]
        single = [choice for choice in everywhere if choice is not None]
        if self.request.postures is Postures.SINGLE and single:
            return min(single, key=lambda c: self._error(solutions.q[c], solutions.places[c]))
        known = np.diag(self.search.prior) / len(self.given)
        return exchange(
            blocks.transpose(0, 2, 1) @ blocks + known,
            allowed,
            RegionCriterion(self.search.weight),
            starts=np.stack([*single, *starts]),
        ).choice

    def _everywhere(self, solutions: BlockSolutions, name: str) -> np.ndarray | None:
        mine = np.flatnonzero(solutions.branches == name)
        slots, first = np.unique(solutions.slots[mine], return_index=True)
        return mine[first] if len(slots) == len(self.given) else None

    def _search(self, start: Candidates | None, exact: np.ndarray | None) -> None:
        if start is not None and exact is not None:
            self._keep(self._with_locked(start.take(exact)))
        with part_of(0.0, POOL_SHARE):
            candidates, self.kept = draw_pool(
                self.setting, self.request.blocks, self.half, self.request.places, rng=self.rng
            )
        candidates = candidates if start is None else start.join(candidates)
        first = [] if exact is None else exact.tolist()
        groups = self._groups(candidates)
        for i, rows in enumerate(groups):
            self._exchange(candidates.take(rows), [int(np.searchsorted(rows, c)) for c in first if c in rows])
            share = POOL_SHARE + (EXCHANGE_SHARE - POOL_SHARE) * (i + 1) / len(groups)
            progress(share, "looking for better targets")
        if self.best is not None:
            self._keep(self.search.polish(self.request.blocks, self.half, self.best, len(self.locked_slots)))

    def _groups(self, candidates: Candidates) -> list[np.ndarray]:
        """All candidates, or those of each branch."""
        if self.request.postures is Postures.MIXED:
            return [np.arange(len(candidates))]
        return [np.flatnonzero(candidates.branches == name) for name in np.unique(candidates.branches)]

    def _exchange(self, candidates: Candidates, first: list[int]) -> None:
        candidates, locked = self._with_locked(candidates), len(self.locked_slots)
        near = Neighbours(self.setting, candidates)
        for number in range(self.request.starts):
            begun = [*range(locked), *([c + locked for c in first] if number == 0 else [])]
            chosen = self.search.fill(near, begun, self.number, greedy=number < 2)
            if chosen is not None:
                self._keep(candidates.take(np.array(self.search.exchange(near, chosen, locked))))

    def _keep(self, targets: Candidates) -> None:
        """Remember the targets if they are the best so far."""
        cost = self.search.cost(targets.rows)
        if cost < self.best_cost and self._in_their_branches(targets):
            self.best, self.best_cost = targets, cost

    def _in_their_branches(self, targets: Candidates) -> bool:
        """Whether one branch has remained one: the polish follows postures, not names."""
        if self.request.postures is Postures.MIXED or self.best is None:
            return True
        return len(set(branches_of(self.setting, targets))) == 1

    def _error(self, q: np.ndarray, places: np.ndarray) -> float:
        return set_error(self.setting, q, places, self.goal).position_rms


def _search(setting: Setting, goal: np.ndarray, rng: np.random.Generator) -> Search:
    """The criterion's weight and prior, with zero weight for the reading's own unknowns."""
    robot, names = setting.robot, setting.names
    unknown = setting.reading.unknown_sigma
    weight = np.zeros((len(names) + len(unknown),) * 2)
    weight[: len(names), : len(names)] = position_weight(robot, goal, names, setting.scales)
    return Search(
        setting=setting,
        weight=weight,
        prior=np.concatenate([np.full(len(names), VAGUE), unknown]) ** -2,
        rng=rng,
    )
