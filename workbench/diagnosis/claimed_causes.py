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

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from workbench.arm.effects import AbstractEffect, Candidate
from workbench.arm.effects.axes import turns
from workbench.arm.effects.events import AbstractEvent
from workbench.arm.effects.joint_coupling import JointCoupling
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import law_sizes
from workbench.base.wording import joint_list
from workbench.diagnosis.confidence import CERTAIN, PROBABLE, Confidence
from workbench.diagnosis.event_search import PART
from workbench.diagnosis.evidence import NONZERO_FROM, Model, drop, jackknifed, standard_error, validated
from workbench.diagnosis.explained import explained
from workbench.diagnosis.named_joints import CLEAR, clearness, sentence_of, without_joints
from workbench.diagnosis.one_less import validated_without
from workbench.diagnosis.places import best_of, distinct, includes, place_of
from workbench.diagnosis.position_laws import lead_over_map, share_a_law
from workbench.diagnosis.rounds import Searched
from workbench.diagnosis.smooth_part import smooth_part
from workbench.diagnosis.standard_errors import StandardErrors
from workbench.diagnosis.stepwise_search import kind_of
from workbench.diagnosis.structure import Structure
from workbench.diagnosis.survival import Survival, survival
from workbench.diagnosis.wandering import leads
from workbench.identification.joint_reading_noise import Readings, readings
from workbench.identification.problem import Noise
from workbench.identification.row_errors import Errors

Sizes = dict[tuple[str, ...], list[float]]

STANDS_OUT = 10.0
"""Minimum ratio of a cause's largest motion to its joint's scatter, if that joint alone scatters."""
PART_OF_REST, PART_OF_NOISE = 0.1, 1.0 / 3.0
"""Minimum shares of the residual and of the noise that a cause must explain."""
MAX_ODDS = 1e12
"""Odds are capped at this value."""
STRAINED = 1.5
"""A cause that alone explains more than this multiple of what all effects explain is only probable:
linearisation errors of the geometry."""
SMOOTH = 1.0 / 3.0
"""Maximum smooth part of the residual, or of a map of its joint, relative to what a certain cause
explains."""
UNTRIED = "without masses, tilting of the joint under load can't be tried"
UNTRIED_ACROSS = "without masses, compliance of bearings and links under load can't be tried"
NOT_ROBUST = "without a tenth of the rows, or with wider noise, another claim does nearly as well"
LOOK_ALIKES = 3
"""Maximum number of look-alikes listed."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Cause:
    """A physical cause of what the geometry leaves.

    Args:
        effects: Its effects in the saved model.
        odds: Against the best other claim.
        contribution_mm: What it explains at the tool (`explained.py`) [mm]; NaN where no positions were
            measured.
        text: Description for people.
        look_alikes: Claims that these rows can't distinguish from it, best first.
        unsure: Joints of its effects that are not named, counted from 0.
        doubt: Why it can't be certain, as a clause; empty if it can.
        contribution_deg: What it explains of orientations [deg]; NaN where none were measured.
    """

    effects: tuple[AbstractEffect, ...]
    odds: float
    contribution_mm: float
    text: str
    look_alikes: tuple[AbstractEffect, ...]
    unsure: tuple[int, ...] = ()
    doubt: str = ""
    contribution_deg: float = float("nan")

    @property
    def claim(self) -> str:
        """Its description, or those of its look-alikes."""
        return f"{self.text}; or {_listed(self.look_alikes)}" if self.look_alikes else self.text

    @property
    def stated(self) -> str:
        """Its claim with its confidence."""
        if self.look_alikes:
            return f"{self.claim} ({self.confidence})"
        first, *rest = self.text.split("; ", 1)
        return "; ".join([f"{first} ({self.confidence})", *rest])

    @property
    def sentence(self) -> str:
        """Its claim, and why it isn't certain."""
        return f"{self.claim}; {self.doubt}" if self.doubt else self.claim

    @property
    def kind(self) -> str:
        """Name of its effect."""
        return str(self.whole.name)

    @property
    def joints(self) -> tuple[int, ...]:
        """Counted from 0; empty where it concerns the whole arm."""
        return self.whole.joints

    @property
    def event(self) -> AbstractEvent | None:
        """The event, if the cause is one."""
        return self.whole if isinstance(self.whole, AbstractEvent) else None

    @property
    def row(self) -> int | None:
        """The first row after an event, as counted in the file; None for other causes."""
        return None if self.event is None else self.event.row

    @property
    def confidence(self) -> Confidence:
        return Confidence.of(self.odds)

    @property
    def label(self) -> str:
        """Short, for tables: `joint-compliance, joints 2, 3`."""
        return self.whole.label

    @property
    def plain(self) -> str:
        """In a technician's words: `joints 2 and 3 give under load`."""
        return self.whole.plain

    @cached_property
    def whole(self) -> AbstractEffect:
        """Its effects as one, for the joints that it names."""
        return without_joints(together(self.effects), self.unsure)


