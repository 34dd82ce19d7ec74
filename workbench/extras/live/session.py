"""Guided measurement: the arm moves from target to target, and rows are stored one by one (ARIA 5.1)."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.base.progress import progress
from workbench.base.types import frozen
from workbench.base.wording import plural
from workbench.data.simulation.instruments import INSTRUMENTS, Instrument
from workbench.data.simulation.simulate import simulate_targets, virtual_arm
from workbench.extras.live.acquisition import Acquisition, Event, plate_targets
from workbench.extras.live.driver import STEERING, VirtualArm, VirtualMotion, beside
from workbench.extras.live.sample import Sample
from workbench.extras.live.standstill import ORIENTATION_STILL, POSITION_STILL, StandstillDetector, continues
from workbench.session.command import AbstractChange, AbstractCommand, AbstractTask, computed
from workbench.session.commands.data import (
    EARLIER_ERRORS,
    check_errors,
    check_measurable,
    check_seed,
    instrument_of,
    reached_postures,
    with_other_data,
)
from workbench.session.judgement import Tone
from workbench.session.loaded_measurements import Loaded, observation_text
from workbench.session.next_step import LOAD, Action, NextStep
from workbench.session.page_state import Severity, Tab
from workbench.session.part import AbstractPart, GoesWith
from workbench.session.state import Focus, Session
from workbench.session.target_steps import with_branches

USE = "Use the rows"
NOISY = 10.0
"""Extent of an instrument's noise in a window of standstill, in standard deviations, at most."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Measuring(AbstractPart):
    """A guided measurement.

    Args:
        acquisition: Rows and standstill; never changed, a command works on a copy.
        numbers: Which targets of the plate are measured, counted from 0.
        virtual: The virtual arm that is measured; None: a live source tells of a real one.
        motion: The last motion requested of the virtual arm.
    """

    is_mode = True

    acquisition: Acquisition
    numbers: tuple[int, ...]
    virtual: VirtualArm | None = None
    motion: VirtualMotion | None = None

    @property
    def target(self) -> int:
        """The target of the plate that is wanted, counted from 0."""
        return self.numbers[self.acquisition.current]

    def step(self, session: Session) -> NextStep:
        """Where the arm stands, and the rows stored so far."""
        acquisition, stored = self.acquisition, self.acquisition.rows
        is_complete = stored == len(self.numbers)
        done = Action(USE, Tab.CALIBRATE if is_complete else Tab.MEASURE, UseRows()) if stored else None
        if is_complete:
            return NextStep(
                f"All {stored} targets are stored. Use their rows to calibrate the arm.", Tone.GOOD, done
            )
        seen = acquisition.place().looks_like
        if seen is not None and acquisition.copy().store_as(seen).changed:
            number = self.numbers[seen]
            text = f"The arm is at target {number + 1}, not at the current target {self.target + 1}."
            here = Action(f"Store it as target {number + 1}", Tab.MEASURE, StoreRow(target=number))
            return NextStep(text, Tone.CAREFUL, here, done)
        text = "Drive the arm to the current target, wait until it is still, store the row"
        return NextStep(f"{text}; {stored} of {len(self.numbers)} stored.", next=done)


@dataclass(frozen=True)
class Source(AbstractPart):
    """A live source that tells where a real arm stands.

    Args:
        name: Where it is, such as `localhost:5000`.
        is_open: Whether it is still connected.
        silence: For how long it has said nothing [s]; 0 where that is no matter.
        is_followed: Whether the arm in the scene stands where the real one does.
    """

    goes_with = GoesWith.PAGE

    name: str
    is_open: bool = True
    silence: float = 0.0
    is_followed: bool = True

    @property
    def real_arm(self) -> str:
        return self.name if self.is_open else ""

    def step(self, session: Session) -> NextStep | None:
        if not self.is_followed or session.playback.focus is not Focus.JOG:
            return None
        return NextStep("The displayed arm follows the real one. Store a row at each target.", next=LOAD)


