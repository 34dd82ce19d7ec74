"""Errors over a joint's position: named laws compared with a smooth map without a name.

Friction, deflection and wear follow no simple law, and with few rows they resemble the nearest one.
"""

import numpy as np

from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.encoder_scale import EncoderScale
from workbench.diagnosis.claims.reduced_models import left_without
from workbench.diagnosis.search.evidence import Model, jackknifed, offers
from workbench.diagnosis.search.gram_matrices import Grams
from workbench.diagnosis.search.rounds import Searched
from workbench.diagnosis.search.stepwise_search import group_evidence


def lead_over_map(searched: Searched, group: Model) -> float:
    """Log odds of all named laws of one joint's position together against a smooth map, less one standard
    error; infinite for other effects, minus infinite if no map can be tried, as with few rows or
    positions.

    The handicap by which a search prefers laws to maps is not applied.
    """
    joints = group[0].candidate.effect.joints
    mine = tuple(
        t
        for t in searched.found.model
        if _is_of_position(t.candidate.effect) and t.candidate.effect.joints == joints
    )
    maps = [
        c
        for c in searched.offered.candidates
        if c.shrunk and c.effect.maps_joint and c.effect.joints == joints
    ]
    if not set(mine).issuperset(group):
        return np.inf
    if not maps:
        return -np.inf

    def lead(grams: Grams) -> float:
        left = left_without(grams, searched.found.model, mine)
        gains = [o.gain + o.term.candidate.effect.handicap for o in offers(left, maps)]
        return group_evidence(left, mine) - max(gains, default=0.0)

    whole = lead(searched.grams)
    parts = [lead(grams) for grams in searched.grams.without_each] or [whole]  # none of a single fold
    return whole - jackknifed(parts)


def _is_of_position(effect: AbstractEffect) -> bool:
    return effect.maps_joint or isinstance(effect, EncoderScale)


def share_a_law(one: AbstractEffect, other: AbstractEffect) -> bool:
    """Whether both are errors over one joint's position, one of them a scale and the other backlash by the
    joint's motion, which is correlated with its position; or both are load-dependent backlash."""
    both = (one, other)
    has_scale = any(isinstance(e, EncoderScale) for e in both)
    if all(_is_of_position(e) or (has_scale and e.has_play and not e.loads) for e in both):
        return bool(set(one.joints) & set(other.joints))
    return one.name != other.name and all(e.has_play and bool(e.loads) for e in both)
