"""Stepwise search for effects: add the best, exchange, prune, until no candidate is significant.

A candidate enters if it is likelier than none, as one of so many, the evidence prefers it to every other, and
the cross-validated error decreases. After each entry every effect is compared with all others in its place,
and several maps of joints with one smooth map.
"""

from collections.abc import Sequence

import numpy as np

from workbench.arm.effects import Candidate
from workbench.base.progress import cancelled, suspected
from workbench.diagnosis.search.evidence import (
    Model,
    Offer,
    Remainder,
    Term,
    compatible,
    drop,
    grouped,
    left_by,
    left_of,
    left_without,
    offer,
    offers,
    own_offers,
    validated,
    with_one_more,
)
from workbench.diagnosis.search.gram_matrices import Grams

MAX_EFFECTS = 40
"""Maximum number of effects of one arm."""
MAX_EXCHANGE_ROUNDS = 6
"""Maximum rounds of exchange after each entry."""
MAX_EARLY_EXCHANGE_EFFECTS = 3
"""Number of effects up to which exchanges are tried after every entry …"""
MAX_LATE_EXCHANGE_EFFECTS = 8
"""… and up to which they are tried once nothing more enters."""
MIN_FALL = 0.005
"""Minimum share of a fold's square that an effect must explain when fitted to the others."""
MIN_JOINT_EVIDENCE = 2.0
"""Minimum log evidence of each joint in an effect of several."""
MAX_LAWS_FOR_MAP = 2
"""Maximum number of laws of a joint's position that may together replace its map …"""
MIN_MAP_EVIDENCE_GAP = 20.0
"""… and the log evidence by which they must be better: an unnamed error can resemble two of them."""
MIN_EXCHANGE_GAIN = 0.5
"""Minimum gain in log evidence of an exchange."""


def search(grams: Grams, candidates: Sequence[Candidate], start: Model = ()) -> Model:
    """Find the effects that the rows support, from those that were accepted at an earlier fit."""
    model = exchange(grams, candidates, prune(grams, candidates, start))
    exchanged, seen = True, {_names(model)}
    for _ in range(MAX_EFFECTS):
        if cancelled():
            break
        added = _add(grams, candidates, model)
        if added is not None:
            exchanged = len(added) <= MAX_EARLY_EXCHANGE_EFFECTS
            model = _improved(grams, candidates, added) if exchanged else prune(grams, candidates, added)
            if _names(model) in seen:
                break
            seen.add(_names(model))
        elif exchanged:
            break
        else:
            exchanged, model = True, _improved(grams, candidates, model)
    return model


def _names(model: Model) -> frozenset[tuple[str, ...]]:
    return frozenset(t.candidate.names for t in model)


def significant(found: Offer, tries: int) -> bool:
    """Whether one of so many candidates is likelier than none."""
    return bool(found.gain > np.log(max(tries, 1)))


def confirmed(grams: Grams, smaller: Model, larger: Model) -> bool:
    """Whether the larger model predicts other folds better by more than one standard error."""
    fall = 1.0 - validated(grams, larger) / validated(grams, smaller)
    error = fall.std(ddof=1) / np.sqrt(len(fall)) if len(fall) > 1 else 0.0
    return bool(fall.mean() > max(MIN_FALL, error))


def _improved(grams: Grams, candidates: Sequence[Candidate], model: Model) -> Model:
    return prune(grams, candidates, exchange(grams, candidates, trimmed(grams, model)))


def trimmed(grams: Grams, model: Model) -> Model:
    """Effects of several joints without the joints that the rows don't support."""
    for term in [t for t in model if t.candidate.alike]:
        rest = drop(model, [term])
        left = left_by(grams, rest)
        best = offer(left, term.candidate)
        while best is not None and len(best.term.candidate.effect.joints) > 2:
            whole, joints = best.term.candidate, range(len(best.term.candidate.effect.joints))
            parts = (whole.only([i for i in joints if i != k]) for k in joints)
            fewer = [o for c in parts if (o := offer(left, c)) is not None]
            better = max(fewer, key=lambda o: o.gain, default=None)
            if better is None or better.gain < best.gain - MIN_JOINT_EVIDENCE:
                break
            best = better
        model = rest if best is None else (*rest, best.term)
    return model