class BeginMeasuring(AbstractTask[Measuring]):
    """Begin a guided measurement of a virtual arm at the targets as they stand.

    Args:
        seed: Of the hidden errors and of the noise: the same seed is the same arm.
        errors: As of `MeasureVirtualArm`.
    """

    seed: int = 1
    errors: tuple[float, float] = EARLIER_ERRORS

    title = computed(lambda self: f"Measure virtual arm {self.seed} step by step")

    def check(self, session: Session) -> None:
        check_seed(self.seed)
        check_errors(self.errors)
        _check_not_measuring(session)
        check_measurable(session)

    def compute(self, session: Session) -> Measuring:
        rng = np.random.default_rng(self.seed)
        progress(0.1, "building the arm")
        actual = virtual_arm(session.robot, rng=rng, length=self.errors[0], angle=self.errors[1])
        numbers, near = reached_postures(actual, session)
        steered = beside(session.plate.poses[numbers], STEERING, rng)
        exact = INSTRUMENTS["ideal"]
        rows = simulate_targets(actual, steered, instrument=exact, rng=rng, near=near)
        instrument = instrument_of(session)
        return Measuring(
            acquisition=acquisition_of(session, numbers, instrument),
            numbers=tuple(numbers),
            virtual=VirtualArm(seed=self.seed, actual=actual, instrument=instrument, postures=rows.q),
        )

    def finish(self, session: Session, result: Measuring) -> Session:
        return session.with_part(result)


class DriveArm(AbstractChange):
    """Send the virtual arm to the current target; it moves by itself and sends samples."""

    title = "Drive the virtual arm to its target"
    key = "drive"

    def check(self, session: Session) -> None:
        if _measurement(session).virtual is None:
            raise OptionError("this arm is real; move it to the target with its own controller")

    def apply(self, session: Session) -> Session:
        measuring = _measurement(session)
        assert measuring.virtual is not None
        latest, last = measuring.acquisition.latest, measuring.motion
        rest = np.clip(0.0, *session.robot.search_limits.T)
        motion = VirtualMotion(
            number=1 if last is None else last.number + 1,
            start=rest if latest is None else latest.q,
            end=measuring.virtual.postures[measuring.acquisition.current],
            clock=0.0 if latest is None else latest.time + 1e-3,
        )
        session = session.with_part(replace(measuring, motion=motion))
        if session.drag is not None or measuring.target >= len(session.plate):
            return session
        return with_branches(replace(session, selected=measuring.target))


class TakeSample(AbstractChange):
    """A sample from the arm and the instrument; ignored unless a measurement is running.

    Args:
        time: By the source's clock [s].
        q: Joint positions [rad or m].
        xyz: Measured position of the tool, measuring frame [m]; None where it is not seen.
        quat: Measured orientation [w, x, y, z]; None where it is not seen.
        capture: Whether the source asks to store it.
        before: Samples before this one that standstill is judged by, where the journal has one step for all.
    """

    is_automatic = True
    title = "Sample"

    time: float
    q: tuple[float, ...]
    xyz: tuple[float, float, float] | None = None
    quat: tuple[float, float, float, float] | None = None
    capture: bool = False
    before: tuple["TakeSample", ...] = ()

    key = computed(lambda self: None if self.capture else "sample")

    def check(self, session: Session) -> None:
        for taken in (*self.before, self):
            session.robot.check_joints(np.array([taken.q]))
            numbers = (taken.time, *taken.q, *(taken.xyz or ()), *(taken.quat or (1.0,)))
            if not np.isfinite(numbers).all() or not any(taken.quat or (1.0,)):
                raise DataError("a sample with numbers that are not finite was dropped")

    def apply(self, session: Session) -> Session:
        if (measuring := session.part(Measuring)) is not None:
            acquisition = measuring.acquisition.copy()
            for taken in (*self.before, self):
                acquisition.update(taken._sample())
            session = session.with_part(replace(measuring, acquisition=acquisition))
        elif (source := session.part(Source)) is None or not source.is_followed:
            return session
        if session.drag is not None:
            return session
        return session.with_playback(focus=Focus.JOG, jogged=frozen(np.array(self.q)))

    def merged_with(self, previous: AbstractCommand, session: Session) -> "TakeSample | None":
        """Only the last place of the arm counts, and in a measurement what standstill is judged by."""
        if not isinstance(previous, TakeSample) or previous.capture or self.capture:
            return None
        if (measuring := session.part(Measuring)) is None:
            return self
        judged = measuring.acquisition.judged
        if not judged or not continues(judged[-1], self._sample()):
            return None
        times = {sample.time for sample in judged}
        earlier = (*previous.before, replace(previous, before=()))
        return replace(self, before=tuple(taken for taken in earlier if taken.time in times))

    def _sample(self) -> Sample:
        return Sample(
            time=self.time,
            q=frozen(np.array(self.q)),
            position=None if self.xyz is None else frozen(np.array(self.xyz)),
            rotation=None if self.quat is None else frozen(se3.quaternion_to_matrix(np.array(self.quat))),
            capture=self.capture,
        )


