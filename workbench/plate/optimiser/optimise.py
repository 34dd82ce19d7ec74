"""The plate optimiser: which blocks, where and in which branch each, so that an arm is right in a region.

The variables are every target's place and orientation on the plate and the inverse-kinematics branch in which
it is measured; the objective is the predicted position error over poses that matter (I-optimality), with the
targets' own uncertainty counted; the constraints are reach with a margin to the joint limits, clearance of
the arm and its probe from plate, blocks, table and itself, also during the retreat from each target, spacing
and the plate's size. First a pool of candidates is drawn, then targets are exchanged from several starts,
then polished (`search`). The given plate is one of the starts.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

import workbench.plate.report.design  # noqa: F401 how results are shown
from workbench.base.errors import DataError
from workbench.base.progress import Cancelled, check_cancelled, part_of, progress
from workbench.base.types import Outcome
from workbench.plate.optimiser.candidates import Candidates, Neighbours, Setting, draw_pool, given_solutions
from workbench.plate.optimiser.constraints import check_base, check_room, conflict
from workbench.plate.optimiser.result import PlateDesign, describe
from workbench.plate.optimiser.search import Search
from workbench.plate.plate import AUTO
from workbench.plate.predicted_error import position_weight
from workbench.plate.target_branches import choose_branches, plate_solutions

POOL_BLOCKS = 1500
"""Random blocks in the pool."""
STARTS = 3
"""Exchanges from different starts."""
POOL_SHARE, EXCHANGE_SHARE = 0.5, 0.1
"""Of the work: the pool, and the exchange after it; the rest polishes."""


def optimise(
    setting: Setting,
    number: int,
    *,
    goal: Float[np.ndarray, "rows n"],
    rng: np.random.Generator,
    places: int,
    starts: int,
) -> PlateDesign:
    """The best plate of so many targets for poses that matter; other arguments as in `design`."""
    robot, plate = setting.robot, setting.plate
    check_room(plate, number, setting.half, setting.spacing)
    check_base(setting.arm, plate, setting.constraints.clearance)
    search = Search(setting, position_weight(robot, goal, setting.names, setting.scales), rng)
    locked = [i for i, target in enumerate(plate.targets) if target.locked]
    outcome = Outcome.CONVERGED
    with part_of(0.0, 0.0, "looking at the given plate"):
        start_cost = _given_error(setting, goal, number)
        given, kept = _given(search, locked)
        best = given.take(np.array(kept)) if len(kept) == number else None
    try:
        with part_of(0.0, POOL_SHARE):
            pool, missed = draw_pool(setting, places, rng=rng)
        near = Neighbours(setting, Candidates.joined(given, pool))
        exchange = search.exchange(near)
        for i in range(starts):
            filling = exchange if i < 2 else search.drawn(near)
            first = filling.fill(number, kept if i == 1 else ())
            if len(first) == number:
                found = near.pool.take(exchange.descend(first).choice)
                if best is None or search.cost(found.rows) < search.cost(best.rows):
                    best = found
            check_cancelled()
            progress(POOL_SHARE + EXCHANGE_SHARE * (i + 1) / starts, "looking for better targets")
        if best is not None:
            with part_of(begun := POOL_SHARE + EXCHANGE_SHARE, 1.0 - begun):
                best = search.polish(best, len(locked))
            check_cancelled()
    except Cancelled:
        outcome = Outcome.CANCELLED
        if best is None:
            return PlateDesign(
                plate=plate, cost=start_cost, rotation=np.nan, start_cost=start_cost, outcome=outcome
            )
    if best is None:
        raise conflict(plate, number, len(near.pool), missed)
    order = list(range(len(locked), number))
    for row, slot in enumerate(locked):  # first in the search, now back at their old numbers
        order.insert(min(slot, len(order)), row)
    lacks = ["the given plate does not keep all constraints"] * (len(kept) < len(plate))
    chosen = best.take(np.array(order))
    return describe(
        setting, chosen, goal=goal, start_cost=start_cost, notes=(setting.arm.source, *lacks), outcome=outcome
    )


def _given_error(setting: Setting, goal: Float[np.ndarray, "rows n"], number: int) -> float:
    """Predicted error of the given plate, made alike, in its best branches, collisions or not [m]; infinite
    where it has not so many reachable targets."""
    robot, plate, rng = setting.robot, setting.plate, np.random.default_rng(0)
    if len(plate) != number:
        return np.inf
    alike = (replace(target, kind=setting.kind, sigma=None, branch=AUTO) for target in plate.targets)
    plate = replace(plate, targets=tuple(alike))
    how: dict[str, Any] = {"goal": goal, "rng": rng, "names": setting.names, "sigma": setting.sigma}
    try:
        return choose_branches(robot, plate, plate_solutions(robot, plate), **how).cost
    except DataError:
        return np.inf


def _given(search: Search, locked: list[int]) -> tuple[Candidates, list[int]]:
    """Candidates of the given plate, and those that go together, locked targets first."""
    setting = search.setting
    slots, *solutions = given_solutions(setting, setting.plate)
    good, rows, _ = setting.examine(*solutions)
    own = np.array([locked.index(slot) if slot in locked else -1 for slot in slots[rows].tolist()], int)
    good, number = replace(good, own=own), len(setting.plate)
    exchange = search.exchange(Neighbours(setting, good))
    chosen = exchange.fill(number)
    if len(chosen) < len(locked):
        slot = locked[len(chosen)]
        text = f"target {slot + 1} is locked where the arm does not keep the margins; unlock or move it"
        raise DataError(text, target=slot)
    if len(chosen) == number:
        chosen = exchange.descend(chosen).choice.tolist()
    return good, [*chosen[: len(locked)], *sorted(chosen[len(locked) :])]  # in their order on the plate
