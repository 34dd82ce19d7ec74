"""Which driver an error follows, and whether a law of it is more than a smooth dependence on it.

Two questions, each by a difference of log evidences [nat] from the same inner products:

- Is it the law? It must be better than any process through its own elements over its driver.
- Is it that element, that driver? The best process there must be better than the best one through any other
  element, over any driver: like with like, as no law is simple enough to decide where the rows don't. Alone
  a law of one coefficient a joint, which is simpler than its rivals, may be probable where elements tie; none
  is certain there.

And no process over its driver may explain a noticeable part beside it. Masses are those of the fit for all.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice

import numpy as np

from workbench.arm.effects.axes import Insertion
from workbench.arm.effects.events import AbstractStep
from workbench.arm.frame import revised
from workbench.arm.motion import Motion
from workbench.arm.statics.deflection import shift_of
from workbench.data.dataset import Dataset
from workbench.data.measuring_order import clock_of
from workbench.diagnosis.confidence import CERTAIN, CERTAIN_LAW, MAX_ODDS, PROBABLE, Confidence
from workbench.diagnosis.drivers.driver import (
    CREEPS,
    TIME,
    WAY,
    Driver,
    Follower,
    Shape,
    constants_over_time,
    driver_of,
    followed_text,
    followers,
    products,
)
from workbench.diagnosis.drivers.path import Path, path_of
from workbench.diagnosis.drivers.process import DriverProcess
from workbench.diagnosis.search.contributions import reduced, remaining
from workbench.diagnosis.search.event_search import EVENT_PRIOR_ODDS
from workbench.diagnosis.search.evidence import (
    Model,
    Offer,
    Remainder,
    coefficients,
    drop,
    is_nameless,
    joints_of,
    left_of,
    offers,
    own_offers,
    solve,
    with_one_more,
)
from workbench.diagnosis.search.gram_matrices import Grams, compress
from workbench.diagnosis.search.refit import FLAT
from workbench.diagnosis.search.rounds import Searched, compressed_at
from workbench.diagnosis.search.stepwise_search import group_evidence
from workbench.identification.errors.row_errors import NOTHING, Errors
from workbench.identification.problem import Problem

MIN_GAIN = 8.0
"""Log evidence from which an error follows a driver at all [nat]."""
MAX_FREEDOM = 6
"""Coefficients by which a process may be freer than its law; one that does worse yet can't be that law."""
MAX_REST = 0.05
"""Share of an error that a process may explain beside its law; scatter of its joints as well, if certain …"""
MAX_SCATTER = 0.5
"""… and else: then it is as large as the law."""
MIN_GAIN_SHARE = 0.01
"""Share of the largest law's evidence below which a process may be what its linear model leaves."""
MAX_LAG_REST = 0.5
"""Share of an error's square that a lag may leave for effects not to be looked for beside it."""
MAX_PLAY, STEADY = 2e-3, 0.9
"""Way of a joint that play may take [rad or m]: a lag that moves none farther can't be told from it where
speeds are steady: share of their mean square that is their mean's, 0.81 where they are sines."""
MAX_FOLLOWERS = 6
"""Maximum number of processes by which an error is described."""
MIN_SIDE, MAX_STEPS = 3, 40
"""Minimum number of rows on either side of a step, and maximum number of steps that are tried at once."""
MIN_LAW_SHARE = 0.5
"""Share of the evidence of what follows time or place from which an effect is no average of that."""
MAX_ROWS = 600
"""Maximum number of rows, evenly spread over those that were fitted; all decide on a law that is near …"""
MIN_NEAR = 0.25
"""… to processes of at least this share of the best ones' evidence."""