class StoreRow(AbstractChange):
    """Keep the latest sample as the current target's row.

    Args:
        target: The target of the plate that it is kept for, counted from 0; the current one if None.
        anywhere: Also where the tool is not at the target.
    """

    title = "Store the row"

    target: int | None = None
    anywhere: bool = False

    def check(self, session: Session) -> None:
        measuring = _measurement(session)
        if self.target is not None and self.target not in measuring.numbers:
            raise OptionError(f"target {self.target + 1} is not being measured")
        stored = self._store(measuring, measuring.acquisition.copy())
        if not stored.changed:
            raise DataError(stored.message)

    def apply(self, session: Session) -> Session:
        return _after(session, lambda acquisition: self._store(_measurement(session), acquisition))

    def _store(self, measuring: Measuring, acquisition: Acquisition) -> Event:
        if self.target is None:
            return acquisition.store(anywhere=self.anywhere)
        return acquisition.store_as(measuring.numbers.index(self.target))


class TakeAgain(AbstractChange):
    """Drop the current target's row, or else the one that was stored last; its target is current again."""

    title = "Retake a row"

    def check(self, session: Session) -> None:
        if not _measurement(session).acquisition.rows:
            raise DataError("there is no row to retake; store one first")

    def apply(self, session: Session) -> Session:
        return _after(session, Acquisition.again)


class NextWanted(AbstractChange):
    """Go to the next or previous target; stored rows stay until they are stored again."""

    title = "Go to another target"

    by: int = 1

    def apply(self, session: Session) -> Session:
        return _after(session, lambda acquisition: acquisition.step(self.by))


class UseRows(AbstractChange):
    """End the measurement; its rows become the session's data, as if they had been loaded from a file."""

    title = "Use the measured rows"
    key = "use"

    def check(self, session: Session) -> None:
        if not _measurement(session).acquisition.rows:
            raise DataError("no row has been stored yet; drive the arm to a target and store a row")

    def apply(self, session: Session) -> Session:
        measuring = _measurement(session)
        arm = measuring.virtual
        name = "Real arm, live" if arm is None else f"Virtual arm {arm.seed}, step by step"
        rows = measuring.acquisition.dataset(source=name)
        wanted = len(measuring.numbers)
        facts = (
            ("Measured at", f"{len(rows)} of {wanted} targets, stored one by one"),
            ("Measured", observation_text(rows)),
            ("Joints", f"{rows.joints}"),
        )
        actual = None if arm is None else arm.actual
        loaded = Loaded(rows, name, facts, rows.notes, virtual=arm is not None, actual=actual)
        session = with_other_data(session.without_part(Measuring), loaded)
        return session.with_message(Severity.INFO, f"the session's data: {plural(len(rows), 'measured row')}")


