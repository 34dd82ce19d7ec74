"""Causes claimed by a diagnosis, with odds. Other accepted effects predict without naming a cause.

Effects of one kind in several joints are one cause. An accepted effect is a cause if

- it is physically possible, as its own file bounds it, and a coefficient exceeds three standard errors;
- it explains at least a tenth of the residual and a third of the noise in most folds of cross-validation.

All others, and smooth errors of a joint without a physical name, form the *residual map*. The odds compare
the evidence with that of the best effect of another claim in the cause's place, or of none; an effect that
contains the cause and has more coefficients is no rival. One standard error of the log odds, from leaving out
fold after fold, is subtracted; a cause preferred by every fold is at least probable. Of one in several joints
nobody can tell where each is replaceable (`accepted_terms.py`).

A law must also win against smooth dependence without a law, on any driver and through any elements
(`diagnosis/drivers/evidence.py`). Where it does not, nobody can tell what the cause is. A cause whose driver
is confounded with other differences between rows (`AbstractEffect.doubt`) is at most probable; so is an event
of the first or last joint, which is the same motion as one of the frame or of the tool.

For prismatic joints of an arm without masses nothing is claimed, as tilting under load can't be tried; a
coupling is only probable there, as bearing loads depend on other joints' positions too. A certain cause names
only the joints whose coefficient exceeds four standard errors.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from workbench.arm.effects import AbstractEffect, Candidate
from workbench.arm.effects.axes import turns
from workbench.arm.effects.events import AbstractEvent
from workbench.arm.effects.joint_coupling import JointCoupling
from workbench.arm.effects.link_flexure import LinkFlexure
from workbench.arm.effects.tilting import AbstractTilting, BearingCompliance
from workbench.arm.robot import Robot
from workbench.base.advice import beside
from workbench.diagnosis.claims.accepted_terms import distinct, includes, place_of, replaceable_joints
from workbench.diagnosis.claims.cause import MIN_NOISE_SHARE, Cause, largest_first, together
from workbench.diagnosis.claims.standard_errors import (
    MIN_NAMED_ERRORS,
    StandardErrors,
    clearness,
    sentence_of,
)
from workbench.diagnosis.confidence import CERTAIN, MAX_ODDS, PROBABLE
from workbench.diagnosis.drivers.driver import Driver, driver_of
from workbench.diagnosis.drivers.evidence import Challenge, DriverEvidence
from workbench.diagnosis.search.contributions import remaining
from workbench.diagnosis.search.event_search import MIN_EVENT_SHARE
from workbench.diagnosis.search.evidence import (
    NONZERO_ERRORS,
    Model,
    drop,
    is_nameless,
    jackknifed,
    validated,
)
from workbench.diagnosis.search.rounds import Searched
from workbench.diagnosis.search.stepwise_search import by_claim
from workbench.identification.problem import Noise

MIN_RESIDUAL_SHARE = 0.1
"""Minimum share of the residual that a cause must explain."""
MAX_CAUSES = 6
"""Maximum number of causes."""
UNTRIED = "without masses, what else gives way under load can't be tried"
NO_JOINT = "in the place of each of its joints another claim does nearly as well"
UNCLEAR = "its size is less than four standard errors"
LINK_TILTS = "a next link that gives way alike about both axes would give the same rows: check both"
FIRST_ROWS = "only the first rows tell of it"
MAX_LOOK_ALIKES = 3
"""Maximum number of look-alikes listed."""


@beside("causes", ())
def find_causes(
    searched: Searched, arm: Robot, known_noise: Noise | None, std: StandardErrors, drivers: DriverEvidence
) -> tuple[Cause, ...]:
    """Causes among the accepted effects of the last search, as identified, largest contribution first."""
    judge = _Judge(searched, arm, known_noise, std)
    named = [one for one in _terms(searched, arm) if judge.is_named(one)]
    groups = [one.group for one in named]
    left = remaining(searched, [searched.model, *(drop(searched.model, g) for g in groups)])
    sizes = np.sqrt(np.maximum(left[1:] ** 2 - left[0] ** 2, 0.0)).tolist()
    parts = zip(named, sizes, drivers.challenges(groups), strict=True)
    return largest_first(*(judge.cause(*part) for part in parts))


def undecided(drivers: DriverEvidence) -> Model:
    """Laws of a model, other than events, that can't be told from other claims or from what has no law."""
    last = drivers.searched
    groups = [g for g in by_claim(last.model) if not (is_nameless(g[0]) or g[0].candidate.effect.is_event)]
    challenged = zip(groups, drivers.challenges(groups), strict=True)
    is_open = (c.cap < PROBABLE or _against_rivals(last, g)[0] < PROBABLE for g, c in challenged)
    return tuple(t for g, each in zip(groups, is_open, strict=True) if each for t in g)


