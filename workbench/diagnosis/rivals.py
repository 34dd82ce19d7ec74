"""Rivals: effects that would do nearly as well in an accepted one's place, and how all candidates rank."""

from collections.abc import Sequence
from dataclasses import dataclass

from workbench.arm.effects import Candidate
from workbench.diagnosis.evidence import Left, Model, Offer, Term, behind, drop, left_by, offers
from workbench.diagnosis.rounds import Searched
from workbench.diagnosis.stepwise_search import kind_of, worth

LISTED = 3
"""Rivals that are listed for an effect."""
MENTIONED = 0.5
"""Part of an effect's evidence that a rival must have to be mentioned …"""
FAR = 100.0
"""… and how far below the effect's it may lie at most."""
RANKED = 40
"""Candidates in the ranking."""


@dataclass(frozen=True, eq=False)
class Place:
    """The place of some accepted terms, and what would do instead.

    Args:
        left: What the rest of the model leaves.
        own: Log evidence of the terms in it.
        offers: What other claims would bring there, the best first.
    """

    left: Left
    own: float
    offers: Sequence[Offer]


def place_of(searched: Searched, group: Model) -> Place:
    """The place of some terms of the accepted model."""
    rest = drop(searched.found.model, group)
    left = left_by(searched.grams, rest)
    others = [
        c
        for c in searched.offered.candidates
        if not _same_claim(c, group) and not any(c.excludes(t.candidate) for t in rest)
    ]
    found = offers(left, others, behind=behind(searched.grams, group))
    return Place(left, worth(searched.grams, rest, group), sorted(found, key=lambda o: -o.gain))


def _same_claim(other: Candidate, group: Model) -> bool:
    """Whether another candidate would claim the same as some terms."""
    if kind_of(Term(other)) != kind_of(group[0]):
        return False
    joints = {j for t in group for j in t.candidate.effect.joints}
    return other.alike or len(group) > 1 or set(other.effect.joints) == joints


def distinct(found: Sequence[Offer]) -> list[Offer]:
    """The first of each label."""
    best: dict[str, Offer] = {}
    for one in found:
        best.setdefault(one.term.candidate.effect.label, one)
    return list(best.values())


def rivals_of(searched: Searched, term: Term) -> list[tuple[Model, Offer]]:
    """The best candidates for the place of an accepted term, each with the model that they would join."""
    place = place_of(searched, (term,))
    least = max(MENTIONED * place.own, place.own - FAR)
    near = distinct([o for o in place.offers if o.gain > least])
    return [(place.left.model, found) for found in near[:LISTED]]


def ranked(searched: Searched) -> list[Offer]:
    """What the candidates would bring to the geometry alone, the best first; one for each label."""
    found = offers(left_by(searched.grams, ()), searched.offered.candidates)
    return distinct(sorted(found, key=lambda o: -o.gain))[:RANKED]