@dataclass(frozen=True, eq=False, kw_only=True)
class ResidualMap:
    """The part of the saved model that predicts without claiming a cause.

    Args:
        effects: Smooth errors of joints, and effects too small to be causes.
        before: Held-out errors without them: of the geometry, with the causes if these alone predict better.
        after: Held-out errors with them.
        beside_causes: Whether `before` includes the causes.
    """

    effects: tuple[AbstractEffect, ...]
    before: Errors
    after: Errors
    beside_causes: bool

    @property
    def joints(self) -> tuple[int, ...]:
        return tuple(sorted({j for e in self.effects for j in e.joints}))

    @property
    def is_better(self) -> bool:
        """Whether the rows that judge it agree that it predicts."""
        return not self.after.position_mm.mean >= self.before.position_mm.mean

    @property
    def claim(self) -> str:
        """Statement that it names no cause."""
        where = f" of {joint_list(self.joints)}" if self.joints else ""
        return (
            f"A residual map{where} {'predicts' if self.is_better else 'fits'} the rest, but names no cause"
        )

    @property
    def sentence(self) -> str:
        where = f" of {joint_list(self.joints)}" if self.joints else ""
        without = " with the causes alone" if self.beside_causes else ""
        before, after = (e.text("mean") for e in (self.before, self.after))
        if not self.is_better:
            return (
                f"A residual map{where} was fitted, but the rows that judge it are no better for it: "
                f"{before}{without}, {after} with the map"
            )
        return (
            f"A residual map{where}, which predicts but names no cause, takes the error from "
            f"{before}{without} to {after}"
        )


