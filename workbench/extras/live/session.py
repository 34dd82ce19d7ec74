"""Guided measurement: the arm moves from target to target, and rows are stored one by one (ARIA 5.1)."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from workbench.base.errors import DataError, OptionError
from workbench.base.types import frozen
from workbench.base.wording import plural
from workbench.extras.live.acquisition import Acquisition
from workbench.extras.live.sample import Sample
from workbench.extras.live.standstill import ArmState
from workbench.report.blocks import Tone
from workbench.session.command import AbstractChange, AbstractCommand, computed
from workbench.session.commands.data import with_other_data
from workbench.session.loaded_measurements import Loaded, facts_of
from workbench.session.next_step import LOAD, Action, NextStep
from workbench.session.page_state import Severity, Tab
from workbench.session.part import AbstractPart, GoesWith
from workbench.session.state import Focus, Session

USE = "Use the rows"
ENDED = "the live source has ended; restart it, then the page with --source"


@dataclass(frozen=True, eq=False)
class Measuring(AbstractPart):
    """A guided measurement."""

    is_mode = True

    acquisition: Acquisition

    def step(self, session: Session) -> NextStep:
        """Where the arm stands, and the rows stored so far."""
        now, stored = self.acquisition, len(self.acquisition.rows)
        done = Action(USE, Tab.CALIBRATE if now.is_done else Tab.MEASURE, UseRows()) if stored else None
        if now.is_done:
            return NextStep(
                f"All {stored} targets are stored. Use their rows to calibrate the arm.", Tone.GOOD, done
            )
        text = "Drive the arm to the current target, wait until it is still, store the row"
        return NextStep(f"{text}; {stored} of {len(now.plate)} stored.", next=done)


@dataclass(frozen=True)
class Source(AbstractPart):
    """A live source that tells where a real arm stands.

    Args:
        name: Where it is, such as `localhost:5000`.
        is_open: Whether it is still connected.
        silence: For how long it has said nothing [s]; 0 where that is no matter.
    """

    goes_with = GoesWith.PAGE

    name: str
    is_open: bool = True
    silence: float = 0.0

    def step(self, session: Session) -> NextStep | None:
        if session.playback.focus is not Focus.JOG:
            return None
        return NextStep("The displayed arm follows the real one. Store a row at each target.", next=LOAD)


def _source(session: Session) -> Source:
    if (source := session.part(Source)) is None:
        raise OptionError("no arm is connected; start the page with workbench serve --source HOST:PORT")
    return source


def measuring(session: Session) -> Acquisition:
    """The guided measurement under way."""
    if (found := session.part(Measuring)) is None:
        raise OptionError("no guided measurement is running; begin one first")
    return found.acquisition


class MeasureLive(AbstractChange):
    """Begin a guided measurement of the real arm at all targets of the plate."""

    title = "Measure the real arm step by step"

    def check(self, session: Session) -> None:
        if not _source(session).is_open:
            raise OptionError(ENDED)
        if session.mode is not None:
            raise OptionError("a guided measurement is running; use its rows or stop it first")
        if not len(session.plate):
            raise OptionError(
                f"plate '{session.plate.name}' has no targets to measure; add [[target]] tables"
            )

    def apply(self, session: Session) -> Session:
        return session.with_part(Measuring(Acquisition(plate=session.plate, robot=session.robot)))


class TakeSample(AbstractChange):
    """A sample from the arm and the instrument; it moves the arm in the scene.

    Args:
        time: By the source's clock [s].
        q: Joint positions [rad or m].
        xyz: Measured position of the tool, measuring frame [m]; None where it is not seen.
        quat: Measured orientation [w, x, y, z]; None where it is not seen.
        capture: Whether the source asks to store it.
        arm_state: Whether the arm stands still.
    """

    is_automatic = True
    title = "Sample"

    time: float
    q: tuple[float, ...]
    xyz: tuple[float, float, float] | None = None
    quat: tuple[float, float, float, float] | None = None
    capture: bool = False
    arm_state: ArmState = ArmState.UNKNOWN

    key = computed(lambda self: None if self.capture else "sample")

    def check(self, session: Session) -> None:
        session.robot.check_joints(np.array([self.q]))
        numbers = (self.time, *self.q, *(self.xyz or ()), *(self.quat or (1.0,)))
        if not np.isfinite(numbers).all() or not any(self.quat or (1.0,)):
            raise DataError("a sample with numbers that are not finite was dropped")

    def apply(self, session: Session) -> Session:
        if session.part(Measuring) is not None:
            now = measuring(session).with_sample(Sample.of(self), self.arm_state)
            session = session.with_part(Measuring(now))
        elif session.part(Source) is None:
            return session
        if session.drag is not None:
            return session
        return session.updated("playback", focus=Focus.JOG, jogged=frozen(np.array(self.q)))

    def merged_with(self, previous: AbstractCommand, session: Session) -> "TakeSample | None":
        """Only the last place of the arm counts."""
        is_plain = isinstance(previous, TakeSample) and not previous.capture and not self.capture
        return self if is_plain else None


class AbstractMeasuringStep(AbstractChange):
    """What changes the guided measurement; refused where it can't."""

    change: ClassVar[Callable[[Acquisition], Acquisition]]

    def check(self, session: Session) -> None:
        self.apply(session)

    def apply(self, session: Session) -> Session:
        return session.with_part(Measuring(type(self).change(measuring(session))))


class StoreRow(AbstractMeasuringStep):
    """Keep the latest sample as the current target's row."""

    title, change = "Store the row", Acquisition.stored


class TakeAgain(AbstractMeasuringStep):
    """Drop the current target's row, or else the one that was stored last; its target is current again."""

    title, change = "Retake a row", Acquisition.again


class NextWanted(AbstractMeasuringStep):
    """Go to the next target; stored rows stay until they are stored again."""

    title, change = "Go to another target", Acquisition.next


class UseRows(AbstractChange):
    """End the measurement; its rows become the session's data, as if they had been loaded from a file."""

    title = "Use the measured rows"
    key = "use"

    def check(self, session: Session) -> None:
        if not measuring(session).rows:
            raise DataError("no row has been stored yet; drive the arm to a target and store a row")

    def apply(self, session: Session) -> Session:
        name, count = "Real arm, live", len(measuring(session).plate)
        rows = measuring(session).dataset(source=name)
        facts = ("Measured at", f"{len(rows)} of {count} targets, stored one by one"), *facts_of(rows)
        session = with_other_data(session.without_part(Measuring), Loaded(rows, name, facts, rows.notes))
        return session.with_message(Severity.INFO, f"the session's data: {plural(len(rows), 'measured row')}")


class EndMeasuring(AbstractChange):
    """End the measurement; its rows are dropped."""

    title = "Stop measuring"
    key = "stop"

    def check(self, session: Session) -> None:
        measuring(session)

    def apply(self, session: Session) -> Session:
        return session.without_part(Measuring).updated("playback", focus=Focus.TARGET)


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
        session = session.with_part(Source(self.name, self.is_open, self.silence))
        if session.part(Measuring) is not None and self.silence:
            now = replace(measuring(session), silence=self.silence)
            session = session.with_part(Measuring(now))
        return session if self.is_open else session.with_message(Severity.WARNING, f"{self.name}: {ENDED}")
