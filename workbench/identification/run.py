"""One fit with its errors: of its arm, and of the files that hold this; what is said of them.

A file holds no events: it is valid for the rows after all of them. Base and tool are those after the last
step in each session, joints and frames are warm; the remainder of a warm-up that counts as over is part of
the errors.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple, final

import numpy as np
from jaxtyping import Bool

from workbench.arm.calibration_record import MAX_POSITION, MAX_ROTATION
from workbench.arm.effects.events import AbstractEvent
from workbench.arm.motion import Motion
from workbench.arm.mounting import Mounting
from workbench.arm.robot import Robot
from workbench.arm.usable_arm import (
    after_events,
    events_of,
    is_valid_after,
    off_nominal,
    sampled,
    unobserved_text,
    usable_arm,
)
from workbench.base.advice import beside
from workbench.base.wording import in_mm, plural
from workbench.data.accuracy_requirement import Wanted
from workbench.data.dataset import Dataset
from workbench.data.prediction import row_components
from workbench.identification.errors.row_errors import (
    KINDS,
    TOOL,
    UNKNOWN,
    AbstractValidation,
    Errors,
    row_errors,
    together,
    why_unusable,
)
from workbench.identification.fit import Fit
from workbench.identification.tool_observability import Transfer, transfer
from workbench.report.result_display import AbstractReported

IMPLAUSIBLE_LENGTH, IMPLAUSIBLE_ANGLE = 0.02, float(np.deg2rad(20.0))
"""Corrections of an arm's constants beyond these [m], [rad] are implausible as manufacturing errors …"""
LONG, ALONE = 0.01, 50.0
"""… lengths beyond this, too, if they are so many times as far off as usual ones: a table of another arm …"""
IMPLAUSIBLE_SHARE, CERTAIN = 0.1, 3.0
"""… as are flanges that move by this share of the reach, or by that angle, on average within the limits; both
if they exceed so many standard errors."""


@final
@dataclass(frozen=True, eq=False)
class SavedArm:
    """An arm without its events.

    Args:
        measured: The arm with the events during its measurements.
        fitted: The rows that determine them.
        known: Places of anchors, contacts or markers [m].
    """

    measured: Robot
    fitted: Dataset
    known: Mapping[str, float] = field(default_factory=dict)

    @property
    def events(self) -> list[AbstractEvent]:
        """The events in their order."""
        return events_of(self.measured)

    @cached_property
    def _sessions(self) -> dict[str, Motion]:
        motion = Motion.of(self.fitted)
        return {name: motion.take(self.fitted.in_session(name)) for name in self.fitted.sessions}

    @cached_property
    def robot(self) -> Robot:
        """The arm that its file holds."""
        return after_events(self.measured, self._sessions)

    def valid_for(self, data: Dataset) -> Dataset:
        """Those of some rows for which it is valid; all of them without events."""
        return data.take(self.is_valid_for(data))

    def is_valid_for(self, data: Dataset) -> Bool[np.ndarray, " rows"]:
        """Whether it is valid for each of some rows."""
        motion, shown = Motion.of(data), np.zeros(len(data), bool)
        for name in data.sessions:
            mine = data.in_session(name)
            shown[mine] = is_valid_after(self.measured, motion.take(mine), self._sessions.get(name))
        return shown

    @cached_property
    def formats(self) -> dict[str, Robot]:
        """The arm of each format: a TOML holds the whole model, a URDF the best purely geometric one."""
        return {"TOML": self.robot, "URDF": usable_arm(self.robot, effects=False).robot}

    def errors(self, data: Dataset) -> dict[str, Errors]:
        """Errors of each format's arm on those of some rows for which it is valid."""
        if not len(shown := self.valid_for(data)):
            return dict.fromkeys(self.formats, UNKNOWN)
        both = None if data is self.fitted else together(self.valid_for(self.fitted), shown)
        rows, (_, mine) = both or (shown, (None, np.arange(len(shown))))
        return {
            name: row_errors(arm, rows, known=self.known).take(mine) for name, arm in self.formats.items()
        }

    def rows_text(self, rows: Dataset, kind: str) -> str:
        """`11 of 24 held-out rows, those measured from row 62 on`; all of them without events."""
        if not self.events:
            return plural(len(rows), kind)
        shown = self.valid_for(rows)
        earlier = ~self.is_now(shown)
        own = f" or in session {', '.join(shown.take(earlier).sessions)}" if earlier.any() else ""
        of = f"{len(shown)} of {plural(len(rows), kind)}"
        return f"{of}, those measured from row {self.events[-1].row} on{own}"

    def is_now(self, rows: Dataset) -> Bool[np.ndarray, " rows"]:
        """Rows after all events."""
        return np.all([np.ones(len(rows), bool), *(e.is_over(Motion.of(rows)) for e in self.events)], axis=0)