def together(effects: Sequence[AbstractEffect]) -> AbstractEffect:
    """Effects of one kind, merged into one of all their joints."""
    first, *others = sorted(effects, key=lambda e: e.joints)
    if not others:
        return first
    joints = tuple(j for e in (first, *others) for j in e.joints)
    sizes = tuple(c for e in (first, *others) for c in e.coefficients)
    order = np.argsort(joints)
    return replace(first, joints=tuple(joints[i] for i in order), coefficients=tuple(sizes[i] for i in order))


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
        known_noise: Noise known beforehand.
        std: Standard errors of its coefficients.
        structure: Of the residuals; None if it could not be tested.
        together_mm: What all effects together explain at the tool, rms over the fitted rows [mm].
    """
    sized = {e.names: e for e in arm.effects}
    weighing = searched.stage.geometric.typical_noise
    scatter = readings(searched.stage.geometric)
    smooth = smooth_part(searched.stage.fitted.fit, searched.stage.geometric.noise, structure or Structure())
    maximum = _largest_loads(arm, motion)
    after = validated(searched.grams, searched.found.model)
    count = searched.grams.count
    left = float(np.sqrt(after.sum() / count))
    minimum = max(PART_OF_NOISE * _noise(left, weighing, known_noise), PART_OF_REST * left)
    found, steady = [], leads(searched)
    claimed: list[tuple[Model, tuple[AbstractEffect, ...], np.ndarray, float]] = []
    nameless = np.zeros(arm.dof)
    groups = _groups(searched.found.model)
    without = validated_without(searched.grams, searched.found.model, groups)
    for group, fall in zip(groups, without - after, strict=True):
        effects = tuple(sized[t.candidate.names] for t in group)
        size = float(np.sqrt(max(fall.sum(), 0.0) / count))
        first = group[0].candidate
        found_sizes = [(n, s) for e in effects for n, s in zip(e.names, e.coefficients, strict=True)]
        if not first.effect.is_event and (  # events determine which arm is saved, so they are always named
            first.effect.is_nameless
            or (first.shrunk and first.effect.maps_joint)
            or size < minimum
            or fall.mean() <= standard_error(fall)
            or all(abs(s) < NONZERO_FROM * std[n] for n, s in found_sizes)
            or any(not e.loads for e in _masked_by_scatter(effects, maximum, scatter))
        ):
            mine = sorted({j for e in effects for j in e.joints})
            nameless[mine] = np.hypot(nameless[mine], size)
        else:
            claimed.append((group, effects, fall, size))
    at_the_tool = explained(searched, [group for group, *_ in claimed])
    for (group, effects, fall, size), brought in zip(claimed, at_the_tool, strict=True):
        whole = together(effects)
        mapped = max([0.0, *([] if whole.is_event else nameless[list(whole.joints)])])
        odds, rivals, survive = _against_rivals(searched, group)
        odds = min(odds, _odds(steady.get(group[0].candidate.names, np.inf)))
        is_strained = 1e3 * float(np.sqrt(3.0)) * weighing.position * size > STRAINED * together_mm
        sizes = clearness(effects, std)
        unclear = [j for j, z in sizes.items() if z < CLEAR]
        others = [together(mine) for _, mine, _, _ in claimed if mine is not effects]
        untried = _untried(whole, arm)
        doubts = {
            untried or whole.doubt(motion): True,
            "the residuals could not be tested for structure": structure is None,
            "it alone explains more than all effects together, as errors of the geometry do": is_strained,
            "another cause has the same form": any(share_a_law(whole, other) for other in others),
            "a smooth error of its joint would do nearly as well": lead_over_map(searched, group)
            < np.log(CERTAIN),
            "its joint scatters as much": bool(_masked_by_scatter(effects, maximum, scatter)),
            "it explains little that is sure beyond the noise": fall.mean() - standard_error(fall)
            < minimum**2 * count / len(fall),
            "what remains may follow another law": smooth > SMOOTH * size,
            "a residual map of its joint explains more than a third as much": mapped > SMOOTH * size,
            f"no size of it exceeds {CLEAR:.0f} standard errors": len(unclear) == len(sizes),
        }
        reasons = [text for text, holds in doubts.items() if text and holds]
        if untried == UNTRIED:
            odds = min(odds, 1.0)
        if not reasons and odds >= CERTAIN:
            kept = survive()
            unclear = [j for j in sizes if j in {*unclear, *kept.lost}]
            if not kept.holds or len(unclear) == len(sizes):
                reasons = [NOT_ROBUST]
        if reasons:
            odds = min(odds, PROBABLE)
        unsure = tuple(j for j in unclear if odds >= CERTAIN and j is not None)
        text = sentence_of(whole, unsure, std, arm, motion)
        found.append(
            Cause(
                effects=effects,
                odds=odds,
                contribution_mm=min(brought.position_mm, together_mm) if is_strained else brought.position_mm,
                contribution_deg=brought.orientation_deg,
                text=text,
                look_alikes=rivals,
                unsure=unsure,
                doubt=next(iter(reasons), ""),
            )
        )
    return tuple(sorted(found, key=lambda c: -np.nan_to_num(c.contribution_mm)))


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
    motion = Motion.of(searched.stage.fitted.problem.data)
    events = [t for t in model if t.candidate.effect.is_event]
    after, steady = validated(grams, model).sum() if events else 0.0, leads(searched)
    out = {}
    for term in events:
        odds, names = 0.0, term.candidate.names
        is_material = validated(grams, drop(model, [term])).sum() >= (1.0 + PART) * after
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
            joint in scatter.joints_that_scatter and size < STANDS_OUT * scatter.sigma[joint]
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
    return odds, tuple(o.term.candidate.effect for o in close[:LOOK_ALIKES]), survive


def _listed(effects: Sequence[AbstractEffect]) -> str:
    return " or ".join(e.phrase for e in effects)