@dataclass(frozen=True, eq=False)
class _Terms:
    """The terms of one claim.

    Args:
        group: In the model.
        effects: Theirs, as identified.
        size: What they explain of most folds in cross-validation, root mean square of a whitened component.
    """

    group: Model
    effects: tuple[AbstractEffect, ...]
    size: float

    @cached_property
    def whole(self) -> AbstractEffect:
        """Their effects as one."""
        return together(self.effects)


def _terms(searched: Searched, arm: Robot) -> list[_Terms]:
    """The model's terms by claim."""
    grams, model = searched.grams, searched.model
    sized, groups = {e.names: e for e in arm.effects}, by_claim(model)
    falls = np.array([validated(grams, drop(model, g)) for g in groups]) - validated(grams, model)
    middle = np.median(falls, axis=1)  # a linear fit to the others may fail for one fold
    sizes = np.sqrt(np.maximum(falls.shape[1] * middle, 0.0) / grams.count).tolist()
    effects = [tuple(sized[t.candidate.names] for t in group) for group in groups]
    return [_Terms(*each) for each in zip(groups, effects, sizes, strict=True)]


@dataclass(frozen=True, eq=False)
class _Judge:
    """Decides what is claimed of terms; its fields are those of `find_causes`."""

    searched: Searched
    arm: Robot
    known_noise: Noise | None
    std: StandardErrors

    @cached_property
    def minimum(self) -> float:
        """Size from which terms are a cause."""
        grams, weighing = self.searched.grams, self.searched.stage.geometric_problem.typical_noise
        left = float(np.sqrt(validated(grams, self.searched.model).sum() / grams.count))
        known = np.divide((self.known_noise or (np.inf, np.inf))[:2], weighing[:2])
        return max(MIN_NOISE_SHARE * float(np.fmin.reduce([left, *known])), MIN_RESIDUAL_SHARE * left)

    def is_named(self, terms: _Terms) -> bool:
        """Whether terms are a cause; events always are, as they determine which arm is saved."""
        first = terms.group[0].candidate
        if first.effect.is_event:
            return True
        coefficients = [(n, c) for e in terms.effects for n, c in zip(e.names, e.coefficients, strict=True)]
        return not (
            is_nameless(terms.group[0])
            or terms.size <= self.minimum
            or all(abs(c) < NONZERO_ERRORS * self.std[n] for n, c in coefficients)
        )

    def cause(self, terms: _Terms, at_tool: Sequence[float], challenge: Challenge) -> Cause:
        """Named terms as a cause that explains so much at the tool [mm, deg]."""
        odds, rivals = _against_rivals(self.searched, terms.group)
        odds, motion = min(odds, challenge.cap), self.searched.stage.motion
        clear = clearness(terms.effects, self.std)
        unclear = [j for j, z in clear.items() if z < MIN_NAMED_ERRORS]
        is_blind = not (self.arm.has_masses or terms.whole.is_event)
        slides = is_blind and not all(turns(self.arm.chain, j) for j in terms.whole.joints)
        untried = UNTRIED * (slides or (is_blind and isinstance(terms.whole, JointCoupling)))
        doubt, twin = challenge.doubt, self._twin(terms.whole)
        links = tuple(c for c in terms.whole.coefficients for _ in range(2))  # the same rows, always
        even = [LinkFlexure(terms.whole.joints, links)] * isinstance(terms.whole, BearingCompliance)
        doubt = twin or doubt if doubt and challenge.cap > 1.0 else doubt
        reason = untried or doubt or terms.whole.doubt(motion) or twin
        odds = min(odds, 1.0) if slides else odds
        if odds >= CERTAIN and len(unclear) == len(clear):
            reason = reason or UNCLEAR
        if len(clear) > 1 and odds >= PROBABLE and self._replaceable(terms.group).issuperset(clear):
            odds, reason = 1.0, reason or NO_JOINT
        if reason:
            odds = min(odds, PROBABLE)
        unsure = tuple(j for j in unclear if odds >= CERTAIN and j is not None)
        return Cause(
            effects=terms.effects,
            odds=odds,
            contribution_mm=at_tool[0],
            contribution_deg=at_tool[1],
            text=sentence_of(terms.whole, unsure, self.std, self.arm, motion),
            look_alikes=(*rivals, *even),
            unsure=unsure,
            doubt=reason or "",
            driver=challenge.driver,
            is_law=challenge.cap > 1.0,
        )

    def _replaceable(self, group: Model) -> set[int]:
        """Joints in whose place another claim does nearly as well, with all rows or without a fold."""
        parts = (self.searched, *(replace(self.searched, grams=g) for g in self.searched.grams.without_each))
        return {j for part in parts for j in replaceable_joints(part, group, float(np.log(PROBABLE)))}

    def _twin(self, whole: AbstractEffect) -> str:
        """What would give the same rows, or nearly, as a clause."""
        if isinstance(whole, AbstractTilting):
            return LINK_TILTS
        if not isinstance(whole, AbstractEvent):
            return ""
        return whole.twin(self.arm.dof) or FIRST_ROWS * (not whole.is_step)


