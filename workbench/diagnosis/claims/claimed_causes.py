"""Causes claimed by a diagnosis, with odds. Other accepted effects predict without naming a cause.

Effects of one kind in several joints are one cause. An accepted effect is a cause if

- it is physically possible, as its own file bounds it, and a coefficient exceeds three standard errors;
- it stands out: if one joint scatters and the others don't, something in that joint is not modelled, and an
  effect of the joint's own position or motion may be part of it;
- what it explains in cross-validation exceeds one standard error;
- this is at least a tenth of the residual and a third of the noise.

All others, and smooth errors of a joint without a physical name, form the *residual map*. The odds compare
the evidence with that of the best effect of another claim in the cause's place, or of none; an effect that
contains the cause as a special case and has more coefficients is no rival. One standard error of the log
odds, from leaving out fold after fold, is subtracted, so that they would hold for other rows of the same arm.
A cause preferred by every fold is at least probable; one that might be too small in other rows is no more.

However large the odds, a cause is only probable (of about 1 000 claims capped so on virtual arms
with incomplete files, nine in ten were true)

- if the residual is smooth along any axis by a third of what the cause explains, or a residual map of its
  joint predicts as much: another law may then explain the same, and rows that share an error
  carry less information than independent ones;
- if a rival that contains it as a special case does nearly as well despite having more coefficients;
- if, for an error over one joint's position, a smooth map is within the odds of "certain": friction and wear
  follow no simple law, and with few rows they resemble the nearest one;
- if another cause depends on the same joint's position (for a scale, also on its motion), or another backlash
  is decided by load: two laws together may stand for a single unknown one;
- if it is driven by load but doesn't stand out;
- if its driver is confounded with other differences between rows (`AbstractEffect.doubt`).

For prismatic joints of an arm without masses nothing is claimed, as tilting under load can't be tried; a
coupling is only probable there, as bearing loads depend on other joints' positions too. A certain cause names
only the joints whose coefficient exceeds four standard errors.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from jaxtyping import Float

from workbench.arm.effects import AbstractEffect, Candidate
from workbench.arm.effects.axes import turns
from workbench.arm.effects.joint_coupling import JointCoupling
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import law_sizes
from workbench.base.advice import beside
from workbench.diagnosis.claims.accepted_terms import best_of, distinct, includes, place_of
from workbench.diagnosis.claims.cause import Cause, largest_first, together
from workbench.diagnosis.claims.contributions import Explained, explained
from workbench.diagnosis.claims.named_joints import MIN_NAMED_ERRORS, clearness, sentence_of
from workbench.diagnosis.claims.position_laws import lead_over_map, share_a_law
from workbench.diagnosis.claims.random_walk import leads
from workbench.diagnosis.claims.reduced_models import validated_without
from workbench.diagnosis.claims.smooth_part import smooth_part
from workbench.diagnosis.claims.standard_errors import StandardErrors
from workbench.diagnosis.claims.structure import Structure
from workbench.diagnosis.claims.survival import Survival, survival
from workbench.diagnosis.confidence import CERTAIN, PROBABLE
from workbench.diagnosis.search.event_search import MIN_EVENT_SHARE
from workbench.diagnosis.search.evidence import (
    NONZERO_ERRORS,
    Model,
    drop,
    jackknifed,
    standard_error,
    validated,
)
from workbench.diagnosis.search.rounds import Searched
from workbench.diagnosis.search.stepwise_search import kind_of
from workbench.identification.joint_reading_noise import Readings, readings
from workbench.identification.problem import Noise

Sizes = dict[tuple[str, ...], list[float]]

MIN_SCATTER_RATIO = 10.0
"""Minimum ratio of a cause's largest motion to its joint's scatter, if that joint alone scatters."""
MIN_RESIDUAL_SHARE, MIN_NOISE_SHARE = 0.1, 1.0 / 3.0
"""Minimum shares of the residual and of the noise that a cause must explain."""
MAX_ODDS = 1e12
"""Odds are capped at this value."""
MAX_EXPLAINED_RATIO = 1.5
"""A cause that alone explains more than this multiple of what all effects explain is only probable:
linearisation errors of the geometry."""
MAX_SMOOTH_PART = 1.0 / 3.0
"""Maximum smooth part of the residual, or of a map of its joint, relative to what a certain cause
explains."""
UNTRIED = "without masses, tilting of the joint under load can't be tried"
UNTRIED_ACROSS = "without masses, compliance of bearings and links under load can't be tried"
NOT_ROBUST = "without a tenth of the rows, or with wider noise, another claim does nearly as well"
MAX_LOOK_ALIKES = 3
"""Maximum number of look-alikes listed."""


@beside("causes", ())
def find_causes(
    searched: Searched,
    arm: Robot,
    motion: Motion,
    known_noise: Noise | None,
    std: StandardErrors,
    structure: Structure | None,
    *,
    together_mm: float,
) -> tuple[Cause, ...]:
    """Causes among the accepted effects, largest contribution first.

    Args:
        searched: The last search, at the final fit.
        arm: The identified arm.
        motion: Of the fitted rows.
        known_noise: Noise known beforehand.
        std: Standard errors of its coefficients.
        structure: Of the residuals; None if it could not be tested.
        together_mm: What all effects together explain at the tool, rms over the fitted rows [mm].
    """
    judge = _Judge.of(searched, arm, motion, known_noise, std, structure, together_mm)
    terms = _terms(searched, arm)
    named = [one for one in terms if judge.is_named(one)]
    nameless = np.zeros(arm.dof)
    for one in terms:
        if one not in named:
            nameless[one.moved] = np.hypot(nameless[one.moved], one.size)
    at_the_tool = explained(searched, [one.group for one in named])
    causes = (
        judge.cause(one, at_tool, others=[o.whole for o in named if o is not one], nameless=nameless)
        for one, at_tool in zip(named, at_the_tool, strict=True)
    )
    return largest_first(*causes)


@dataclass(frozen=True, eq=False)
class _Terms:
    """The terms of one claim.

    Args:
        group: In the model.
        effects: Theirs, as identified.
        fall: What they explain in cross-validation, whitened squares by fold.
        size: Its root mean square over all components.
    """

    group: Model
    effects: tuple[AbstractEffect, ...]
    fall: Float[np.ndarray, " folds"]
    size: float

    @cached_property
    def whole(self) -> AbstractEffect:
        """Their effects as one."""
        return together(self.effects)

    @property
    def moved(self) -> list[int]:
        """Joints of the effects, counted from 0."""
        return sorted({j for e in self.effects for j in e.joints})


def _terms(searched: Searched, arm: Robot) -> list[_Terms]:
    """The model's terms by claim."""
    grams, model = searched.grams, searched.found.model
    sized, groups = {e.names: e for e in arm.effects}, _groups(model)
    falls = validated_without(grams, model, groups) - validated(grams, model)
    sizes = np.sqrt(np.maximum(falls.sum(1), 0.0) / grams.count).tolist()
    effects = [tuple(sized[t.candidate.names] for t in group) for group in groups]
    return [_Terms(*each) for each in zip(groups, effects, falls, sizes, strict=True)]