class EndMeasuring(AbstractChange):
    """End the measurement; its rows are dropped."""

    title = "Stop measuring"
    key = "stop"

    def check(self, session: Session) -> None:
        _measurement(session)

    def apply(self, session: Session) -> Session:
        return session.without_part(Measuring).with_playback(focus=Focus.TARGET)


def _check_not_measuring(session: Session) -> None:
    if session.mode is not None:
        raise OptionError("a guided measurement is running; use its rows or stop it first")


def _measurement(session: Session) -> Measuring:
    if (measuring := session.part(Measuring)) is None:
        raise OptionError("no guided measurement is running; begin one first")
    return measuring


def _after(session: Session, ask: Callable[[Acquisition], Event]) -> Session:
    measuring = _measurement(session)
    acquisition = measuring.acquisition.copy()
    ask(acquisition)
    return session.with_part(replace(measuring, acquisition=acquisition))


def acquisition_of(session: Session, numbers: list[int], instrument: Instrument) -> Acquisition:
    """Nothing stored yet; standstill is judged with the instrument's noise in mind."""
    detector = StandstillDetector(
        position=max(POSITION_STILL, NOISY * instrument.sigma_position),
        orientation=max(ORIENTATION_STILL, NOISY * (instrument.sigma_rotation or 0.0)),
    )
    targets = plate_targets(session.robot, session.plate, numbers)
    return Acquisition(targets, robot=session.robot, detector=detector)


class TellSource(AbstractChange):
    """Report the state of the live source.

    Args:
        name: Where it is.
        is_open: Whether it is connected.
        silence: For how long it has said nothing [s]; 0 where that is no matter.
    """

    is_automatic = True
    key = "source"

    name: str
    is_open: bool = True
    silence: float = 0.0

    title = computed(lambda self: f"Live source {self.name}: {'connected' if self.is_open else 'ended'}")

    def apply(self, session: Session) -> Session:
        former = session.part(Source)
        is_followed = former is None or former.is_followed
        session = session.with_part(Source(self.name, self.is_open, self.silence, is_followed))
        measuring = session.part(Measuring)
        if measuring is not None and measuring.virtual is None and self.silence:
            acquisition = measuring.acquisition.copy()
            acquisition.silence = self.silence
            session = session.with_part(replace(measuring, acquisition=acquisition))
        if self.is_open:
            return session
        text = f"the live source {self.name} has ended; restart it, then the page with --source"
        return session.with_message(Severity.WARNING, text)


class FollowSource(AbstractChange):
    """Let the arm in the scene follow the real one, or return to its target.

    Args:
        is_followed: Whether it follows.
    """

    key = "follow"

    is_followed: bool

    title = computed(lambda self: f"{'Follow' if self.is_followed else 'Stop following'} the real arm")

    def apply(self, session: Session) -> Session:
        source = replace(_source(session), is_followed=self.is_followed)
        focus = session.playback.focus if self.is_followed else Focus.TARGET
        return session.with_part(source).with_playback(focus=focus)


class MeasureLive(AbstractChange):
    """Begin a guided measurement of the real arm at all targets of the plate."""

    title = "Measure the real arm step by step"

    def check(self, session: Session) -> None:
        if not _source(session).is_open:
            raise OptionError("the live source has ended; restart it, then the page with --source")
        _check_not_measuring(session)

    def apply(self, session: Session) -> Session:
        numbers = list(range(len(session.plate)))
        acquisition = acquisition_of(session, numbers, instrument_of(session))
        return session.with_part(Measuring(acquisition=acquisition, numbers=tuple(numbers)))


def _source(session: Session) -> Source:
    if (source := session.part(Source)) is None:
        raise OptionError("no arm is connected; start the page with workbench serve --source HOST:PORT")
    return source