@final
@dataclass(frozen=True, eq=False, repr=False)
class Run(AbstractReported, AbstractValidation):
    """One algorithm's fit and its errors.

    Args:
        fit: Parameters, standard errors, unobservable combinations.
        before_refit: The arm with these errors, if `fit` was afterwards made on all rows.
        new_sessions: Base and tool in held-out sessions that were not fitted, found from their own rows.
        geometry: The best arm without effects on the fitted rows, if the fit has some.
    """

    fit: Fit
    held_out_data: Dataset
    before_refit: Robot | None = None
    new_sessions: Mapping[str, Mounting] = field(default_factory=dict)
    geometry: Robot | None = None

    @cached_property
    def calibrated(self) -> Robot:
        """The robot with the identified values, after all events, with its errors on record."""
        alone = None if self.geometry is None else self.file_errors.get("URDF")
        own = None if alone is None else alone.expected
        is_after = self.saved.events and not self.new_sessions
        judged = self.file_errors["TOML"] if is_after else self.judged
        return self.saved.robot.recorded(error=judged.expected, geometry_error=own)

    @cached_property
    def saved(self) -> SavedArm:
        """What its files hold."""
        return self._saved(self.fit.calibrated.recorded(geometry=self.geometry))

    def _saved(self, measured: Robot) -> SavedArm:
        """With known and identified places of anchors, contacts or markers."""
        problem = self.fit.problem
        return SavedArm(measured, problem.data, {**problem.known, **problem.instrument(self.fit.x)})

    @cached_property
    def judging(self) -> Dataset:
        """Held-out rows if the saved arm is valid for some of them, else the fitted rows."""
        held = self.held_out_data
        return held if len(self.saved.valid_for(held)) else self.fit.problem.data

    @cached_property
    def file_errors(self) -> dict[str, Errors]:
        """Errors of each format's arm on the judging rows.

        A format is omitted where its error is unknown: held-out sessions without any fitted row.
        """
        if self.new_sessions:
            return {"TOML": self.judged}
        found, seen = self._saved(self.as_measured).errors(self.judging), self.saved.robot.calibration
        return {n: e.widened(*seen.observed.tool) if seen and e.own else e for n, e in found.items()}

    def refusals(self, nominal: Errors, reach: float, fitted: Errors = UNKNOWN) -> dict[str, str]:
        """Why files should not be used, by format: those worse than nominal, whose errors on the judging rows
        are given, and those on the fitted rows, if there is a final fit."""
        pairs = (refitted_errors(self), fitted), (self.file_errors, nominal)
        found = [(name, why_unusable(e, old, reach)) for errors, old in pairs for name, e in errors.items()]
        return {name: f"the {name} is {text}" for name, text in found if text}

    @property
    def as_measured(self) -> Robot:
        """The arm with these errors, including events during the measurements."""
        robot = self.before_refit or self.saved.measured
        new = self.new_sessions
        return replace(robot, sessions={**robot.sessions, **new}) if new else robot

    @cached_property
    def deviation(self) -> float:
        """Root of the summed squares of the constants' deviations from nominal [rad, m]."""
        problem = self.fit.problem
        return float(np.linalg.norm((self.fit.x - problem.start)[problem.geometry]))

    @cached_property
    @beside("implausible corrections", ())
    def implausible(self) -> tuple[str, ...]:
        """Corrections too large for manufacturing errors: constants, largest first, unless they cancel; else
        the flange, as where an error is spread over many of them."""
        found, far, nominal = [], dict[str, float](), self.fit.problem.robot
        both, ends = (
            zip(self.fit.parameters, self.fit.x.tolist(), strict=True),
            ("joint1.", f"joint{nominal.dof}."),
        )
        lengths = [abs(x - p.nominal) for p, x in both if p.is_geometry and p.unit == "m" and x != p.nominal]
        longest = float(np.clip(ALONE * np.median(lengths or [1.0]), LONG, IMPLAUSIBLE_LENGTH))
        for p, value, std in zip(self.fit.parameters, self.fit.x.tolist(), self.fit.std, strict=True):
            inner = IMPLAUSIBLE_LENGTH if p.name.startswith(ends) else longest
            maximum = IMPLAUSIBLE_ANGLE if p.unit == "rad" else inner
            if p.is_geometry and abs(moved := value - p.nominal) > max(maximum, CERTAIN * std):
                size = f"{np.rad2deg(moved):+.0f}°" if p.unit == "rad" else f"{1e3 * moved:+.0f} mm"
                found.append((abs(moved) / maximum, f"{p.text} {size}"))
                far[p.name] = value
        off = off_nominal(nominal.with_values(far), nominal, sampled(nominal)) if len(far) > 1 else None
        if off and off.position < IMPLAUSIBLE_LENGTH and off.rotation < IMPLAUSIBLE_ANGLE:
            found = []
        return tuple(text for _, text in sorted(found, reverse=True)) or self._far_flange()

    def _far_flange(self) -> tuple[str, ...]:
        nominal = self.fit.problem.robot
        off, known = off_nominal(self.fit.arm, nominal, sampled(nominal)), self.transfer.anywhere
        if off.position > max(IMPLAUSIBLE_SHARE * nominal.reach, CERTAIN * known.position):
            return (f"flange {1e3 * off.position:.0f} mm from nominal within the limits",)
        if self.fit.problem.sees_rotation and off.rotation > max(IMPLAUSIBLE_ANGLE, CERTAIN * known.rotation):
            return (f"flange {np.rad2deg(off.rotation):.0f}° from nominal within the limits",)
        return ()

    @cached_property
    def transfer(self) -> Transfer:
        """Expected errors near the measured poses, and anywhere within the limits."""
        return transfer(self.fit, rng=np.random.default_rng(0))


