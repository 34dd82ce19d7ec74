"""Exchange: one option for each of several slots, changed one at a time until no change helps.

Slots are the poses of a set, the targets of a plate or the branches of its targets; options are what may be
taken there. A start is given, or filled greedily; then every slot in turn takes the option that makes the
cost smallest with the other slots as they stand, and a local optimum is reached when a whole round changes
nothing. Several starts guard against poor ones. The cost never rises above that of the start.

Where an index of summed information is maximised (`of_information`) and a slot has many options, its slope
ranks them, and only the best few that promise any gain are tried. A choice filled up greedily by the
determinant (`by_determinant`) starts it.

Sources: Fedorov, Theory of Optimal Experiments (1972), §3; coordinate form of Meyer & Nachtsheim,
Technometrics 37(1), 1995; greedily: Dykstra, Technometrics 13(3), 1971; for some parameters alone: Atkinson,
Donev & Tobias, Optimum Experimental Designs, with SAS (2007), §10.3.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import linalg

from workbench.base.errors import OptionError
from workbench.base.progress import cancelled, progress
from workbench.base.types import Outcome
from workbench.plate.observability import AbstractIndex, AbstractSetIndex

MAX_ROUNDS = 50
"""Maximum number of rounds from one start."""
OPTIONS_TRIED = 24
"""Options of a slot whose cost is computed, by information."""
FITS_TRIED = 400
"""Maximum number of options that are asked whether they fit, best first."""
RIDGE = 1e-10
"""Information before anything is chosen, as a share of the options' mean."""
Choice = Sequence[int] | Int[np.ndarray, " slots"]
"""Option of each slot."""


@dataclass(frozen=True, eq=False)
class Exchanged:
    """The best choice that was found, and its cost."""

    choice: Int[np.ndarray, " slots"]
    cost: float
    outcome: Outcome


@final
@dataclass(frozen=True, eq=False)
class Exchange:
    """What is chosen from, and what a choice costs.

    Args:
        costs: Of a choice and one of its slots, or the next one, the cost with each option there; infinite
            where it may not be taken.
        cost: Of a choice, exactly.
        fits: Whether an option can stand beside others; asked of the best alone, for what takes long.
        better: Share of its cost by which a choice must become better.
    """

    costs: Callable[[list[int], int], Float[np.ndarray, " options"]]
    cost: Callable[[list[int]], float]
    fits: Callable[[int, list[int]], bool] = lambda option, others: True
    better: float = 1e-12

    def best(self, chosen: list[int], slot: int, limit: float = np.inf) -> int | None:
        """The option of smallest cost below a limit for a slot; None if none is below it and fits."""
        costs, others = self.costs(chosen, slot), chosen[:slot] + chosen[slot + 1 :]
        rows = np.flatnonzero(costs < limit)
        ranked = rows[np.argsort(costs[rows], kind="stable")][:FITS_TRIED].tolist()
        return next((option for option in ranked if self.fits(option, others)), None)

    def fill(self, number: int, chosen: Iterable[int] = ()) -> list[int]:
        """A choice filled up greedily; shorter than that number where nothing fits any more."""
        chosen = list(chosen)
        while len(chosen) < number and (found := self.best(chosen, len(chosen))) is not None:
            chosen.append(found)
        return chosen

    def improve(self, chosen: list[int], slot: int, cost: float) -> float:
        """Give a slot its best option; the cost afterwards, the very same where nothing is changed."""
        limit = cost - self.better * abs(cost)
        found = self.best(chosen, slot, limit)
        if found is None:
            return cost
        before, chosen[slot] = chosen[slot], found
        after = self.cost(chosen)
        if after < limit:
            return after
        chosen[slot] = before  # its cost was smaller by rounding alone
        return cost

    def descend(self, start: Choice) -> Exchanged:
        """Give every slot in turn its best option, until a whole turn changes none."""
        chosen = [int(option) for option in start]
        cost, kept = self.cost(chosen), 0  # slots in a row that have their best option already
        for slot in MAX_ROUNDS * [*range(len(chosen))]:
            if cancelled():
                return Exchanged(np.array(chosen), cost, Outcome.CANCELLED)
            before, cost = cost, self.improve(chosen, slot, cost)
            kept = kept + 1 if cost == before else 0
            if kept == len(chosen):
                break
        ended = Outcome.CONVERGED if kept == len(chosen) else Outcome.ITERATION_LIMIT
        return Exchanged(np.array(chosen), cost, ended)

    def from_each(self, starts: Sequence[Choice]) -> Exchanged:
        """The best of the choices that several starts lead to."""
        found: list[Exchanged] = []
        for start in starts:
            found.append(self.descend(start))
            progress(len(found) / len(starts), "exchanging")
            if found[-1].outcome is Outcome.CANCELLED:
                break
        best, last = min(found, key=lambda each: each.cost), found[-1]
        ended = last.outcome if last.outcome is Outcome.CANCELLED else best.outcome
        return Exchanged(best.choice, best.cost, ended)


