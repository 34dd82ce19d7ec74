"""The claims of a diagnosis: causes of significant size, with odds. The rest predicts without naming a cause.

Effects of one kind that joints have together are one cause. An accepted effect is a cause if

- it is physically possible, as its own file bounds it, and a coefficient exceeds three standard errors;
- it stands out: where one joint scatters and the others don't, something in that joint is not modelled, of
  which an effect of the joint's own position or motion may be a part;
- what it explains on rows that took no part in its fit, fold by fold, exceeds one standard error;
- that is at least a tenth of what is left, and a third of the noise.

All others, and smooth errors of a joint that have no physical name, are the *residual map*. The odds are
those of the evidence against the best effect of another claim in the cause's place, or against none; one that
holds the cause as a special case and has more coefficients is no rival. They are stated as they would survive
other rows of the same arm: less one standard error of their logarithm, found by leaving out fold after fold.
What every part of the rows prefers stays probable; what other rows might leave too small is no more.

However large the odds, a cause is no more than probable, at the lowest odds so called (of 546 claims held
back on virtual arms with incomplete files, 92 % were true),

- while what it leaves is smooth over postures, or in the order of the rows, by a third of what it explains,
  or a residual map of its joint predicts as much: another law may then do what this one does, and rows that
  share an error count as more than they tell;
- where a rival that holds it as a special case does nearly as well, though it has more coefficients;
- while, of an error of one joint's position, a smooth one without a name is within the odds of "certain":
  what drags or is worn follows no law, and few rows look like the nearest one;
- while another cause is of the position of the same joint, or, of a scale, of its motion, or other play is
  decided by load as well: what two laws do together may be one that is not known;
- while it doesn't stand out so, though its load drives it;
- where the rows can't tell what drives it from what else differs between them (`AbstractEffect.doubt`).

Of a slide of an arm without masses nothing can be told, as how it tips while it extends can't be tried; a
coupling is no more than probable there, as the load on a bearing goes with other joints' positions too.
A cause that is certain names the joints of which a coefficient exceeds four standard errors, and no others.
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
from workbench.diagnosis.events import PART
from workbench.diagnosis.evidence import SURE, Model, drop, jackknifed, standard_error, validated
from workbench.diagnosis.explained import explained
from workbench.diagnosis.named_joints import CLEAR, clearness, sentence_of, without_joints
from workbench.diagnosis.one_less import validated_without
from workbench.diagnosis.places import best_of, distinct, includes, place_of
from workbench.diagnosis.position_laws import lead_over_map, share_a_law
from workbench.diagnosis.rounds import Searched
from workbench.diagnosis.smooth_part import smooth_part
from workbench.diagnosis.standard_errors import StandardErrors
from workbench.diagnosis.stepwise_search import kind_of
from workbench.diagnosis.survival import Survival, survival
from workbench.diagnosis.wandering import leads
from workbench.identification.joint_reading_noise import Readings, readings
from workbench.identification.problem import Noise
from workbench.identification.row_errors import Errors

Sizes = dict[tuple[str, ...], list[float]]

STANDS_OUT = 10.0
"""Times the scatter of its joint, where that joint scatters alone, that the most a cause moves it must be."""
PART_OF_REST, PART_OF_NOISE = 0.1, 1.0 / 3.0
"""Parts of what is left, and of the noise, that a cause must explain at least."""
MAX_ODDS = 1e12
"""Odds beyond this say nothing more."""
STRAINED = 1.5
"""Times what all effects explain together, beyond which a cause is no more than probable: as if the geometry
were linear so far."""
SMOOTH = 1.0 / 3.0
"""Part of what a certain cause explains that may be smooth in what is left, or in a map of its joint."""
UNTRIED = "without masses, how it tips as it extends can't be tried"
UNTRIED_ACROSS = "without masses, how bearings and links give way under the load can't be tried"
LOOK_ALIKES = 3
"""Look-alikes that are listed."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Cause:
    """A physical cause of what the geometry leaves.

    Args:
        effects: What of the saved model it is.
        odds: Against the best other claim.
        contribution_mm: What it explains at the tool (`explained.py`) [mm]; NaN where no positions were
            measured.
        text: What it does, in plain English.
        look_alikes: Other claims that the rows can't tell from it, the best first.
        unsure: Joints of its effects that it does not name, counted from 0.
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
        """What it does, or what else may do that."""
        return f"{self.text}; or else {_listed(self.look_alikes)}" if self.look_alikes else self.text

    @property
    def stated(self) -> str:
        """That with how sure it is."""
        if self.look_alikes:
            return f"{self.claim} ({self.confidence})"
        first, *rest = self.text.split("; ", 1)
        return "; ".join([f"{first} ({self.confidence})", *rest])

    @property
    def sentence(self) -> str:
        """What it does, and why that isn't certain."""
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
        """What happened while the rows were measured, if that is the cause."""
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
        """Its effects as one, of the joints that it names."""
        return without_joints(together(self.effects), self.unsure)


@dataclass(frozen=True, eq=False, kw_only=True)
class ResidualMap:
    """What of the saved model predicts and claims nothing.

    Args:
        effects: Smooth errors of joints, and effects too small to be called causes.
        before: Held-out errors without them: of the geometry, with the causes if these alone predict better.
        after: With them.
        beside_causes: Whether they do.
    """

    effects: tuple[AbstractEffect, ...]
    before: Errors
    after: Errors
    beside_causes: bool

    @property
    def joints(self) -> tuple[int, ...]:
        return tuple(sorted({j for e in self.effects for j in e.joints}))

    @property
    def claim(self) -> str:
        """What it does not claim."""
        where = f" of {joint_list(self.joints)}" if self.joints else ""
        return f"A residual map{where} predicts the rest, but names no cause"

    @property
    def sentence(self) -> str:
        where = f" of {joint_list(self.joints)}" if self.joints else ""
        without = " with the causes alone" if self.beside_causes else ""
        return (
            f"A residual map{where}, which predicts but names no cause, takes the error from "
            f"{self.before.text('mean')}{without} to {self.after.text('mean')}"
        )