@dataclass(frozen=True, eq=False)
class Challenge:
    """A law in its place, against processes.

    Args:
        lead: Its log odds against the best process.
        apart: Log odds of the best process through its own elements, of its own driver and shape, against
            the best one through others or of another driver: each as free as the other.
        rivals: The best ones elsewhere, together as many as the law has joints.
        rest: Share of the error that processes over its own driver explain beside it …
        allowed: … and how much they may.
        scatter: Share of it and of what its joints scatter more than most that is of this.
        driver: Its driver.
        is_simplest: Whether it has one coefficient a joint and the rivals have more, and nothing over its
            driver adds to it.
    """

    lead: float
    apart: float
    rivals: tuple[Follower, ...]
    rest: float
    allowed: float
    scatter: float
    driver: Driver
    is_simplest: bool

    @property
    def cap(self) -> float:
        """Odds that the law may have at most: 1, 20 or any.

        Where the rows leave open which element moves, the simplest law may be probable, unless another one
        is, and is never certain.
        """
        open_for = (-1.0 if self.is_simplest else 1.0) * np.log(PROBABLE)
        is_complete = self.rest <= self.allowed and self.scatter <= MAX_SCATTER
        if self.lead < np.log(PROBABLE) or self.apart < open_for or not is_complete:
            return 1.0
        is_sure = min(self.lead, self.apart) >= np.log(CERTAIN_LAW) and self.scatter <= MAX_REST
        return np.inf if is_sure else PROBABLE

    @property
    def doubt(self) -> str:
        """Why it isn't certain, as a clause; empty if nothing speaks against it."""
        if self.rest > self.allowed:
            return f"{100 * self.rest:.0f} % of the error over its driver is something else"
        if self.scatter > MAX_REST:
            return f"a joint of it scatters besides, by {100 * self.scatter:.0f} % of its error"
        if self.cap < np.inf:
            alike = f"a smooth dependence on {followed_text(self.rivals)} explains as much"
            return alike if self.rivals else "it adds little to the other effects"
        return ""


@dataclass(frozen=True, eq=False)
class FollowedDriver:
    """A driver that an error follows without a law.

    Args:
        driver: The driver.
        parts: Processes over it, the largest first.
        lead: Log odds against the best process over another driver …
        rival: … and that process; None without one.
        laws: Kinds of effects that aren't all of it, or that may be it where it can't be told from its rival.
        delay: By how long places are later than joints, if it is their speed [s, or rows].
    """

    driver: Driver
    parts: tuple[Follower, ...]
    lead: float
    rival: Follower | None
    laws: tuple[str, ...] = ()
    delay: float = 0.0

    @property
    def confidence(self) -> Confidence:
        return Confidence.of(round(float(np.exp(min(self.lead, np.log(MAX_ODDS)))), 6))  # 20 is 20

    @property
    def shape(self) -> Shape | None:
        """How the last of them depends on it."""
        return self.parts[-1].shape

    @property
    def joints(self) -> tuple[int, ...]:
        """Joints whose angle, load or motion it is, counted from 0."""
        return tuple(sorted({j for part in self.parts for j in part.followed}))

    @property
    def either(self) -> tuple[Follower, ...]:
        """The process that it can't be told from, if there is one."""
        return (self.rival,) if self.rival is not None and self.confidence is Confidence.OPEN else ()

    @property
    def text(self) -> str:
        """Clause that continues `The error`."""
        other = f", or {followed_text(self.either)}" if self.either else ""
        return f"follows {followed_text(self.parts)}{other} ({self.confidence})"