def _add(grams: Grams, candidates: Sequence[Candidate], model: Model) -> Model | None:
    """The model with the best further effect that cross-validation confirms; None without one."""
    some = compatible(candidates, model)
    strong = [o for o in offers(left_of(grams, model), some) if significant(o, len(candidates))]
    ranked = sorted(strong, key=lambda o: -o.gain)[:5]
    suspected({o.term.candidate.effect.plain: o.gain for o in ranked})
    models = ((*model, best.term) for best in ranked)
    return next((larger for larger in models if confirmed(grams, model, larger)), None)


def exchange(grams: Grams, candidates: Sequence[Candidate], model: Model) -> Model:
    """Replace accepted effects by better ones, one at a time or all maps of a joint together."""
    for _ in range(MAX_EXCHANGE_ROUNDS if len(model) <= MAX_LATE_EXCHANGE_EFFECTS else 0):
        better = _one_exchange(grams, candidates, model)
        if better is None:
            return model
        model = better
    return model


def _one_exchange(grams: Grams, candidates: Sequence[Candidate], model: Model) -> Model | None:
    for group in _groups(model):
        rest = drop(model, group)
        left = left_without(grams, model, group)
        present = group_evidence(left, group)
        offered = offers(left, compatible(candidates, left.model), group=group)
        if group[0].candidate.effect.maps_joint and len(group) > 1:  # a joint's map may replace its laws
            offered = [o for o in offered if o.term.candidate.effect.maps_joint]
        elif len(group) > 1:
            kind = kind_of(group[0])
            offered = [o for o in offered if o.term.candidate.alike and kind_of(o.term) == kind]
        best = max(offered, key=lambda o: o.gain, default=None)
        same = best is not None and len(group) == 1 and best.term.candidate is group[0].candidate
        if best is not None and not same and best.gain > present + MIN_EXCHANGE_GAIN:
            return trimmed(grams, (*rest, best.term))
        if same and best is not None and not np.isclose(best.term.precision, group[0].precision, rtol=0.7):
            return (*rest, best.term)
    maps = (t for t in model if t.candidate.shrunk and t.candidate.effect.maps_joint)
    return next((named for t in maps if (named := _named_laws(grams, candidates, model, t))), None)


def _named_laws(grams: Grams, candidates: Sequence[Candidate], model: Model, term: Term) -> Model | None:
    """The model with a few laws in the place of a joint's map, if the rows prefer them together.

    The map enters first if no single law explains enough, and exchanges of one for one never bring two in its
    place. Laws that leave a significant map are parts of an unnamed error.
    """
    left = left_without(grams, model, (term,))
    present = group_evidence(left, (term,))
    joints = term.candidate.effect.joints
    laws = [c for c in candidates if c.effect.maps_joint and not c.shrunk and c.effect.joints == joints]
    for _ in range(MAX_LAWS_FOR_MAP):
        best = max(offers(left, compatible(laws, left.model)), key=lambda o: o.gain, default=None)
        if best is None or best.gain <= 0.0:
            return None
        left, present = with_one_more(left, (*left.model, best.term)), present - best.gain
    rest = offer(left, term.candidate)
    return left.model if present < -MIN_MAP_EVIDENCE_GAP and (rest is None or rest.gain <= 0.0) else None


def _groups(model: Model) -> list[Model]:
    """Every term alone, all effects of one kind if there are several, all maps of one joint likewise."""
    maps = [t for t in model if t.candidate.effect.maps_joint]
    several = (*by_claim(model), *grouped(maps, lambda term: term.candidate.effect.joints).values())
    return [*((t,) for t in model), *(tuple(group) for group in several if len(group) > 1)]


def by_claim(model: Model) -> list[Model]:
    """Terms of one claim: those of one kind in several joints, every other term alone."""
    alike = grouped(model, lambda term: kind_of(term) if term.candidate.effect.of_many_joints else id(term))
    return [tuple(group) for group in alike.values()]


def kind_of(term: Term) -> tuple[str, str]:
    """Label of an effect without its joints."""
    return term.candidate.effect.name, term.candidate.effect.variant


def group_evidence(left: Remainder, group: Model) -> float:
    """Evidence that a group of terms adds to the others, one after the other."""
    total = 0.0
    for term in group:
        found = offer(left, term.candidate)
        total += 0.0 if found is None else found.gain
        if term is not group[-1]:
            left = with_one_more(left, (*left.model, term))
    return total


def prune(grams: Grams, candidates: Sequence[Candidate], model: Model) -> Model:
    """Drop effects made redundant by the others, weakest first."""
    while model:
        own = own_offers(grams, model)
        weakest = int(np.argmin([o.gain for o in own]))
        if significant(own[weakest], len(candidates)):
            return model
        model = drop(model, [model[weakest]])
    return model
