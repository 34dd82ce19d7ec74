"""Candidates for an arm: everything the registered effects offer for its joints and the rows.

Candidates that can't be tried are reported with the reason.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from workbench.arm.effects import EFFECTS, AbstractEffect, Candidate
from workbench.arm.effects.effect import moved_joints
from workbench.arm.effects.gravity_sag import GravitySag
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import law_sizes
from workbench.diagnosis.search.candidate_columns import known_wrenches
from workbench.parts import warn_of_broken

MIN_DRIVEN_SHARE = 0.01
"""Share of the largest joint's law below which a joint counts as not driven."""
ONLY_LOADS = (
    "the poses are too few, or vary in too few directions of joint space, to separate other effects from "
    "geometry: only effects of the load, which changes at the same postures, were tried"
)


@dataclass(frozen=True, eq=False)
class Catalogue:
    """Candidates to try.

    Args:
        candidates: Effects with zero coefficients.
        notes: Candidates that can't be tried, and why, one sentence each.
    """

    candidates: tuple[Candidate, ...]
    notes: tuple[str, ...]

    @property
    def of_loads(self) -> "Catalogue":
        """Those that a load drives."""
        driven = tuple(c for c in self.candidates if c.effect.loads or isinstance(c.effect, GravitySag))
        return replace(self, candidates=driven, notes=(ONLY_LOADS, *self.notes))


def catalogue(robot: Robot, motion: Motion) -> Catalogue:
    """All candidates that some rows could show.

    Args:
        robot: The arm; effects that it already has are not offered again.
    """
    offers = [offer for kind in EFFECTS.values() for offer in _offers(kind, robot, motion)]
    found = (offer for offer in offers if isinstance(offer, Candidate))
    own = set(robot.coefficients)
    sized = (_alike(c, robot, motion) if c.alike else c for c in found if not own & set(c.names))
    kept = [c for c in sized if c is not None and c.effect.mistake(robot.chain) is None]
    if any(c.effect.has_play and c.effect.loads for c in kept):
        loads = known_wrenches(robot, motion)
        kept = [replace(c, effect=c.effect.softened(robot.chain, loads)) for c in kept]
    notes = [*_still(motion), *(offer for offer in offers if isinstance(offer, str))]
    return Catalogue(tuple(kept), tuple(dict.fromkeys(notes)))


def _offers(kind: type[AbstractEffect], robot: Robot, motion: Motion) -> list[Candidate | str]:
    """What a kind of effect offers; nothing if another package's raises, and a warning names it."""
    if kind.__module__.startswith("workbench."):
        return list(kind.offers(robot, motion))
    try:
        offers = list(kind.offers(robot, motion))
        for offer in offers:
            if isinstance(offer, Candidate):
                law_sizes(robot.with_effects(offer.effect), motion, offer.effect.names)
    except Exception as error:  # whatever is wrong with somebody else's package
        warn_of_broken(f"the effect {kind.__name__}", error)
        return []
    return offers


def _alike(candidate: Candidate, robot: Robot, motion: Motion) -> Candidate | None:
    """An effect of all driven joints, scaled so that their expected motions are about equal."""
    effect = candidate.effect
    sizes = law_sizes(robot.with_effects(effect), motion, effect.names)
    largest = max(sizes.values())
    both = zip(effect.joints, effect.names, strict=True)
    driven = tuple(joint for joint, name in both if sizes[name] > MIN_DRIVEN_SHARE * largest)
    if len(driven) < 2:
        return None
    fewer = replace(effect, joints=driven, coefficients=())
    return Candidate(fewer, np.diag([sizes[n] ** -2.0 for n in fewer.names]), alike=True)


def _still(motion: Motion) -> Iterator[str]:
    """Notes on joints that move too little for errors over their position, and on a payload that stays."""
    for joint in sorted(set(range(motion.q.shape[1])) - set(moved_joints(motion))):
        yield f"joint {joint + 1} hardly moved, so errors that depend on its position were not tried"
    if motion.payload is not None and len(motion) and np.ptp(motion.payload) == 0.0:
        yield "the payload is the same in all rows, so it can't be separated from the arm's own weight"