@dataclass(frozen=True, eq=False)
class _Judge:
    """Decides what is claimed of terms; fields without a note are those of `find_causes`.

    Args:
        scatter: Of joint readings; None if they seem exact.
        minimum: Size from which terms are a cause.
        smooth: Smooth part of the residual.
        maximum: Largest motions by the terms.
        steady: Log odds of events against a random walk.
    """

    searched: Searched
    arm: Robot
    motion: Motion
    std: StandardErrors
    structure: Structure | None
    together_mm: float
    scatter: Readings | None
    minimum: float
    smooth: float
    maximum: Sizes
    steady: Mapping[tuple[str, ...], float]

    @classmethod
    def of(
        cls,
        searched: Searched,
        arm: Robot,
        motion: Motion,
        known_noise: Noise | None,
        std: StandardErrors,
        structure: Structure | None,
        together_mm: float,
    ) -> "_Judge":
        """With what holds for all terms."""
        geometric, fit = searched.stage.geometric_problem, searched.stage.fit
        left = float(np.sqrt(validated(searched.grams, searched.found.model).sum() / searched.grams.count))
        noise = _noise(left, geometric.typical_noise, known_noise)
        return cls(
            searched,
            arm,
            motion,
            std,
            structure,
            together_mm,
            scatter=readings(geometric),
            minimum=max(MIN_NOISE_SHARE * noise, MIN_RESIDUAL_SHARE * left),
            smooth=smooth_part(fit, geometric.noise, structure or Structure()),
            maximum=_largest_loads(arm, motion),
            steady=leads(searched),
        )

    def is_named(self, terms: _Terms) -> bool:
        """Whether terms are a cause; events always are, as they determine which arm is saved."""
        first = terms.group[0].candidate
        if first.effect.is_event:
            return True
        coefficients = [(n, c) for e in terms.effects for n, c in zip(e.names, e.coefficients, strict=True)]
        return not (
            first.effect.is_nameless
            or (first.shrunk and first.effect.maps_joint)
            or terms.size < self.minimum
            or terms.fall.mean() <= standard_error(terms.fall)
            or all(abs(c) < NONZERO_ERRORS * self.std[n] for n, c in coefficients)
            or any(not e.loads for e in self._masked(terms))
        )

    def cause(
        self,
        terms: _Terms,
        at_tool: Explained,
        *,
        others: Sequence[AbstractEffect],
        nameless: Float[np.ndarray, " n"],
    ) -> Cause:
        """Named terms as a cause.

        Args:
            terms: The terms.
            at_tool: What they explain at the tool.
            others: The other causes' effects.
            nameless: Size of each joint's terms without a name.
        """
        odds, rivals, survive = _against_rivals(self.searched, terms.group)
        odds = min(odds, _odds(self.steady.get(terms.group[0].candidate.names, np.inf)))
        clear = clearness(terms.effects, self.std)
        unclear = [j for j, z in clear.items() if z < MIN_NAMED_ERRORS]
        untried = _untried(terms.whole, self.arm)
        reason = untried or self._doubt(terms, others, nameless, is_clear=len(unclear) < len(clear))
        if untried == UNTRIED:
            odds = min(odds, 1.0)
        if not reason and odds >= CERTAIN:
            kept = survive()
            unclear = [j for j in clear if j in {*unclear, *kept.lost}]
            if not kept.holds or len(unclear) == len(clear):
                reason = NOT_ROBUST
        if reason:
            odds = min(odds, PROBABLE)
        unsure = tuple(j for j in unclear if odds >= CERTAIN and j is not None)
        is_strained, mm = self._is_strained(terms), at_tool.position_mm
        return Cause(
            effects=terms.effects,
            odds=odds,
            contribution_mm=min(mm, self.together_mm) if is_strained else mm,
            contribution_deg=at_tool.orientation_deg,
            text=sentence_of(terms.whole, unsure, self.std, self.arm, self.motion),
            look_alikes=rivals,
            unsure=unsure,
            doubt=reason,
        )

    def _doubt(
        self,
        terms: _Terms,
        others: Sequence[AbstractEffect],
        nameless: Float[np.ndarray, " n"],
        *,
        is_clear: bool,
    ) -> str:
        """Why terms can't be a certain cause, as a clause; empty if they can."""
        whole, size, fall = terms.whole, terms.size, terms.fall
        mapped = 0.0 if whole.is_event else float(nameless[list(whole.joints)].max(initial=0.0))
        sure = fall.mean() - standard_error(fall)
        lead = lead_over_map(self.searched, terms.group)
        doubts = {
            whole.doubt(self.motion) or "": True,
            "the residuals could not be tested for structure": self.structure is None,
            "it alone explains more than all effects together, as errors of the geometry do": (
                self._is_strained(terms)
            ),
            "another cause has the same form": any(share_a_law(whole, other) for other in others),
            "a smooth error of its joint would do nearly as well": lead < np.log(CERTAIN),
            "its joint scatters as much": bool(self._masked(terms)),
            "it explains little that is sure beyond the noise": (
                sure < self.minimum**2 * self.searched.grams.count / len(fall)
            ),
            "what remains may follow another law": self.smooth > MAX_SMOOTH_PART * size,
            "a residual map of its joint explains more than a third as much": mapped > MAX_SMOOTH_PART * size,
            f"no size of it exceeds {MIN_NAMED_ERRORS:.0f} standard errors": not is_clear,
        }
        return next((text for text, holds in doubts.items() if text and holds), "")

    def _is_strained(self, terms: _Terms) -> bool:
        """Whether terms alone explain more than all effects together."""
        sigma = self.searched.stage.geometric_problem.typical_noise.position
        return 1e3 * float(np.sqrt(3.0)) * sigma * terms.size > MAX_EXPLAINED_RATIO * self.together_mm

    def _masked(self, terms: _Terms) -> list[AbstractEffect]:
        return _masked_by_scatter(terms.effects, self.maximum, self.scatter)