@dataclass(frozen=True, eq=False)
class DriverEvidence:
    """What processes would add to a search's model, or in the place of parts of it, at its final fit.

    Args:
        searched: The search.
        problem: Its problem, on at most `MAX_ROWS` rows.
        followers: The processes.
        grams: Inner products of the columns of both.
        path: How the joints came to the rows of the search.
    """

    searched: Searched
    problem: Problem
    followers: tuple[Follower, ...]
    grams: Grams
    path: Path | None

    @classmethod
    def of(
        cls, searched: Searched, whole: Dataset, drivers: Collection[Driver] = tuple(Driver)
    ) -> "DriverEvidence":
        """At a search's final fit; all rows of the file tell how far the joints moved."""
        problem, x = searched.stage.weighed, searched.stage.fit.x
        path = path_of(problem.data, whole)
        found = followers(problem, x, path, drivers)
        rows = np.unique(np.linspace(0, len(problem.data) - 1, MAX_ROWS).round().astype(int))
        if len(rows) < len(problem.data):
            fewer = problem.again(data=problem.data.take(rows))
            problem = fewer if fewer.names == problem.names else problem
        return cls(searched, problem, found, compressed(searched, problem, (), found), path)

    def challenges(self, groups: Sequence[Model]) -> list[Challenge]:
        """Every claim's terms against processes: alone, with all other claims over its driver, and without
        those that lose and need more than a posture: kept, they would take from the processes what is left.
        """
        alone = [self._challenge((group,)) for group in groups]
        effects = [group[0].candidate.effect for group in groups]
        drivers = [driver_of(effect) for effect in effects]
        for driver in dict.fromkeys(d for d in drivers if drivers.count(d) > 1):
            mine = [k for k, d in enumerate(drivers) if d == driver]
            whole = self._challenge([groups[k] for k in mine])
            for k in mine:
                alone[k] = min(alone[k], whole, key=lambda c: c.cap)
        lost = [k for k, e in enumerate(effects) if alone[k].cap <= 1.0 and e.needs and not e.is_event]
        rest = [k for k in range(len(groups)) if k not in lost]
        if lost and rest:
            kept = drop(self._model, [t for k in lost for t in groups[k]])
            fewer = replace(self, searched=replace(self.searched, model=kept))
            for k, again in zip(rest, fewer.challenges([groups[k] for k in rest]), strict=True):
                alone[k] = min(alone[k], again, key=lambda c: c.cap)
        return alone

    def _challenge(self, groups: Sequence[Model]) -> Challenge:
        """Laws over one driver against as many processes in their place as they have joints.

        Terms of the model without a name over the same driver and joints are such a process beside them.
        """
        law = tuple(t for group in groups for t in group)
        joints, driver = joints_of(law), driver_of(law[0].candidate.effect)
        nameless = {t: t.candidate.effect for t in self._model if is_nameless(t)}
        kin = tuple(t for t, e in nameless.items() if driver_of(e) == driver and joints & {*e.joints})
        left = left_of(self.grams, drop(self._model, (*law, *kin)))
        own, most = group_evidence(left, (*law, *kin)), sum(max(len(joints_of(g)), 1) for g in groups)
        first, is_event = what_add(left, self.followers), len(law) == 1 and law[0].candidate.effect.is_event
        if is_event:  # it was charged for its pace, so creeps are as well
            creeps = {f: o for f, o in first.items() if f.shape is Shape.CREEP}
            first |= {f: replace(o, gain=o.gain - np.log(len(CREEPS))) for f, o in creeps.items()}
        other, whole = {f: max(o.gain, 0.0) for f, o in self.beside.items()}, left_of(self.grams, self._model)

        def best(some: Iterable[Follower]) -> tuple[float, tuple[Follower, ...]]:
            """Evidence of the best of some processes in the law's place, one after the other, and these; what
            they add to the whole model doesn't count: it is another error, which the law goes with too."""
            steps = _one_by_one(left, {f: first[f] for f in some if f in first}, 0.0, other)
            found = {f: gain + other.get(f, 0.0) for gain, f, _ in islice(steps, most)}
            added = _one_by_one(whole, {f: self.beside[f] for f in found if f in self.beside}, 0.0)
            return float(sum(found.values()) - sum(gain for gain, *_ in added)), tuple(found)

        home = [f for f in self._over(driver) if self._holds(f, law)]
        there = best(f for f in home if f.shape is not Shape.TURNED and not f.is_even)[0]
        bends = law[0].candidate.effect.insertion is Insertion.BEND  # evenly is a case of that
        link = [f for f in home if not bends and f.candidate.effect.insertion is Insertion.BEND]
        even = [f for f in self._over(driver) if bends and f.is_even and f.shape is Shape.LINE]
        free = max(best(f for f in home if f.shape in (None, Shape.CREEP) or f in link)[0], best(even)[0])
        found = [best(f for f in self._over(d) if f not in (*home, *even)) for d in Driver]
        is_step = all(isinstance(t.candidate.effect, AbstractStep) for t in law)  # as a process is
        found += [(g, (step,)) for g, step in self._steps(left.model, law) if not self._holds(step, law)]
        gain, rivals = max(found, key=lambda each: each[0])
        own_load = driver is Driver.LOAD  # which the tool has, not all joints
        alike = [
            f for f in self._over(driver) if not joints or joints & {*f.joints} or not (f.joints or own_load)
        ]
        beside = max((o for f in alike if (o := self.beside.get(f))), key=lambda o: o.gain, default=None)
        allowed, minimum = MAX_REST, max(MIN_GAIN, MIN_GAIN_SHARE * own)
        if driver is Driver.TIME and not is_step:  # a law that says what comes later
            allowed, minimum = 0.0, float(np.log(PROBABLE))
        more = kin if beside is None or beside.gain <= minimum else (*kin, beside.term)
        rest = self._share(left, law, more) if more else 0.0
        is_simple = len({n for t in law for n in t.candidate.names}) <= max(len(joints), 1)
        jumps = (r.shape is Shape.JUMP and not r.candidate.effect.insertion for r in rivals)
        as_simple = [is_jump or len(r.candidate.names) == 1 for is_jump, r in zip(jumps, rivals, strict=True)]
        is_simplest = is_simple and not more and not (rivals and all(as_simple))
        freedom = 0.0 if is_step else 0.5 * most * MAX_FREEDOM * float(np.log(self.grams.count))
        there = max(there, own - freedom)
        free -= is_event * float(np.log(EVENT_PRIOR_ODDS))  # what else the time does is as unlikely
        lead, apart = own - max(gain, free - max(MIN_GAIN_SHARE * own - MIN_GAIN, 0.0)), there - gain
        is_thinned = len(self.problem.data) < len(self.searched.stage.problem.data)
        if is_thinned and rest <= allowed and abs(min(lead, apart)) < np.log(CERTAIN):
            near = {*home, *even, *(f for _, each in found for f in each)}
            near |= {f for f, o in first.items() if o.gain - other.get(f, 0.0) > MIN_NEAR * gain}
            nearer = self._of(self.searched.stage.weighed, [f for f in self.followers if f in near])
            return replace(nearer._challenge(groups), rest=rest, allowed=allowed)
        return Challenge(lead, apart, rivals, rest, allowed, self._scatter(law), driver, is_simplest)

    def _of(self, problem: Problem, some: Sequence[Follower]) -> "DriverEvidence":
        """The same with other rows or noise, and other processes."""
        grams = compressed(self.searched, problem, (), some)
        return replace(self, problem=problem, followers=tuple(some), grams=grams)

    @property
    def _model(self) -> Model:
        return self.searched.model

    @cached_property
    def beside(self) -> dict[Follower, Offer]:
        """Contributions of processes to the whole model."""
        return what_add(left_of(self.grams, self._model), self.followers)

    @cached_property
    def exact(self) -> "DriverEvidence | None":
        """The same where joint readings are exact: what is taken for their scatter may follow two quantities
        together; None where none scatter."""
        joints, stage = np.flatnonzero(self.problem.noise.joints).tolist(), self.searched.stage
        if not joints:
            return None
        found = (*self.followers, *products(stage.weighed, stage.fit.x, self.path, joints))
        return self._of(self.problem.with_noise(self.problem.typical_noise), found)

    def surprise(self, model: Model) -> float:
        """Negative log likelihood that a model leaves with this noise, and what its own variances cost."""
        left, problem, log_det = left_of(self.grams, model), self.problem, 0.0
        for block in problem.blocks:
            one = np.eye(block.inverse_sigma.shape[1])
            root = problem.whiten(block, np.repeat(one[None], len(block.rows), axis=0))
            log_det += np.linalg.slogdet(root + one * (block.inverse_sigma == 0.0)[:, None])[1].sum()
        own = 0.5 * np.log(self.grams.count) * np.count_nonzero(problem.noise.joints)
        return float(left.freedom * (0.5 * np.log(left.square) - log_det / self.grams.count) + own)

    @cached_property
    def rest(self) -> tuple[FollowedDriver, ...]:
        """What the error follows that the whole model leaves."""
        return self.followed(self._model)

    def followed(self, sure: Model) -> tuple[FollowedDriver, ...]:
        """What the error follows that some terms of the model leave: beside the scatter of joint readings,
        or in its place if that is likelier."""
        (gain, found), other = self._followed(sure), self.exact
        if other is None:
            return found
        more, instead = other._followed(sure)
        lead = more - gain - other.surprise(sure) + self.surprise(sure)
        instead = tuple(replace(f, lead=min(f.lead, lead)) for f in instead)
        known = max((f.lead for f in found), default=np.log(PROBABLE))
        return instead if max((f.lead for f in instead), default=known) > known else found

    def _followed(self, sure: Model) -> tuple[float, tuple[FollowedDriver, ...]]:
        """The same with this noise, and its log evidence."""
        laws = (o.gain for o in own_offers(self.grams, sure)) if sure else ()
        minimum = max(MIN_GAIN, MIN_GAIN_SHARE * max(laws, default=0.0))
        left, found, moments = left_of(self.grams, sure), dict[Driver, FollowedDriver](), list[float]()
        total = 0.0
        for _ in range(MAX_FOLLOWERS):
            tried = what_add(left, self.followers)
            best = max(tried, key=lambda f: tried[f].gain, default=None)
            if best is None or tried[best].gain < minimum:
                break
            gains = {f: o.gain for f, o in tried.items()}
            near = [f for f in gains if f.driver == best.driver and gains[best] - gains[f] < np.log(PROBABLE)]
            best = max(near, key=lambda f: (not f.candidate.effect.insertion.of_joint, gains[f]))  # usual
            over_time = [f for f in tried if f.phrase.startswith(TIME) and best.driver is Driver.TEMPERATURE]
            if over_time:  # a change of temperature hides a knock, and tells when it was
                by_step, step, _ = self._stepped(left.model, max(over_time, key=gains.__getitem__))
                gains[step] = by_step + float(np.log(len(self.clock[0])))
            rival = max((f for f in gains if f.driver != best.driver), key=gains.__getitem__, default=None)
            lead = gains[best] - (0.0 if rival is None else max(gains[rival], 0.0))
            if rival in tried:
                more = evidence_of(left, self._over(rival.driver), len(best.candidate.names)) - gains[best]
                lead = min(lead, -more)
                if more > 0.0:  # a freer one resembles several of another driver
                    best, rival, lead = rival, best, min(more, float(np.log(PROBABLE)))
            if found:  # a second one may be what the smooth function of the first leaves
                lead = min(lead, float(np.log(PROBABLE)))
            before = found.get(best.driver, FollowedDriver(best.driver, (), lead, rival))
            shown, total = best, total + tried[best].gain
            larger = (*left.model, tried[best].term)
            if best.phrase.startswith(TIME):  # a step between two rows, if that is likelier
                by_step, step, moment = self._stepped(left.model, best, moments)
                if by_step > tried[best].gain + np.log(PROBABLE):
                    moments.append(moment)
                    grams = compressed(self.searched, self.problem, left.model, (*self.followers, step))
                    shown, left = step, left_of(grams, left.model)
                    larger = (*left.model, what_add(left, [step])[step].term)
            if best.shape is Shape.LAG and self.path:  # what its linear model leaves is told later
                against = min(before.lead, self._against_play(left, best, tried[best]))
                delay = self._delay(best, larger)
                lag = replace(best, phrase=f"{best.phrase}, {self.path.course.text(delay)}")
                found[best.driver] = replace(before, lead=against, parts=(*before.parts, lag), delay=delay)
                break
            found[best.driver] = replace(before, parts=(*before.parts, shown))
            left = with_one_more(left, larger)
        return total, tuple(found.values())

    @property
    def is_lag(self) -> bool:
        """Whether most of the error is that joints and places are of different times: more than any other
        process explains."""
        best = max(self.beside, key=lambda f: self.beside[f].gain, default=None)
        if best is None or best.shape is not Shape.LAG:
            return False
        left, lag = left_of(self.grams, self._model), self.beside[best]
        is_most = with_one_more(left, (*self._model, lag.term)).square < MAX_LAG_REST * left.square
        return is_most and bool(self._against_play(left, best, lag) >= np.log(CERTAIN))

    def _delay(self, lag: Follower, model: Model) -> float:
        """By how long places are later than joints in a model with this process [s]."""
        return coefficients(self.grams, model)[lag.candidate.names[0]]

    def _against_play(self, left: Remainder, process: Follower, lag: Offer) -> float:
        """Log odds of a lag against play in all joints, which at steady speed moves them as it does."""
        effect = process.candidate.effect
        assert isinstance(effect, DriverProcess)
        speed, delay = np.abs(effect.together), abs(self._delay(process, (*left.model, lag.term)))
        is_steady = (speed.mean(0) ** 2).sum() > STEADY * (speed**2).mean(0).sum()
        if is_steady and speed.max() * delay < MAX_PLAY:
            return 0.0
        return lag.gain - evidence_of(left, [f for f in self.followers if f.phrase == WAY])

    def lasting(self, undecided: Model) -> Model:
        """The model without those undecided laws and nameless terms that are of no use for other rows.

        Averages of what won't come again, or is the instrument's: they add nothing beside what follows time,
        temperature or place, and are less than half of it. Or they need more than a posture, and help little.
        """
        model, left, most = self._model, left_of(self.grams, self._model), 0.0
        unsure = [t for t in model if is_nameless(t) or t in undecided]
        over = [f for d in (Driver.TIME, Driver.TEMPERATURE) for f in self._over(d)]
        over += [f for f in self._over(Driver.PLACE) if not f.joints]  # pulls are the arm's own
        steps = _one_by_one(left, what_add(left, over))
        for gain, _, larger in islice(steps, MAX_FOLLOWERS if unsure else 0):
            left, most = larger, max(most, gain)
        alone, beside = (own_offers(self.grams, m) for m in (model, left.model))
        gains = zip(model, alone, beside, strict=False)
        averages = [t for t, o, rest in gains if rest.gain <= 0.0 and o.gain < MIN_LAW_SHARE * most]
        kept = drop(model, [t for t in averages if t in unsure])
        others = drop(kept, [t for t in kept if t in unsure and t.candidate.effect.needs])
        if len(others) == len(kept):
            return kept
        after, before = remaining(self.searched, [kept, others]).tolist()
        return kept if reduced(before, after) else others

    @cached_property
    def clock(self) -> tuple[np.ndarray, np.ndarray]:
        """Clock and number of every row, in the file's order."""
        data = self.searched.stage.problem.data
        order = np.argsort(data.row, kind="stable")
        return clock_of(data)[0][order], data.row[order]

    def _steps(self, model: Model, law: Model) -> Iterator[tuple[float, Follower]]:
        """Processes over time as steps where those of some laws are, their places as many."""
        stage, events = self.searched.stage, {t.candidate: t.candidate.effect for t in law}
        steps = {c: e.moment for c, e in events.items() if isinstance(e, AbstractStep)}
        for candidate, moment in steps.items():
            clocked = [f for f in self.followers if f.phrase.startswith(TIME)]  # not what sessions do
            tried = [f for f in clocked if f.shape is None] or constants_over_time(stage.problem, stage.fit.x)
            found = [f.as_step(*self.clock, moment) for f in tried]
            gains = np.array(self._gains(model, found)) - np.log(candidate.tries)
            yield from zip(gains.tolist(), found, strict=True)

    def _stepped(
        self, model: Model, process: Follower, known: Sequence[float] = ()
    ) -> tuple[float, Follower, float]:
        """The best step of what a process over time moves, beside a model, and its moment: one that is known,
        or another, less the log number of places."""
        clock, row = self.clock
        moments = np.unique(clock)[MIN_SIDE:-MIN_SIDE]
        places, apart, best = np.log(max(len(moments), 1)), len(moments) + 1, (-np.inf, process, np.nan)

        def tried(some: Sequence[float], charge: float) -> tuple[float, Follower, float]:
            steps = [process.as_step(clock, row, moment) for moment in some]
            gains = (gain - charge for gain in self._gains(model, steps))
            return max(zip(gains, steps, some, strict=True), key=lambda each: each[0])

        while apart > 1 and len(moments):  # ever closer about the best one
            apart = -(-len(moments) // MAX_STEPS)
            best = tried(moments[::apart].tolist(), places)
            top = int(np.searchsorted(moments, best[2]))
            moments = moments[max(top - apart, 0) : top + apart + 1]
        return max(best, tried(known, 0.0), key=lambda each: each[0]) if known else best

    def _gains(self, model: Model, some: Sequence[Follower]) -> list[float]:
        """Contributions of processes that have no columns yet."""
        grams = compressed(self.searched, self.problem, model, some)
        found = what_add(left_of(grams, model), some)
        return [found[f].gain if f in found else -np.inf for f in some]

    def with_parts(self, parts: Sequence[Follower]) -> Searched:
        """The search with processes in its model, on all its rows."""
        model, stage, some = self._model, self.searched.stage, [part.candidate for part in parts]
        effects = [c.effect for c in (*(t.candidate for t in model), *some)]
        grams = compressed_at(stage, effects, self.searched.fold)
        more = (o.term for o in offers(left_of(grams, model), some))
        return replace(self.searched, grams=grams, model=(*model, *more))

    def correction(self, followed: Sequence[FollowedDriver], left: Errors) -> str:
        """What processes would reduce of the errors left by the saved model, in a sentence, if anything."""
        whole = self.with_parts([part for each in followed for part in each.parts])
        before, after = remaining(whole, [self._model, whole.model])
        turned = left.spreads.get("orientation_deg", NOTHING)
        means = np.array([left.position_mm.mean, turned.mean])
        change = reduced(means.tolist(), (means * after / before).tolist())
        return f" A correction from your rows would reduce {change}." if change else ""

    def _over(self, driver: Driver) -> list[Follower]:
        return [f for f in self.followers if f.driver == driver]

    @property
    def pulls(self) -> list[Follower]:
        """Processes of a pull on the tool."""
        return [f for f in self._over(Driver.PLACE) if f.joints]

    def _holds(self, process: Follower, law: Model) -> bool:
        return any(process.holds(t.candidate.effect, self.problem.robot.chain) for t in law)

    def _share(self, left: Remainder, law: Model, more: Model) -> float:
        """Share of the error of some terms and more of them that is of these: what both may explain is the
        law's, which is sized without the prior that selected it."""
        flat = [replace(t, precision=t.precision * (FLAT if t in law else 1.0)) for t in self._model]
        solution = solve(self.grams, (*flat, *(t for t in more if t not in self._model)))

        def size(terms: Model) -> float:
            mine = self.grams.columns([n for t in terms for n in t.candidate.names])
            return float(solution[mine] @ left.inner(mine) @ solution[mine])

        return size(more) / max(size(law) + size(more), 1e-300)

    def _scatter(self, law: Model) -> float:
        """Share of the error of some terms that is what their joints scatter more than most, not they."""
        noise, arm = np.square(self.problem.noise.joints), self.searched.stage.fit.arm
        if not noise.any():
            return 0.0
        names, joints = {t.candidate.names for t in law}, sorted(joints_of(law))
        alone = revised(arm, effects=tuple(e for e in arm.effects if e.names in names))
        moved = shift_of(alone, Motion.of(self.problem.data))[:, alone.chain.driven[joints]].var(0)
        more = np.where(moved > 0.0, np.maximum(noise - np.median(noise), 0.0)[joints], 0.0)
        return float((more / np.maximum(more + moved, 1e-300)).max(initial=0.0))


def compressed(
    searched: Searched, problem: Problem, model: Model, some: Sequence[Follower], *, masses=False
) -> Grams:
    """Inner products of the columns of a model, of processes, and of all that the fit has: these give its
    part back."""
    candidates = (*(t.candidate for t in (*searched.model, *model)), *(f.candidate for f in some))
    fold, effects = np.zeros(len(problem.data), np.int64), [c.effect for c in candidates]
    return compress(problem, searched.stage.fit.x, effects, fold, masses=masses)


def what_add(left: Remainder, some: Sequence[Follower]) -> dict[Follower, Offer]:
    """What processes would add to a model."""
    by_candidate = {id(f.candidate): f for f in some}
    return {by_candidate[id(o.term.candidate)]: o for o in offers(left, [f.candidate for f in some])}


def evidence_of(left: Remainder, some: Sequence[Follower], weights: float | int = np.inf) -> float:
    """Evidence of processes beside a model, taken in one after the other, with at most so many weights."""
    total = 0.0
    for gain, process, _ in _one_by_one(left, what_add(left, some)):
        if (weights := weights - len(process.candidate.names)) < 0.0:
            break
        total += gain
    return total


def _one_by_one(
    left: Remainder,
    offered: Mapping[Follower, Offer],
    minimum: float = MIN_GAIN,
    less: Mapping[Follower, float] | None = None,
) -> Iterator[tuple[float, Follower, Remainder]]:
    """Evidence of the best process beside a model, less some, it, and what it leaves, while there is one."""
    while True:
        gains = {f: o.gain - (less or {}).get(f, 0.0) for f, o in offered.items()}
        best = max(gains, key=gains.__getitem__, default=None)
        if best is None or gains[best] <= minimum:
            return
        left = with_one_more(left, (*left.model, offered[best].term))
        yield gains[best], best, left
        offered = what_add(left, tuple(offered))