def odds_over_time(searched: Searched) -> dict[Candidate, float]:
    """Odds of every event, drift and growth in the model against what follows the time without a law.

    An event has none if it explains too little or may be an effect of posture. Others that lose say nothing
    about later.
    """
    grams, model = searched.grams, searched.model
    drivers = Driver.TIME, Driver.TEMPERATURE
    terms = [t for t in model if driver_of(t.candidate.effect) in drivers]
    if not terms:
        return {}
    after, out = validated(grams, model).sum(), {}
    evidence = DriverEvidence.of(searched, searched.stage.data, drivers)
    for term, challenge in zip(terms, evidence.challenges([(t,) for t in terms]), strict=True):
        effect, odds = term.candidate.effect, challenge.cap
        if effect.is_event:
            is_material = validated(grams, drop(model, [term])).sum() >= (1.0 + MIN_EVENT_SHARE) * after
            is_sure = is_material and effect.doubt(searched.stage.motion) is None
            by_temperature = {f.driver for f in challenge.rivals} == {Driver.TEMPERATURE}  # which tells when
            if challenge.lead + by_temperature * np.log(term.candidate.tries) > 0.0:  # kept, if not claimed
                odds = max(odds, PROBABLE)
            odds = min(odds, _against_rivals(searched, (term,))[0]) if is_sure else 0.0
        out[term.candidate] = odds
    return out


def _against_rivals(searched: Searched, group: Model) -> tuple[float, tuple[AbstractEffect, ...]]:
    """Odds of some terms against the best other claim, and those that are indistinguishable from them."""
    whole = place_of(searched, group)
    every = [whole, *(place_of(replace(searched, grams=g), group) for g in searched.grams.without_each)]
    offered = ((place.own - o.gain, o) for place in every for o in place.offers)
    near = {id(o.term.candidate): o for ahead, o in offered if ahead < np.log(CERTAIN)}
    including = {key for key, o in near.items() if includes(whole.left, o, group)}
    rivals, *others = ([o for o in p.offers if id(o.term.candidate) not in including] for p in every)
    best = (max([0.0, *(o.gain for o in some)]) for some in (rivals, *others))
    lead, *leads = (place.own - gain for place, gain in zip(every, best, strict=True))
    least = np.clip([lead, lead - jackknifed(leads or [lead])], 0.0, np.log(MAX_ODDS))
    stated, surviving = np.exp(least).tolist()
    odds = min(stated, max(surviving, PROBABLE if min(leads, default=lead) > 0.0 else 1.0))
    close = distinct([o for o in rivals if whole.own - lead - o.gain < np.log(PROBABLE / odds)])
    return odds, tuple(o.term.candidate.effect for o in close[:MAX_LOOK_ALIKES])