def together(effects: Sequence[AbstractEffect]) -> AbstractEffect:
    """Effects of one kind as one of all their joints."""
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
    floor: Noise | None,
    std: StandardErrors,
    *,
    together_mm: float,
) -> tuple[Cause, ...]:
    """The causes among the accepted effects, the largest contribution first.

    Args:
        searched: The last search, at the final fit.
        arm: The arm as it was found.
        floor: Noise that was known beforehand.
        std: Standard errors of its coefficients.
        together_mm: Root mean square of what all effects explain at the tool, on the fitted rows [mm].
    """
    sized = {e.names: e for e in arm.effects}
    known = searched.stage.geometric.typical_noise
    scatter = readings(searched.stage.geometric)
    fitted = searched.stage.fitted
    smooth = smooth_part(fitted.problem.with_noise(searched.stage.geometric.noise), fitted.fit.x)
    maximum = _largest_loads(arm, motion)
    after = validated(searched.grams, searched.found.model)
    count = searched.grams.count
    left = float(np.sqrt(after.sum() / count))
    minimum = max(PART_OF_NOISE * _noise(left, known, floor), PART_OF_REST * left)
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
        if not first.effect.is_event and (  # events decide which arm is saved: always named
            first.effect.is_nameless
            or (first.shrunk and first.effect.maps_joint)
            or size < minimum
            or fall.mean() <= standard_error(fall)
            or all(abs(s) < SURE * std[n] for n, s in found_sizes)
            or any(not e.loads for e in _masked_by_scatter(effects, maximum, scatter))
        ):
            mine = sorted({j for e in effects for j in e.joints})
            nameless[mine] = np.hypot(nameless[mine], size)
        else:
            claimed.append((group, effects, fall, size))
    at_the_tool = explained(searched, [group for group, *_ in claimed])
    for (group, effects, fall, size), brought in zip(claimed, at_the_tool, strict=True):
        whole = together(effects)
        open_part = max([smooth, *([] if whole.is_event else nameless[list(whole.joints)])])
        odds, rivals, survive = _against_rivals(searched, group)
        odds = min(odds, _odds(steady.get(group[0].candidate.names, np.inf)))
        is_strained = 1e3 * float(np.sqrt(3.0)) * known.position * size > STRAINED * together_mm
        sizes = clearness(effects, std)
        unclear = [j for j, z in sizes.items() if z < CLEAR]
        doubt = whole.doubt(motion)
        if not (arm.has_masses or whole.is_event or all(turns(arm.chain, j) for j in whole.joints)):
            odds, doubt = min(odds, 1.0), UNTRIED
        elif not arm.has_masses and isinstance(whole, JointCoupling):
            doubt = UNTRIED_ACROSS
        others = [together(mine) for _, mine, _, _ in claimed if mine is not effects]
        if (
            is_strained
            or any(share_a_law(whole, other) for other in others)
            or lead_over_map(searched, group) < np.log(CERTAIN)
            or _masked_by_scatter(effects, maximum, scatter)
            or fall.mean() - standard_error(fall) < minimum**2 * count / len(fall)
            or open_part > SMOOTH * size
            or len(unclear) == len(sizes)
            or doubt is not None
        ):
            odds = min(odds, PROBABLE)
        if odds >= CERTAIN:
            kept = survive()
            unclear = [j for j in sizes if j in {*unclear, *kept.lost}]
            if not kept.holds or len(unclear) == len(sizes):
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
                doubt=doubt or "",
            )
        )
    return tuple(sorted(found, key=lambda c: -np.nan_to_num(c.contribution_mm)))


def _noise(left: float, known: Noise, floor: Noise | None) -> float:
    """Standard deviation of a whitened component by noise alone, at most what is left."""
    if floor is None:
        return left
    ratios = np.array(floor[:2]) / np.array(known[:2])
    return min(left, float(np.nanmin(ratios))) if np.isfinite(ratios).any() else left


def odds_of_events(searched: Searched) -> dict[Candidate, float]:
    """The odds of every event in the model; 0 of one that explains too little, or may be its postures."""
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
    """Odds by their logarithm, as far as they say anything."""
    return float(np.exp(np.clip(lead, 0.0, np.log(MAX_ODDS))))


def _groups(model: Model) -> list[Model]:
    """Terms of one claim: those of one kind that joints have together, every other one alone."""
    out: dict[object, Model] = {}
    for k, term in enumerate(model):
        key: object = kind_of(term) if term.candidate.effect.of_many_joints else k
        out[key] = (*out.get(key, ()), term)
    return list(out.values())


def _masked_by_scatter(
    effects: Sequence[AbstractEffect], maximum: Sizes, scatter: Readings | None
) -> list[AbstractEffect]:
    """Those that don't stand out of what a joint that they move scatters alone."""
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
    """The most that each coefficient of an effect moves an element over the rows [rad or m]."""
    sizes = law_sizes(arm, motion, [n for e in arm.effects for n in e.names])
    return {
        e.names: [sizes[n] * abs(c) for n, c in zip(e.names, e.coefficients, strict=True)]
        for e in arm.effects
    }


def _against_rivals(
    searched: Searched, group: Model
) -> tuple[float, tuple[AbstractEffect, ...], Callable[[], Survival]]:
    """Odds of some terms against the best other claim, the claims that can't be told from them, and what is
    left of it where things are otherwise."""
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
