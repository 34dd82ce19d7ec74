"""Guided measurement: the arm moves from target to target, and rows are stored one by one (ARIA 5.1)."""

from dataclasses import dataclass, replace

import numpy as np

from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.base.progress import progress
from workbench.base.types import frozen
from workbench.base.wording import plural
from workbench.data.simulation.instruments import INSTRUMENTS
from workbench.data.simulation.simulate import simulate_targets, virtual_arm
from workbench.extras.live.acquisition import Acquisition, plate_targets
from workbench.extras.live.driver import STEERING, VirtualArm, VirtualMotion, beside
from workbench.extras.live.sample import Sample
from workbench.extras.live.standstill import ArmState
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


@dataclass(frozen=True, eq=False, kw_only=True)
class Measuring(AbstractPart):
    """A guided measurement.

    Args:
        acquisition: Targets and rows.
        virtual: The virtual arm that is measured; None: a live source tells of a real one.
        motion: The last motion requested of the virtual arm.
    """

    is_mode = True

    acquisition: Acquisition
    virtual: VirtualArm | None = None
    motion: VirtualMotion | None = None

    def step(self, session: Session) -> NextStep:
        """Where the arm stands, and the rows stored so far."""
        acquisition, stored = self.acquisition, len(self.acquisition.rows)
        tab = Tab.CALIBRATE if acquisition.is_done else Tab.MEASURE
        done = Action(USE, tab, UseRows()) if stored else None
        if acquisition.is_done:
            return NextStep(
                f"All {stored} targets are stored. Use their rows to calibrate the arm.", Tone.GOOD, done
            )
        seen = acquisition.place().looks_like
        if seen is not None:
            other = acquisition.targets[seen]
            text = f"The arm is at {other.name}, not at the current {acquisition.target.name}."
            here = Action(f"Store it as {other.name}", Tab.MEASURE, StoreRow(target=other.number))
            return NextStep(text, Tone.CAREFUL, here, done)
        text = "Drive the arm to the current target, wait until it is still, store the row"
        return NextStep(f"{text}; {stored} of {len(acquisition.targets)} stored.", next=done)


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
            acquisition=Acquisition(
                targets=plate_targets(session.robot, session.plate, numbers), robot=session.robot
            ),
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
        target = measuring.acquisition.target.number
        if session.drag is not None or target >= len(session.plate):
            return session
        return with_branches(replace(session, selected=target))


class TakeSample(AbstractChange):
    """A sample from the arm and the instrument; ignored unless a measurement is running.

    Args:
        time: By the source's clock [s].
        q: Joint positions [rad or m].
        xyz: Measured position of the tool, measuring frame [m]; None where it is not seen.
        quat: Measured orientation [w, x, y, z]; None where it is not seen.
        capture: Whether the source asks to store it.
        arm_state: Whether the arm stands still.
        before: In journals of earlier versions.
    """

    is_automatic = True
    title = "Sample"

    time: float
    q: tuple[float, ...]
    xyz: tuple[float, float, float] | None = None
    quat: tuple[float, float, float, float] | None = None
    capture: bool = False
    arm_state: ArmState = ArmState.UNKNOWN
    before: tuple["TakeSample", ...] = ()

    key = computed(lambda self: None if self.capture else "sample")

    def check(self, session: Session) -> None:
        session.robot.check_joints(np.array([self.q]))
        numbers = (self.time, *self.q, *(self.xyz or ()), *(self.quat or (1.0,)))
        if not np.isfinite(numbers).all() or not any(self.quat or (1.0,)):
            raise DataError("a sample with numbers that are not finite was dropped")

    def apply(self, session: Session) -> Session:
        if (measuring := session.part(Measuring)) is not None:
            sample = Sample(
                time=self.time,
                q=frozen(np.array(self.q)),
                position=None if self.xyz is None else frozen(np.array(self.xyz)),
                rotation=None if self.quat is None else frozen(se3.quaternion_to_matrix(np.array(self.quat))),
                capture=self.capture,
            )
            session = _with(session, measuring.acquisition.with_sample(sample, self.arm_state))
        elif (source := session.part(Source)) is None or not source.is_followed:
            return session
        if session.drag is not None:
            return session
        return session.with_playback(focus=Focus.JOG, jogged=frozen(np.array(self.q)))

    def merged_with(self, previous: AbstractCommand, session: Session) -> "TakeSample | None":
        """Only the last place of the arm counts."""
        is_plain = isinstance(previous, TakeSample) and not previous.capture and not self.capture
        return self if is_plain else None


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
        self._stored(session)

    def apply(self, session: Session) -> Session:
        return _with(session, self._stored(session))

    def _stored(self, session: Session) -> Acquisition:
        acquisition = _measurement(session).acquisition
        numbers = [target.number for target in acquisition.targets]
        if self.target is not None and self.target not in numbers:
            raise OptionError(f"target {self.target + 1} is not being measured")
        index = None if self.target is None else numbers.index(self.target)
        return acquisition.stored(index, anywhere=self.anywhere)


class TakeAgain(AbstractChange):
    """Drop the current target's row, or else the one that was stored last; its target is current again."""

    title = "Retake a row"

    def check(self, session: Session) -> None:
        _measurement(session).acquisition.again()

    def apply(self, session: Session) -> Session:
        return _with(session, _measurement(session).acquisition.again())


class NextWanted(AbstractChange):
    """Go to the next or previous target; stored rows stay until they are stored again."""

    title = "Go to another target"

    by: int = 1

    def apply(self, session: Session) -> Session:
        return _with(session, _measurement(session).acquisition.step(self.by))


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
        wanted = len(measuring.acquisition.targets)
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


def _with(session: Session, acquisition: Acquisition) -> Session:
    return session.with_part(replace(_measurement(session), acquisition=acquisition))


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
            session = _with(session, replace(measuring.acquisition, silence=self.silence))
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
        targets = plate_targets(session.robot, session.plate, range(len(session.plate)))
        return session.with_part(Measuring(acquisition=Acquisition(targets=targets, robot=session.robot)))


def _source(session: Session) -> Source:
    if (source := session.part(Source)) is None:
        raise OptionError("no arm is connected; start the page with workbench serve --source HOST:PORT")
    return source
