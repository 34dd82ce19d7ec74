"""Results of an identification or evaluation: data, decisions, parameters and errors."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, final

import numpy as np

from workbench.arm.calibrated_region import WARNING_RATIO
from workbench.arm.robot import Robot
from workbench.base.advice import beside, failures
from workbench.base.wording import first_of, in_mm, listed
from workbench.data.dataset import Dataset
from workbench.data.postures import repeats
from workbench.identification.checks import common_errors
from workbench.identification.checks.arm_match import arm_match, sister
from workbench.identification.errors.row_errors import (
    KINDS,
    Errors,
    Validation,
    explains_little,
    residuals_frame,
    row_errors,
)
from workbench.identification.instrument_preparation import AbstractIdentifiability, Unlimited
from workbench.identification.meaning.reading import FITS
from workbench.identification.noise import from_repeats, stated
from workbench.identification.preparation import Prepared
from workbench.identification.problem import FrameFreedom, Noise
from workbench.identification.rows.excluded_outliers import MAX_NAMED_ROWS, suspect_note, suspects
from workbench.identification.rows.row_selection import AbstractSplit
from workbench.identification.run import Run
from workbench.report.result_display import AbstractReported

if TYPE_CHECKING:
    from pandas import DataFrame

COMPUTED, EXACT, TURNED = 1e-5, 5e-6, 0.02
"""Errors of a nominal, and a calibrated arm below this share of its reach are of rows that were computed, if
orientations are met within this [°]."""
MIN_MISSED, MISSED = 5, 3.0
"""Fewest outlying postures that say the arm misses them, and how much in standard errors of their mean."""
SOME, MUCH = 0.1, 0.33
"""Shares of nominal's error above which joints are asked whether they follow others, and above which an arm
isn't used if they do, or if it was fitted to rows of two kinds."""
SAME_COST = 1e-6
"""Relative difference below which two costs count as equal."""
ROUNDING = 1e-6
"""Lengths and angles [m, rad] below which differences are negligible."""
CHANCE = 2.0
"""Difference of two costs ½χ² that noise alone causes: two standard deviations along one direction."""
SAME_DEVIATION = 1.01
"""Ratio of two deviations from nominal below which they count as equal."""


class BeforeAfter(NamedTuple):
    """Errors of the nominal and the calibrated arm, on held-out rows if there are any."""

    before: Errors
    after: Errors

    def __repr__(self) -> str:
        before, after = (errors.spreads for errors in self)
        both = [(name, unit) for name, (_, _, unit) in KINDS.items() if name in before and name in after]
        sizes = (f"{n.partition('_')[0]} {before[n].mean:.3g} → {after[n].mean:.3g}{u}" for n, u in both)
        return f"mean error: {', '.join(sizes)}"


