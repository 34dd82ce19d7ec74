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
from workbench.plate.exchange import of_information
from workbench.plate.observability import I
from workbench.plate.optimiser.candidates import (
    BlockSolutions,
    Candidates,
    Neighbours,
    Setting,
    draw_pool,
    given_solutions,
)
from workbench.plate.optimiser.constraints import Constraints, check_base, check_room, conflict, half_size
from workbench.plate.optimiser.meshes import arm_shape
from workbench.plate.optimiser.result import PlateDesign, branches_of, describe, set_error
from workbench.plate.optimiser.search import Search
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
    request: DesignRequest,
    names: tuple[str, ...] | None = None,
) -> PlateDesign:
    """As `design.optimise_plate`, for poses that matter and constants to be identified."""
    names = robot.default_free if names is None else names
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
        plate, unknown = setting.plate, setting.reading.unknown_sigma
        self.setting, self.request, self.goal, self.rng, self.given = setting, request, goal, rng, plate
        self.number = len(plate) if request.number is None else request.number
        self.half = half_size(plate, request.constraints)
        check_room(plate, self.number, self.half, setting.spacing)
        check_base(setting.arm, plate, request.constraints.clearance)
        weight = np.zeros((len(setting.names) + len(unknown),) * 2)  # the reading's own unknowns don't matter
        own = slice(len(setting.names))
        weight[own, own] = position_weight(setting.robot, goal, setting.names, setting.scales)
        prior = np.concatenate([np.full(len(setting.names), VAGUE), unknown]) ** -2
        self.search = Search(setting, weight, prior, rng)
        self.best: Candidates | None = None
        self.best_cost = np.inf
        self.start_cost, self.start_kept = np.inf, False
        self.kept: dict[str, np.ndarray] = {}
        self.locked = [i for i, target in enumerate(plate.targets) if target.locked]

    def result(self) -> PlateDesign:
        outcome = Outcome.CONVERGED
        with part_of(0.0, 0.0, "looking at the given plate"):
            start, exact = self._offered() if len(self.given) else (None, [])
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
        order = list(range(len(self.locked), self.number))
        for row, slot in enumerate(self.locked):  # first in the search, now back at their old numbers
            order.insert(min(slot, len(order)), row)
        worse = "the given plate, in its best branches, does not keep all constraints; the new one does"
        is_worse = np.isfinite(self.start_cost) and not self.start_kept
        return describe(
            self.setting,
            self.best.take(np.array(order)),
            goal=self.goal,
            start_cost=self.start_cost,
            start_kept=self.start_kept,
            notes=(self.setting.arm.source, *([worse] if is_worse else [])),
            history=tuple(np.sqrt(self.search.history)),
            outcome=outcome,
        )

    def _offered(self) -> tuple[Candidates, list[int]]:
        """Candidates of the given plate, those of locked targets first; and, where it keeps everything, which
        of them it is."""
        solutions = given_solutions(self.setting, self.given)
        fits = self.request.blocks.fit(solutions.places, self.half)
        good, kept = self.setting.examine(*(part[fits] for part in solutions[1:]))
        fine = np.flatnonzero(fits)[np.logical_and.reduce(list(kept.values()))]
        slots, is_chosen = solutions.slots[fine], np.zeros(len(fine), bool)
        if len(np.unique(solutions.slots)) == len(self.given) == self.number:
            choice = self._choose(solutions)
            self.start_cost = self._error(solutions.q[choice], solutions.places[choice])
            is_chosen = np.isin(fine, choice)
        free = np.flatnonzero(~np.isin(slots, self.locked))
        order = np.array([*(self._lock(slot, slots, is_chosen) for slot in self.locked), *free], int)
        good, exact = good.take(order), np.flatnonzero(is_chosen[order]).tolist()
        near = Neighbours(self.setting, good)
        self.start_kept = len(exact) == self.number and all(
            near.spaced(exact[:i])[row] and near.clear(row, exact[:i]) for i, row in enumerate(exact)
        )
        return good, exact if self.start_kept else []

    def _lock(self, slot: int, slots: np.ndarray, is_chosen: np.ndarray) -> int:
        """A candidate of a locked target, the chosen one if possible."""
        mine = np.flatnonzero(slots == slot)
        if not len(mine):
            raise DataError(
                f"target {slot + 1} is locked where the arm does not keep the margins; unlock or move it",
                target=slot,
            )
        return int(mine[np.argmax(is_chosen[mine])])

    def _choose(self, solutions: BlockSolutions) -> np.ndarray:
        """The best branches for the given plate, collisions or not."""
        blocks = self.setting.rows(solutions.q, solutions.places)
        allowed = solutions.slots[None] == np.arange(len(self.given))[:, None]
        starts = [np.array([self.rng.choice(np.flatnonzero(row)) for row in allowed]) for _ in range(10)]
        mine = [np.flatnonzero(solutions.branches == name) for name in np.unique(solutions.branches)]
        first = [rows[np.unique(solutions.slots[rows], return_index=True)[1]] for rows in mine]
        single = [choice for choice in first if len(choice) == len(self.given)]
        if self.request.postures is Postures.SINGLE and single:
            return min(single, key=lambda c: self._error(solutions.q[c], solutions.places[c]))
        options = blocks.transpose(0, 2, 1) @ blocks + np.diag(self.search.prior) / len(self.given)
        search = of_information(options, I(self.search.weight), len(allowed), allowed=allowed)
        return search.from_each([*single, *starts]).choice

    def _search(self, start: Candidates | None, exact: list[int]) -> None:
        if start is not None and exact:
            self._keep(start.take(np.array(exact)))
        with part_of(0.0, POOL_SHARE):
            candidates, self.kept = draw_pool(
                self.setting, self.request.blocks, self.half, self.request.places, rng=self.rng
            )
        candidates = candidates if start is None else start.join(candidates)
        names = [""] if self.request.postures is Postures.MIXED else np.unique(candidates.branches)
        for i, name in enumerate(names):
            mine = (candidates.branches == name) | (name == "")
            mine[: len(self.locked)] = True
            rows = np.flatnonzero(mine).tolist()
            near, held = Neighbours(self.setting, candidates.take(mine)), range(len(self.locked))
            first = [rows.index(c) for c in exact if mine[c]] or held
            for number in range(self.request.starts):
                filling = self.search.exchange(near) if number < 2 else self.search.drawn(near)
                chosen = filling.fill(self.number, held if number else first)
                if len(chosen) == self.number:
                    self._keep(self.search.descend(near, chosen, len(held)))
            share = POOL_SHARE + (EXCHANGE_SHARE - POOL_SHARE) * (i + 1) / len(names)
            progress(share, "looking for better targets")
        if self.best is not None:
            self._keep(self.search.polish(self.request.blocks, self.half, self.best, len(self.locked)))

    def _keep(self, targets: Candidates) -> None:
        """Remember the targets if they are the best so far; one branch must have remained one: the polish
        follows postures, not names."""
        cost, is_free = self.search.cost(targets.rows), self.request.postures is Postures.MIXED
        if cost < self.best_cost and (
            is_free or self.best is None or len(set(branches_of(self.setting, targets))) == 1
        ):
            self.best, self.best_cost = targets, cost

    def _error(self, q: np.ndarray, places: np.ndarray) -> float:
        return set_error(self.setting, q, places, self.goal).position_rms