@beside("errors of the files after the final fit", {})
def refitted_errors(run: Run) -> dict[str, Errors]:
    """Errors of the files after the final fit to all rows, on these rows; empty if there was none."""
    return {} if run.before_refit is None else run.saved.errors(run.fit.problem.data)


def file_text(run: Run) -> str:
    """Which rows these are, the errors, and notes, in one line."""
    errors = " · ".join(sizes(run.file_errors).values())
    return "; ".join((f"{judging_text(run)}: {errors or 'not known'}", *file_notes(run)))


def judging_text(run: Run) -> str:
    """The rows on which `Run.file_errors` are: `24 held-out rows`."""
    kind = "held-out row" if run.judging is run.held_out_data else "fitted row"
    return run.saved.rows_text(run.judging, kind)


@beside("notes on the files", ())
def file_notes(run: Run) -> list[str]:
    """Notes on the files, as clauses: the final fit, sessions, the flange apart from the measured point."""
    notes = []
    if again := " · ".join(sizes(refitted_errors(run)).values()):
        where = run.saved.rows_text(run.fit.problem.data, "fitted row")
        notes.append(f"after the final fit to all rows: {again} on {where}")
    arm = run.saved.robot
    if arm.sessions:
        first = next(iter(arm.sessions))
        notes.append(f"each session with its own base; a URDF holds only that of '{first}'")
    seen = arm.calibration
    if seen is not None:
        at = seen.observed
        known = f"flange uncertain by {in_mm(at.flange.position)} and {np.rad2deg(at.flange.rotation):.2g}°"
        if at.flange.position > MAX_POSITION or at.flange.rotation > MAX_ROTATION:
            known = "the flange could not be observed separately from the tool"
        notes += unobserved_text(arm, run.saved.formats) or [known]
    return notes


def sizes(formats: dict[str, Errors]) -> dict[str, str]:
    """Mean errors of each format, such as `URDF 0.512 mm 0.1916°`: a file can be checked against them."""
    digits, parts = dict(zip(TOOL, (3, 4), strict=True)), dict[str, str]()
    for name, errors in reversed(formats.items()):
        some = [f"{s.mean:.{digits[n]}f}{KINDS[n][2]}" for n, s in errors.spreads.items() if n in digits]
        parts |= {name: " ".join((name, *some))} if some else {}
    return parts


class Judged(NamedTuple):
    """Rows of a run, held out or else fitted: whether all with a measured point keep the requirement, None
    where none has one; and this in words."""

    verdict: str
    is_kept: bool | None
    held_out: bool


def judge(run: Run, wanted: Wanted) -> Judged:
    """Compare its arm with the required error, on held-out rows, to which it was not fitted, if there are
    any."""
    held_out = len(run.held_out_data) > 0
    errors = row_components(run.as_measured, run.held_out_data if held_out else run.fit.problem.data)
    count = int(errors.has_position.sum())
    failed = int((errors.has_position & ~wanted.within(errors)).sum())
    text = wanted.text if np.isfinite(errors.rotation).any() else wanted.position_text
    where = f"{count} {'held-out rows' if held_out else 'fitted rows (none were held out)'}"
    if not count:
        return Judged("No verdict: no positions were measured", None, held_out)
    misses = f"✗ {failed} of {where} {'misses' if failed == 1 else 'miss'} {text}"
    return Judged(misses if failed else f"✓ Meets {text} on all {where}", not failed, held_out)
