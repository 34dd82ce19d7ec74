"""Accepted terms in a model, and what other claims would contribute in their place."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.arm.effects import Candidate
from workbench.diagnosis.search.evidence import (
    Model,
    Offer,
    Remainder,
    Term,
    compatible,
    drop,
    joints_of,
    left_by,
    left_without,
    offers,
    with_one_more,
)
from workbench.diagnosis.search.rounds import Searched
from workbench.diagnosis.search.stepwise_search import group_evidence, kind_of

MAX_INCLUDED_SHARE = 0.01
"""Share of a column's square left by a rival below which it contains the claim as a special case."""


@dataclass(frozen=True, eq=False)
class Place:
    """Some accepted terms of a model, and what would replace them.

    Args:
        left: Residual of the rest of the model.
        own: Log evidence of the terms.
        offers: Contributions of other claims in their place, best first.
    """

    left: Remainder
    own: float
    offers: Sequence[Offer]


def place_of(searched: Searched, group: Model) -> Place:
    """Some terms of the accepted model, and what would replace them."""
    left = left_without(searched.grams, searched.model, group)
    others = [c for c in searched.offered.candidates if not _same_claim(c, group)]
    found = offers(left, compatible(others, left.model), group=group)
    return Place(left, group_evidence(left, group), sorted(found, key=lambda o: -o.gain))


def _same_claim(other: Candidate, group: Model) -> bool:
    """Whether another candidate would make the same claim as some terms, of these joints or of fewer."""
    if kind_of(Term(other)) != kind_of(group[0]):
        return False
    return other.alike or len(group) > 1 or set(other.effect.joints) <= joints_of(group)


def includes(left: Remainder, rival: Offer, group: Model) -> bool:
    """Whether a rival with more coefficients contains some terms as a special case; the simpler claim is
    preferred."""
    names = [n for t in group for n in t.candidate.names]
    if len(rival.term.candidate.names) <= len(names):
        return False
    columns = left.grams.columns(names)
    beside = left_by(left.grams, (*left.model, rival.term))
    before, after = (np.diagonal(side.inner(columns)) for side in (left, beside))
    return bool((after < MAX_INCLUDED_SHARE * before).all())


def distinct(found: Sequence[Offer]) -> list[Offer]:
    """The first of each label."""
    best: dict[str, Offer] = {}
    for one in found:
        best.setdefault(one.term.candidate.effect.label, one)
    return list(best.values())


def replaceable_joints(searched: Searched, group: Model, minimum: float) -> set[int]:
    """Joints of an effect of several in whose place another kind of effect, another joint, or none would do
    beside its other joints, as the log evidence of the effect there is not so much better."""
    candidates, mine, kind = searched.offered.candidates, joints_of(group), kind_of(group[0])
    widest = max((c for c in candidates if c.alike and kind_of(Term(c)) == kind), key=lambda c: len(c.names))
    left, out = left_by(searched.grams, drop(searched.model, group)), set[int]()
    for joint in mine:
        rest = widest.only([k for k, j in enumerate(widest.effect.joints) if j in mine - {joint}])
        for found in offers(left, [rest], group=group):
            beside, own, best = with_one_more(left, (*left.model, found.term)), 0.0, 0.0
            for each in offers(beside, compatible(candidates, beside.model), group=group):
                joints = each.term.candidate.effect.joints
                if kind_of(each.term) != kind or joint not in joints:
                    best = max(best, each.gain)
                elif joints == (joint,):
                    own = max(own, each.gain)
            if best > own - minimum:
                out.add(joint)
    return out