def _untried(whole: AbstractEffect, arm: Robot) -> str | None:
    """What could not be tried in its place, because masses are missing."""
    if arm.has_masses or whole.is_event:
        return None
    if not all(turns(arm.chain, j) for j in whole.joints):
        return UNTRIED
    return UNTRIED_ACROSS if isinstance(whole, JointCoupling) else None


def _noise(left: float, weighing: Noise, known_noise: Noise | None) -> float:
    """Standard deviation of a whitened component due to noise, at most that of the residual."""
    if known_noise is None:
        return left
    ratios = np.array(known_noise[:2]) / np.array(weighing[:2])
    return min(left, float(np.nanmin(ratios))) if np.isfinite(ratios).any() else left


def odds_of_events(searched: Searched) -> dict[Candidate, float]:
    """Odds of every event in the model; 0 if it explains too little or may be an effect of posture."""
    grams, model = searched.grams, searched.found.model
    motion = Motion.of(searched.stage.problem.data)
    events = [t for t in model if t.candidate.effect.is_event]
    after, steady = validated(grams, model).sum() if events else 0.0, leads(searched)
    out = {}
    for term in events:
        odds, names = 0.0, term.candidate.names
        is_material = validated(grams, drop(model, [term])).sum() >= (1.0 + MIN_EVENT_SHARE) * after
        if is_material and term.candidate.effect.doubt(motion) is None:
            odds = min(_against_rivals(searched, (term,))[0], _odds(steady.get(names, np.inf)))
        out[term.candidate] = odds
    return out


