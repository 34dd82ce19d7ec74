"""Rivals: effects that would do nearly as well in an accepted one's place, and how all candidates rank."""

from collections.abc import Callable

import numpy as np

from workbench.diagnosis.evidence import Model, Offer, Term, drop, left_by, offer, offers
from workbench.diagnosis.record import Ranked
from workbench.diagnosis.rounds import Searched

LISTED = 3
"""Rivals that are listed for an effect."""
MENTIONED = 0.5
"""Part of an effect's evidence that a rival must have to be mentioned …"""
FAR = 100.0
"""… and how far below the effect's it may lie at most."""
RANKED = 40
"""Candidates in the ranking."""
TRIED = 12
"""How many of them are tried out on the rows that judge."""


def rivals_of(searched: Searched, term: Term) -> list[tuple[Model, Offer]]:
    """The best candidates for the place of an accepted term, each with the model that they would join."""
    rest = drop(searched.found.model, [term])
    left = left_by(searched.grams, rest)
    own = offer(left, term.candidate)
    others = [
        c
        for c in searched.offered.candidates
        if c is not term.candidate
        and not (c.alike and c.effect.name == term.candidate.effect.name)
        and not any(c.excludes(t.candidate) for t in rest)
    ]
    least = np.inf if own is None else max(MENTIONED * own.gain, own.gain - FAR)
    best: dict[tuple, Offer] = {}
    for found in sorted((o for o in offers(left, others) if o.gain > least), key=lambda o: -o.gain):
        effect = found.term.candidate.effect
        if (effect.name, effect.joints) != (term.candidate.effect.name, term.candidate.effect.joints):
            best.setdefault((effect.name, effect.joints), found)
    return [(rest, found) for found in list(best.values())[:LISTED]]


def ranked(searched: Searched, mean_mm: Callable[[Model], float]) -> tuple[Ranked, ...]:
    """What the candidates would bring to the geometry alone, the best first; one for each label.

    Args:
        searched: The search at the geometry alone.
        mean_mm: Error of the geometry with a model on the rows that judge [mm].
    """
    left = left_by(searched.grams, ())
    best: dict[str, Offer] = {}
    for found in sorted(offers(left, searched.offered.candidates), key=lambda o: -o.gain):
        best.setdefault(found.term.candidate.effect.label, found)
    return tuple(
        Ranked(
            o.term.candidate.effect,
            o.gain,
            float(np.exp(o.log_p)),
            mean_mm((o.term,)) if place < TRIED else None,
            o.term.candidate.shrunk,
        )
        for place, o in enumerate(list(best.values())[:RANKED])
    )
