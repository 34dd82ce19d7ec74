"""Guided measurement as one call: from samples and keys to a measurement file, row by row.

The file is whole after every row, so that whatever ends the program, no row is lost.
"""

import queue
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

from workbench.arm.joint_units import sliding_numbers
from workbench.arm.robot import Robot
from workbench.base.errors import DataError, FileError
from workbench.data.dataset import Dataset
from workbench.data.writer import write_measurements
from workbench.extras.live.acquisition import Acquisition, Event, StandstillDetector, Status
from workbench.extras.live.capture import CaptureProgress
from workbench.extras.live.driven_plate import plate_targets
from workbench.extras.live.sample import parse_sample
from workbench.plate.plate import Kind, Plate

TICK = 0.1
"""Longest time between two looks at the view [s]: ten a second, however fast samples come."""
SILENT = 2.0
"""A source that says nothing for so long is said to be silent [s]."""
WAITING = 2000
"""Samples that may wait; a faster source has to."""

KEYS = {
    "\r": "store",
    "\n": "store",
    " ": "store",
    "y": "as",
    "f": "force",
    "r": "again",
    "n": "next",
    "p": "previous",
}
"""Commands by key; `q` ends."""

Show = Callable[[Status], None]
Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class CapturedRows:
    """How a guided measurement ended.

    Args:
        data: The rows, as they stand in the file.
        complete: Whether every target has its row.
        by_hand: Whether somebody ended it.
    """

    data: Dataset
    complete: bool
    by_hand: bool


def plate_acquisition(
    robot: Robot,
    plate: Plate,
    *,
    session: str = "",
    detector: StandstillDetector | None = None,
    forced: bool = False,
) -> Acquisition:
    """The guided measurement of a plate's targets, in their order.

    Args:
        session: Name of the placement of robot or instrument.
        detector: Judges standstill.
        forced: Store on the source's request even while the arm moves.
    """
    return Acquisition(
        CaptureProgress(targets=plate_targets(robot, plate), session=session),
        robot=robot,
        detector=detector,
        oriented=tuple(target.kind is Kind.SEAT for target in plate.targets),
        forced=forced,
    )


def capture(
    acquisition: Acquisition,
    robot: Robot,
    lines: Iterable[str],
    out: Path,
    *,
    keys: Iterable[str] | None = None,
    show: Show | None = None,
    say: Say = lambda text: None,
    source: str = "stdin",
) -> CapturedRows:
    """Store rows as the source and the keys ask for them, until somebody or the source ends it.

    Args:
        acquisition: The targets.
        lines: Lines of a live source.
        out: The file to write; an older one is kept beside it.
        keys: Keys as they are struck; None: nobody is there, and it ends with the last target.
        show: Is given the status at least as often as every `TICK`.
        say: Is given one line for each thing that happens.
        source: Name of the source, for messages.
    """
    run = _GuidedRun(acquisition, robot, out, say, source)
    events: queue.Queue = queue.Queue(WAITING)
    _pump(lines, events, run.line, at_end=run.finish)
    if keys is not None:
        _pump(keys, events, run.key)
    shown = -TICK
    while not run.ended and not (keys is None and acquisition.capture.done):
        try:
            act, value = events.get(timeout=TICK)
            act(value)
        except queue.Empty:
            run.nothing()
        if show is not None and monotonic() - shown >= TICK:
            show(acquisition.status())
            shown = monotonic()
    if not acquisition.rows:
        raise DataError(_nothing_stored(run))
    return CapturedRows(acquisition.dataset(source=str(out)), acquisition.capture.done, run.by_hand)


def _nothing_stored(run: "_GuidedRun") -> str:
    if run.acquisition.latest is None:
        return f'{run.source}: it ended without a sample; send lines such as {{"time": 0.1, "q": [0.0]}}'
    requested = run.acquisition.message.removeprefix("not stored: ") or 'no sample carried "capture": true'
    return f"{run.source}: no row was stored ({requested}), so {run.out} was not written"


def _pump(source: Iterable, events: queue.Queue, act: Callable, *, at_end: Callable | None = None) -> None:
    """Pass everything from a source to the loop, in a separate thread."""

    def run() -> None:
        try:
            for value in source:
                events.put((act, value))
        except (OSError, ValueError):
            pass  # the source was closed
        if at_end is not None:
            events.put((at_end, None))

    threading.Thread(target=run, daemon=True).start()


class _GuidedRun:
    """One run of the loop: what each thing that comes in leads to."""

    def __init__(self, acquisition: Acquisition, robot: Robot, out: Path, say: Say, source: str):
        self.acquisition = acquisition
        self.robot = robot
        self.out = out
        self.source = source
        self.ended = self.by_hand = False
        self._say = say
        self._count = 0
        self._heard = monotonic()
        self._kept_older = False
        self._sliding = sliding_numbers(robot)

    def line(self, text: str) -> None:
        """One line of the source; a bad one is told and passed over once good ones have come."""
        self._count += 1
        self._heard = monotonic()
        if not text.strip():
            return
        try:
            sample = parse_sample(text, line=self._count, joints=self.robot.dof, source=self.source)
        except FileError as error:
            if self.acquisition.latest is None:
                raise
            self._say(str(error))
            return
        before = self.acquisition.arm_state
        event = self.acquisition.update(sample)
        if before is None:
            self._say(f"stored with the joints: {self.acquisition.source}")
        self._done(event)

    def key(self, key: str) -> None:
        if key == "q":
            self.ended = self.by_hand = True
        elif (requested := KEYS.get(key)) is not None:
            self._done(self._act(requested))

    def _act(self, requested: str) -> Event:
        if requested == "again":
            return self.acquisition.again()
        if requested in ("next", "previous"):
            return self.acquisition.step(1 if requested == "next" else -1)
        seen = self.acquisition.place().looks_like
        if requested == "as" and seen is not None:
            return self.acquisition.store_as(seen)
        is_forced = requested == "force"
        return self.acquisition.store(force=is_forced, anywhere=is_forced)

    def nothing(self) -> None:
        silent = monotonic() - self._heard
        self.acquisition.silence = silent if silent > SILENT else 0.0

    def finish(self, _: object = None) -> None:
        self.ended = True

    def _done(self, event: Event | None) -> None:
        if event is None:
            return
        if event.changed:
            self._write()
        self._say(event.message)

    def _write(self) -> None:
        """The file as it now has to be: gone when its last row was dropped."""
        if not self._kept_older:
            _keep_older(self.out, self._say)
            self._kept_older = True
        if not self.acquisition.rows:
            self.out.unlink(missing_ok=True)
            return
        data = self.acquisition.dataset(source=str(self.out))
        write_measurements(data, self.out, prismatic=self._sliding)


def _keep_older(out: Path, say: Say) -> None:
    """Rename an older file of that name: measurements are not overwritten."""
    if not out.exists():
        return
    number = 1
    while (kept := out.with_name(f"{out.stem}.{number}{out.suffix}")).exists():
        number += 1
    try:
        out.rename(kept)
    except OSError as error:
        raise FileError(
            f"it can't be renamed ({error.strerror}): choose another name", path=str(out)
        ) from None
    say(f"an older {out.name} is kept as {kept.name}")