def of_information(
    options: Float[np.ndarray, "options p p"],
    index: AbstractIndex,
    measurements: int,
    *,
    allowed: Bool[np.ndarray, "slots options"] | None = None,
    clash: Bool[np.ndarray, "options options"] | None = None,
) -> Exchange:
    """Choose options so that an index of their summed information is greatest.

    Args:
        options: Information AᵀA of each option.
        index: Of whole sets.
        measurements: How many a set has.
        allowed: Which options each slot may take; all if None.
        clash: Which options must not be chosen together, itself where none may be taken twice; starts must
            keep it.
    """

    if not isinstance(index, AbstractSetIndex):
        text = f"index {index.name} looks at single poses; choose by O1 … O5 or I"
        raise OptionError(text, option="index", found=index.name)

    def costs(chosen: list[int], slot: int) -> Float[np.ndarray, " options"]:
        total, old, others = options[chosen].sum(0), chosen[slot], chosen[:slot] + chosen[slot + 1 :]
        tried = np.ones(len(options), bool) if allowed is None else allowed[slot]
        if clash is not None:
            tried = tried & ~clash[others].any(0)
        numbers = np.flatnonzero(tried)
        if len(numbers) > OPTIONS_TRIED:
            gains = np.tensordot(options[numbers] - options[old], index.slope(total, measurements), 2)
            best = np.argsort(-gains, kind="stable")[:OPTIONS_TRIED]
            numbers = numbers[best[gains[best] > 0.0]]
        found = np.full(len(options), np.inf)
        if len(numbers):
            found[numbers] = -index.of_grams(total - options[old] + options[numbers], measurements)
        return found

    return Exchange(
        costs, lambda chosen: -float(index.of_grams(options[chosen].sum(0)[None], measurements)[0])
    )


def by_determinant(
    blocks: Float[np.ndarray, "options r p"],
    *,
    clash: Bool[np.ndarray, "options options"],
    before: Float[np.ndarray, "p p"] | None = None,
    nuisance: int = 0,
) -> Exchange:
    """Choose options that multiply the determinant of the information M most, one by one (`Exchange.fill`).

    The rows B of an option multiply it by det(I + B M⁻¹ Bᵀ).

    Args:
        blocks: Scaled, whitened Jacobian of each option.
        clash: Which options must not be chosen together; each clashes with itself.
        before: Information without any of them; so little that it only makes M regular if None.
        nuisance: So many of the first parameters don't matter in themselves: what counts is the determinant
            with these eliminated, |M| over that of their part of M (Ds-optimality).
    """
    _, rows, size = blocks.shape
    if before is None:
        before = RIDGE * (blocks**2).sum() / (len(blocks) * size) * np.eye(size)

    def gains(information: Float[np.ndarray, "p p"], number: int) -> Float[np.ndarray, " options"]:
        """Of the first parameters' log determinant, by each option."""
        part = np.ascontiguousarray(blocks[:, :, :number])
        spread = part.reshape(-1, number) @ covariance_of(information[:number, :number])
        seen = spread.reshape(part.shape) @ part.transpose(0, 2, 1)
        return np.linalg.slogdet(np.eye(rows) + seen)[1]

    def costs(chosen: list[int], slot: int) -> Float[np.ndarray, " options"]:
        known = blocks[chosen].reshape(-1, size)
        information = before + known.T @ known
        found = gains(information, size) - (gains(information, nuisance) if nuisance else 0.0)
        return np.where(clash[chosen].any(0), np.inf, -found)

    return Exchange(costs, lambda chosen: 0.0)


def covariance_of(information: Float[np.ndarray, "p p"]) -> Float[np.ndarray, "p p"]:
    """The inverse as a square, so that rounding leaves no negative variance along unobservable directions."""
    root = np.linalg.cholesky(information)
    half = linalg.solve_triangular(root, np.eye(len(root)), lower=True, check_finite=False)
    return half.T @ half