class Outlier(NamedTuple):
    """An excluded row.

    Args:
        row: Its number in the data.
        position: Its error for the arm fitted to the other rows [m]; NaN if not measured.
        rotation: Likewise [rad].
        nominal: As position, for the nominal arm.
    """

    row: int
    position: float
    rotation: float
    nominal: float

    @property
    def text(self) -> str:
        off = f"{1e3 * self.position:.3g} mm" if np.isfinite(self.position) else ""
        turned = f"{np.rad2deg(self.rotation):.2g}°" if np.isfinite(self.rotation) else ""
        return f"{self.row} ({', '.join(filter(None, (off, turned)))} off)"


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Identification(AbstractReported, AbstractSplit):
    """A complete run: data, decisions, parameters and errors.

    Args:
        nominal_robot: The arm as given.
        aligned: The nominal arm with the best base and tool wherever those are free.
        nominal: Errors of `aligned`.
        runs: One per algorithm, by name.
        ready: The rows and the problem that were prepared; None for the arm of a diagnosis.
        outlying: Excluded rows that no arm explains, indices into data; they are among `excluded`, too.
        harm: That held-out rows are predicted worse with the arm's effects than without; None if not.
    """

    nominal_robot: Robot
    aligned: Robot
    data: Dataset
    nominal: Validation
    runs: dict[str, Run]
    ready: Prepared | None = None
    outlying: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    harm: str | None = None

    @property
    def frames(self) -> FrameFreedom:
        """Which parts of base and tool were identified."""
        return self.best.fit.problem.frames

    @property
    def noise(self) -> Noise:
        """Assumed standard deviations of the rows; that of positions even where none was measured."""
        noise, assumed = self.best.fit.problem.typical_noise, self.best.fit.problem.noise.position
        return noise if np.isfinite(noise.position) else noise._replace(position=assumed)

    @property
    def identifiability(self) -> AbstractIdentifiability:
        """What of the arm the rows may identify, and why."""
        return Unlimited() if self.ready is None else self.ready.identifiability

    @cached_property
    @beside("errors of outliers", ())
    def outliers(self) -> tuple[Outlier, ...]:
        """Excluded rows that no arm explains, worst first, with errors of the arm fitted to the others."""
        if self.ready is None or not len(self.outlying):
            return ()
        rows, places = self.data.take(self.outlying), self.best.fit.problem.instrument(self.best.fit.x)
        e, nominal = (self.ready.errors_on(rows, a, places) for a in (self.best.fit.arm, self.aligned))
        found = map(Outlier, *(v.tolist() for v in (rows.row, e.position, e.rotation, nominal.position)))
        return tuple(sorted(found, key=lambda row: -np.nan_to_num(row.position)))

    @property
    def missed(self) -> str:
        """That outliers lie clearly nearer to the nominal arm; empty if they don't."""
        rows = self.data.take(self.outlying)
        posture = dict(zip(rows.row.tolist(), repeats(rows).tolist(), strict=True))
        unit = np.unique([posture[row.row] for row in self.outliers], return_inverse=True)[1]
        nearer = np.bincount(unit, [row.position - row.nominal for row in self.outliers]) / np.bincount(unit)
        if len(nearer) < MIN_MISSED or not nearer.mean() > MISSED * nearer.std() / np.sqrt(len(nearer)):
            return ""
        by = f"on average {in_mm(float(nearer.mean()))} nearer to the nominal arm"
        return f"the outliers lie {by}: exclude them if they are wrong, else measure more rows there"

    @cached_property
    @beside("held-out rows that no arm explains", ())
    def suspects(self) -> tuple[int, ...]:
        """Numbers of the held-out rows that no arm explains; held-out errors include them."""
        if self.ready is None or self.identifiability.is_limited:
            return ()
        return tuple(self.held_out_data.row[suspects(self.ready, self.best.fit)].tolist())

    @property
    def best(self) -> Run:
        """The run with the smallest training cost; of equal ones the nearest to nominal, then the simplest.

        Held-out rows take no part in this choice.
        """
        plain = min((run.fit for run in self.runs.values()), key=lambda fit: fit.cost)
        chance = CHANCE * min(1.0, 2.0 * plain.cost / max(plain.spare, 1.0))
        maximum = plain.cost * (1.0 + SAME_COST) + chance
        equal = [run for run in self.runs.values() if run.fit.cost <= maximum]
        far = SAME_DEVIATION * min(run.deviation for run in equal)
        return min(equal, key=lambda r: (r.deviation > far, not r.fit.outcome.ok, r.fit.iterations))

    @cached_property
    def robot(self) -> Robot:
        """The calibrated arm of the best run, with the reasons on record not to use its files."""
        return self.best.calibrated.recorded(refused=self.refused(self.best))

    @beside("whether the files may be used", {})
    def refused(self, run: Run) -> dict[str, str]:
        """Why a file of a run's arm should not be used, by format, or "" for any; without those that may."""
        held, shown = run.judging is run.held_out_data, run.judging
        rows = self.nominal.held_out if held else self.nominal.train
        if run.before_refit is not None and not held:  # all rows, after the final fit
            rows = row_errors(self.aligned, shown)
        if not run.new_sessions:
            rows = rows.take(run.saved.is_valid_for(shown))
        worse = run.refusals(rows, self.nominal_robot.reach, self.nominal.train)
        is_much = self.best.judged.main.mean > MUCH * self.nominal.judged.main.mean
        off, vague = self.nominal.train.position_mm.rms, self.unexplained
        if vague and (away := 1e3 * self.best.transfer.anywhere.position) > off:
            vague += f"; elsewhere the constants' uncertainty alone is {away:.2g} mm"
        else:
            vague = ""
        known = [implausible_text(self.doubts(run)), self.sister, self.scale, self.computed, self.harm]
        known += [self.missed, vague, *(self.common if is_much else ())]
        doubts = self.identifiability.refused or "; ".join(filter(None, known))
        return {"": doubts, **worse} if doubts else worse

    @property
    def error(self) -> BeforeAfter:
        """Errors before and after, of the best run."""
        return BeforeAfter(self.nominal.judged, self.best.judged)

    @cached_property
    def instrument(self) -> Noise | None:
        """Standard deviations stated per row, or estimated from repeats; None without either."""
        return stated(self.best.fit.problem) or from_repeats(self.data)

    @cached_property
    @beside("whether the rows fit the arm", "")
    def foreign(self) -> str:
        """That the rows are not the nominal arm's; empty if they are, or its errors too small for a check, or
        events explain them."""
        before, after = (each.position_mm.median for each in self.error)
        is_told = bool(self.best.saved.events) and after < SOME * before
        if is_told or not before > 1e3 * FITS * self.nominal_robot.reach:
            return ""
        match = arm_match(self.nominal_robot, self.data)
        return match.text if match.is_foreign else ""

    @cached_property
    def common(self) -> tuple[str, ...]:
        """Which column parts the rows, that the instrument's frame is drawn, or else which rows lie off the
        others together; that joints and places are of different times, or that a joint follows another."""
        if self.identifiability.is_limited:
            return ()
        fit, used = self.best.fit, np.union1d(self.train_rows, np.r_[self.outlying, self.held_out_rows])
        said = common_errors.parted_by_column(fit, rows := self.data.take(used), few=bool(self.unexplained))
        said = said or common_errors.worse_by_column(fit, rows, rows.unread)
        is_known = self.best.judged.main.mean < SOME * self.nominal.judged.main.mean
        said = said or ("" if is_known else common_errors.distorted(fit))
        if fit.arm.effects:
            return (said,)
        joints = "" if self.harm else common_errors.lag(fit, self.data)
        joints = joints or ("" if is_known else common_errors.following(fit))
        kinds = common_errors.two_places if is_known else common_errors.two_kinds
        return said or kinds(fit, rows), joints

    @property
    def unexplained(self) -> str:
        """That much is left of the nominal arm's error; empty if it isn't."""
        before, after = self.nominal.train, self.best.train
        if self.identifiability.is_limited or not explains_little(before, after, self.nominal_robot.reach):
            return ""
        left = f"{after.text('rms')} of {before.text('rms')} remain"
        left += ", and no constant was corrected" if self.best.deviation < ROUNDING else ""
        return f"the geometry explains little: {left}; check robot, frames and sessions"

    @cached_property
    def scale(self) -> str:
        """That the instrument's scale is off rather than all lengths of the arm; empty if it isn't."""
        return common_errors.instrument_scale(self.aligned, self.data.take(self.train_rows))

    @cached_property
    def sister(self) -> str:
        """That the lengths found are another built-in arm's; empty if they aren't."""
        return sister(self.nominal_robot, self.best.fit.arm)

    def parameters(self) -> "DataFrame":
        """Constants of the best run by name: unit, nominal, identified, standard error; SI."""
        return self.best.fit.to_frame()

    def residuals(self) -> "DataFrame":
        """Measured − predicted of the best run, row by row, fitted rows first; measuring frame, SI."""
        parts = (self.data.take(self.train_rows), self.held_out_data)
        return residuals_frame(self.best.as_measured, *parts)

    @beside("doubts about the arm", ())
    def doubts(self, run: Run) -> tuple[str, ...]:
        """Reasons to doubt a calibrated arm: rows of another arm, or implausibly large corrections."""
        return (*filter(None, [self.foreign]), *run.implausible)

    @property
    def computed(self) -> str:
        """That rows were computed with the nominal arm and not measured; empty if they may be measured."""
        return computed_text(self.nominal_robot, self.nominal.train, self.data)

    @property
    def unidentifiable(self) -> tuple[str, ...]:
        """Unobservable combinations of parameters, as text."""
        return tuple(c.text for c in self.best.fit.unidentifiable)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings for the user: how the searches ended, what is undetermined or could not be computed."""
        with failures() as failed:
            found = [text for text in self._warnings() if text]
        return (*found, *failed)

    @beside("warnings", ())
    def _warnings(self) -> Iterator[str | None]:
        own, best = self.identifiability, self.best
        yield self.computed
        if self.suspects:
            yield suspect_note(list(self.suspects), best.judged)
        off, are_places = best.held_out.position_mm.rms, best.held_out_data.position is not None
        if are_places and off < 1e3 * EXACT * self.nominal_robot.reach:
            yield f"held-out rows are met to {off:.1g} mm, as are a controller's own poses ('extract')"
        if self.outliers:
            yield set_apart(self.outliers, best.train, self.data)
            yield self.missed
        yield self.foreign
        yield implausible_text(best.implausible)
        yield self.sister
        for run in self.runs.values():
            if not run.fit.outcome.ok:
                yield f"{run.fit.algorithm.title}: {run.fit.outcome}"
            if at := [p.text for p, x in zip(run.fit.parameters, run.fit.x, strict=True) if x in p.bounds]:
                yield f"{run.fit.algorithm.title}: held at its bound: {listed(at)}; the rows would go beyond"
        yield from best.fit.cautions
        if not own.is_limited:
            yield self.unexplained
            yield from self.common
            yield self.scale
        yield from own.doubts
        yield own.refused and f"nothing of the arm was identified: {own.refused}"
        yield self.transfer_warning()

    @beside("the expected error elsewhere", "")
    def transfer_warning(self) -> str:
        """That the arm is less certain where it was not measured; empty where it is not."""
        best, found = self.best, self.best.transfer
        is_known = best.fit.is_assessed and not (self.frames.base_per_session or self.frames.tool_per_session)
        shown = 1e-3 * best.judged.position_mm.mean * (not best.fit.problem.sees_base) or np.inf
        least = max(min(found.near.position, shown), 1e-15)
        if not is_known or found.anywhere.position <= max(WARNING_RATIO * least, ROUNDING):
            return ""
        turned = " / {:.3f}°" * best.fit.problem.sees_rotation
        sizes = ((1e3 * each.position, np.rad2deg(each.rotation)) for each in found)
        near, anywhere = (f"{{:.3f}} mm{turned}".format(*size) for size in sizes)
        how = "to use the arm there, measure in other branches and orientations too"
        if shown < found.near.position:
            how = f"rows of places that nobody measured show {in_mm(shown)} of it; measure positions, too"
        return (
            f"the constants' uncertainty alone moves the tool by {near} near the measured poses, but by "
            f"{anywhere} elsewhere within the joint limits; {how}"
        )


@final
@dataclass(frozen=True, eq=False, repr=False)
class Evaluation(AbstractReported):
    """Errors of a given model on data.

    Args:
        robot: The model, with fitted frames if these were requested.
        errors: Its errors.
        warnings: What makes the errors tell little of the arm.
        foreign: The one that says that the rows are hardly this arm's; empty if they may be.
    """

    robot: Robot
    data: Dataset
    errors: Errors
    notes: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    foreign: str = ""

    def residuals(self) -> "DataFrame":
        """Measured − predicted row by row; measuring frame, SI."""
        return residuals_frame(self.robot, self.data)


def computed_text(robot: Robot, errors: Errors, data: Dataset) -> str:
    """That rows were computed with an arm, and what else their file has; empty if they may be measured."""
    turned = errors.spreads.get("orientation_deg")
    if not (off := errors.position_mm.rms) < 1e3 * COMPUTED * robot.reach or (turned and turned.rms > TURNED):
        return ""
    met = f"the nominal arm meets these rows to {off:.1g} mm, as no real arm does: they were computed with it"
    return "; ".join((met, *(note for note in data.notes if note.startswith("columns left out"))))


def implausible_text(doubts: tuple[str, ...]) -> str:
    """A sentence on doubts about an arm; empty without any."""
    look_again = "too large for manufacturing errors: check robot, units and joint order"
    return f"implausible: {', '.join(doubts[:3])}; {look_again}" if doubts else ""


@beside("the note on outliers", "")
def set_apart(outliers: tuple[Outlier, ...], others: Errors, data: Dataset, how: str = "excluded") -> str:
    """Which rows were excluded as outliers, or how else they were set apart, and what to do."""
    shown = first_of([row.text for row in outliers], MAX_NAMED_ROWS)
    rows, them = ("rows", "them") if len(outliers) > 1 else ("row", "it")
    typical = f"; the others' median error: {others.text('median')}" if others.text("median") else ""
    return f"{rows} {shown} {how}{typical}; measure {them} again, or correct the file ({data.counted})"
