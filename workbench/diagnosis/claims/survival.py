"""Robustness of a claim: whether it remains the best one under varied assumptions.

The rows are evaluated again with the linear solution at the fit,

- without each tenth of them, in the order of measurement;
- with Student's t for errors: rows with large errors have less weight.

If an effect of load was fitted, masses, centres and the direction of gravity are unknowns: its odds and
standard errors then include their uncertainty. A claim survives if its odds against every rival, and the
significance of its coefficients, remain. For an effect of several joints this must hold for every named
joint: against other joints in its place, other effects, or none, and beside all other joints.
"""

from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from jaxtyping import Float

from workbench.arm.effects import Candidate
from workbench.data.measuring_order import clock_of
from workbench.diagnosis.claims.accepted_terms import best_of, place_of
from workbench.diagnosis.claims.named_joints import MIN_NAMED_ERRORS, clearness
from workbench.diagnosis.search.evidence import (
    NONZERO_ERRORS,
    Model,
    Offer,
    Remainder,
    Term,
    compatible,
    joints_of,
    left_by,
    offer,
    offers,
    own_columns,
)
from workbench.diagnosis.search.gram_matrices import compress
from workbench.diagnosis.search.rounds import Searched
from workbench.diagnosis.search.stepwise_search import kind_of
from workbench.identification.noise import STUDENT_FREEDOM, consistent
from workbench.identification.problem import Problem

ROW_PARTS = 10
"""Number of parts of the rows that are left out in turn."""
MAX_RIVALS = 20
"""Maximum number of rivals evaluated again."""


@dataclass(frozen=True)
class Survival:
    """What remains of a claim.

    Args:
        holds: Whether it stays the best one.
        lost: Joints, counted from 0, that may not be named.
    """

    holds: bool
    lost: frozenset[int]


def survival(
    searched: Searched, group: Model, rivals: Sequence[Offer], including: Container[int], *, minimum: float
) -> Survival:
    """What remains of a claim that the rows prefer.

    Args:
        searched: The last search, at the final fit.
        group: Terms of the claim.
        rivals: Other claims for their place, the best first.
        including: Candidates, by their `id`, that contain the claim as a special case and are no rivals.
        minimum: Log evidence by which it must remain better than others.
    """
    every = searched.offered.candidates
    kinds = [c for c in every if c.alike and kind_of(Term(c)) == kind_of(group[0])]
    widest = max(kinds, key=lambda c: len(c.names), default=None)
    left, weak = place_of(searched, group).left, set[int | None]()
    beside_all = None if widest is None else offer(left, widest)
    if beside_all is not None and joints_of((beside_all.term,)) >= joints_of(group):
        clear = _clearness(left, (beside_all.term,))
        weak |= {j for j in joints_of(group) if clear[j] < MIN_NAMED_ERRORS}
    others = [o.term.candidate for o in rivals[:MAX_RIVALS]]
    parts = [c for c in every if kind_of(Term(c)) == kind_of(group[0]) and len(c.effect.joints) == 1]
    for k, rows in enumerate(chain([searched], _reweighted(searched, others, kinds, parts))):
        place = place_of(rows, group)
        best = best_of([o for o in place.offers if id(o.term.candidate) not in including])
        if k and place.own - best < minimum:
            return Survival(False, frozenset())
        weak |= {j for j, z in _clearness(place.left, group).items() if z < NONZERO_ERRORS}
        if widest is not None:
            weak |= _replaceable(place.left, group, widest, rows.offered.candidates, minimum)
    return Survival(None not in weak, frozenset(j for j in weak if j is not None))


def _reweighted(searched: Searched, *requested: Sequence[Candidate]) -> Iterator[Searched]:
    """The search's model and some candidates on reweighted rows."""
    problem = searched.stage.problem.with_noise(searched.stage.geometric_problem.noise)
    x, rows = searched.stage.fit.x, len(problem.data)
    accepted = [t.candidate for t in searched.model]
    candidates = tuple(dict.fromkeys(c for some in (accepted, *requested) for c in some))
    effects, tenth = [c.effect for c in candidates], np.empty(rows, np.int64)
    tenth[np.argsort(clock_of(problem.data)[0], kind="stable")] = np.arange(rows) * ROW_PARTS // rows
    parts = compress(problem, x, effects, tenth).without_each
    heavy = problem.with_row_weights(_student_weights(problem, x))
    for grams in (*parts, compress(heavy, x, effects, np.zeros(rows, np.int64))):
        yield replace(searched, grams=grams, offered=replace(searched.offered, candidates=candidates))


def _student_weights(problem: Problem, x: Float[np.ndarray, " p"]) -> Float[np.ndarray, " rows"]:
    """Roots of the rows' weights under Student's t."""
    rows, residual = len(problem.data), problem.residual(x)[: problem.size]
    count = np.bincount(problem.component_rows, problem.inverse_sigma > 0.0, rows)
    square = np.bincount(problem.component_rows, residual**2, rows) * problem.count / (residual @ residual)
    room = STUDENT_FREEDOM * np.array([consistent(int(m)) for m in count])
    return np.sqrt((STUDENT_FREEDOM + count) / (room + square))


def _clearness(left: Remainder, group: Model) -> dict[int | None, float]:
    """Standard errors by which joints' coefficients differ from zero, as in `clearness`, in the place of a
    group."""
    own, precision = own_columns(left.grams, group)
    inverse = np.linalg.inv(left.inner(own) + precision)
    along = left.along(own)
    found = inverse @ along
    rest = max(left.square - float(found @ along), 0.0)
    std = np.sqrt(np.maximum(np.diagonal(inverse), 0.0) * rest / max(left.freedom, 1))
    names = [n for t in group for n in t.candidate.names]
    sizes, errors = (dict(zip(names, v.tolist(), strict=False)) for v in (found, std))
    return clearness([t.candidate.effect.sized(sizes) for t in group], errors)


def _replaceable(
    left: Remainder, group: Model, widest: Candidate, candidates: Sequence[Candidate], minimum: float
) -> set[int | None]:
    """Joints of an effect of several in whose place another joint, another kind of effect, or none would do
    beside its other joints."""
    mine, kind, out = joints_of(group), kind_of(group[0]), set[int | None]()
    if len(mine) < 2 or not mine <= {*widest.effect.joints}:
        return out
    for joint in mine:
        rest = widest.only([k for k, j in enumerate(widest.effect.joints) if j in mine - {joint}])
        for found in offers(left, [rest], group=group):
            beside, own, best = left_by(left.grams, (*left.model, found.term)), 0.0, 0.0
            for each in offers(beside, compatible(candidates, beside.model), group=group):
                candidate = each.term.candidate
                if kind_of(each.term) != kind or joint not in candidate.effect.joints:
                    best = max(best, each.gain)
                elif candidate.effect.joints == (joint,):
                    own = max(own, each.gain)
            if best > own - minimum:
                out.add(joint)
    return out
