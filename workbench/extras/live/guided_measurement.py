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
from workbench.base.errors import DataError, FileError, WorkbenchError
from workbench.data.dataset import Dataset
from workbench.data.writer import write_measurements
from workbench.extras.live.acquisition import Acquisition, Event, Status
from workbench.extras.live.sample import Sample, samples

TICK = 0.1
"""Longest time between two looks at the view [s]: ten a second, however fast samples come."""
SILENT = 2.0
"""A source without samples for this long counts as silent [s]."""
WAITING = 2000
"""Samples that may wait; a faster source has to."""
Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class CapturedRows:
    """How a guided measurement ended.

    Args:
        data: The rows, as they stand in the file.
        is_complete: Whether every target has its row.
        is_by_hand: Whether somebody ended it.
    """

    data: Dataset
    is_complete: bool
    is_by_hand: bool


def capture(
    acquisition: Acquisition,
    robot: Robot,
    lines: Iterable[str],
    out: Path,
    *,
    keys: Iterable[str] | None = None,
    show: Callable[[Status], None] | None = None,
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
    run = _GuidedRun(acquisition, robot, out, say)
    events: queue.Queue = queue.Queue(WAITING)
    read = samples(
        lines, joints=robot.dof, source=source, on_error=lambda error: events.put((run.refuse, error))
    )
    _pump(read, events, run.take, at_end=run.finish)
    if keys is not None:
        _pump(keys, events, run.press)
    shown = -TICK
    while not run.is_ended and not (keys is None and acquisition.is_done):
        try:
            act, value = events.get(timeout=TICK)
            act(value)
        except queue.Empty:
            run.wait()
        if show is not None and monotonic() - shown >= TICK:
            show(acquisition.status())
            shown = monotonic()
    if acquisition.latest is None:
        raise DataError(
            f'{source}: it ended without a sample; send lines such as {{"time": 0.1, "q": [0.0]}}'
        )
    if not acquisition.rows:
        why = acquisition.message.removeprefix("not stored: ") or 'no sample carried "capture": true'
        raise DataError(f"{source}: no row was stored ({why}), so {out} was not written")
    return CapturedRows(acquisition.dataset(source=str(out)), acquisition.is_done, run.is_by_hand)


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

    def __init__(self, acquisition: Acquisition, robot: Robot, out: Path, say: Say):
        self.is_ended = self.is_by_hand = False
        self._acquisition, self._out, self._say = acquisition, out, say
        self._sliding = sliding_numbers(robot)
        self._heard = monotonic()
        self._has_written = False
        self._keys: dict[str, Callable[[], Event]] = {
            **dict.fromkeys("\r\n ", acquisition.store),
            "y": self._store_as_seen,
            "f": lambda: acquisition.store(force=True, anywhere=True),
            "r": acquisition.again,
            "n": lambda: acquisition.step(1),
            "p": lambda: acquisition.step(-1),
        }

    def take(self, sample: Sample) -> None:
        self._heard, is_first = monotonic(), self._acquisition.latest is None
        event = self._acquisition.update(sample)
        if is_first:
            self._say(f"stored with the joints: {self._acquisition.source}")
        if event is not None:
            self._done(event)

    def refuse(self, error: WorkbenchError) -> None:
        """A bad line is told and passed over once good ones have come."""
        if self._acquisition.latest is None:
            raise error
        self._heard = monotonic()
        self._say(str(error))

    def press(self, key: str) -> None:
        if key == "q":
            self.is_ended = self.is_by_hand = True
        elif key in self._keys:
            self._done(self._keys[key]())

    def _store_as_seen(self) -> Event:
        seen = self._acquisition.place().looks_like
        return self._acquisition.store() if seen is None else self._acquisition.store_as(seen)

    def wait(self) -> None:
        silent = monotonic() - self._heard
        self._acquisition.silence = silent if silent > SILENT else 0.0

    def finish(self, _: object) -> None:
        self.is_ended = True

    def _done(self, event: Event) -> None:
        if event.changed:
            self._write()
        self._say(event.message)

    def _write(self) -> None:
        """The file as it now has to be: gone when its last row was dropped."""
        if not self._has_written:
            _keep_older(self._out, self._say)
            self._has_written = True
        if self._acquisition.rows:
            data = self._acquisition.dataset(source=str(self._out))
            write_measurements(data, self._out, prismatic=self._sliding)
        else:
            self._out.unlink(missing_ok=True)


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
        raise FileError(f"can't be renamed ({error.strerror}): choose another name", path=str(out)) from None
    say(f"an older {out.name} is kept as {kept.name}")