def _odds(lead: float) -> float:
    """Odds from their logarithm, capped."""
    return float(np.exp(np.clip(lead, 0.0, np.log(MAX_ODDS))))


def _groups(model: Model) -> list[Model]:
    """Terms of one claim: those of one kind in several joints, every other term alone."""
    out: dict[object, Model] = {}
    for k, term in enumerate(model):
        key: object = kind_of(term) if term.candidate.effect.of_many_joints else k
        out[key] = (*out.get(key, ()), term)
    return list(out.values())


def _masked_by_scatter(
    effects: Sequence[AbstractEffect], maximum: Sizes, scatter: Readings | None
) -> list[AbstractEffect]:
    """Terms that don't stand out from the scatter of a joint that scatters alone."""
    if scatter is None:
        return []

    def is_masked(effect: AbstractEffect) -> bool:
        joints = effect.joints if effect.of_many_joints else effect.joints[:1]
        sizes = np.reshape(maximum[effect.names], (len(joints), -1)).max(1) if joints else ()
        return any(
            joint in scatter.joints_that_scatter and size < MIN_SCATTER_RATIO * scatter.sigma[joint]
            for joint, size in zip(joints, sizes, strict=True)
        )

    return [e for e in effects if not e.is_event and is_masked(e)]


def _largest_loads(arm: Robot, motion: Motion) -> Sizes:
    """Maximum motion of an element per coefficient over the rows [rad or m]."""
    sizes = law_sizes(arm, motion, [n for e in arm.effects for n in e.names])
    return {
        e.names: [sizes[n] * abs(c) for n, c in zip(e.names, e.coefficients, strict=True)]
        for e in arm.effects
    }


def _against_rivals(
    searched: Searched, group: Model
) -> tuple[float, tuple[AbstractEffect, ...], Callable[[], Survival]]:
    """Odds of some terms against the best other claim, the claims that are indistinguishable from them, and
    how the odds change under varied assumptions."""
    whole = place_of(searched, group)
    parts = [place_of(replace(searched, grams=g), group) for g in searched.grams.without_each]
    near = {
        id(o.term.candidate): o
        for place in (whole, *parts)
        for o in place.offers
        if place.own - o.gain < np.log(CERTAIN)
    }
    including = {key for key, o in near.items() if includes(whole.left, o, group)}
    rivals, *others = (
        [o for o in place.offers if id(o.term.candidate) not in including] for place in (whole, *parts)
    )
    best = best_of(rivals)
    leads = [place.own - best_of(found) for place, found in zip(parts, others, strict=True)]
    lead = whole.own - best
    leads = leads or [lead]
    stated, surviving = np.exp(np.clip([lead, lead - jackknifed(leads)], 0.0, np.log(MAX_ODDS))).tolist()
    odds = min(stated, max(surviving, PROBABLE if min(leads) > 0.0 else 1.0))
    if any(o.gain > whole.own - np.log(PROBABLE) for o in whole.offers if id(o.term.candidate) in including):
        odds = min(odds, PROBABLE)
    close = distinct([o for o in rivals if best - o.gain < np.log(PROBABLE / odds)])
    survive = partial(survival, searched, group, rivals, including, minimum=float(np.log(PROBABLE)))
    return odds, tuple(o.term.candidate.effect for o in close[:MAX_LOOK_ALIKES]), survive
