"""Reading a recording: its header, its commands, and the state of its last line.

A last line that has no line end, is not valid JSON, or contradicts its checksum means that the program was
stopped or lost power while writing it: it is skipped with a note. Any other damage is refused, with the last
step up to which the recording can be used. A program that was stopped in a drag left its last place beside
the journal, and that stands for the last line.
"""

import contextlib
import json
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import cached_property, lru_cache, partial
from pathlib import Path
from typing import Any

from workbench.arm.robot import Robot
from workbench.arm.robot_toml import read_toml
from workbench.base.errors import FileError, OptionError
from workbench.base.files import read_bytes
from workbench.plate.plate import Plate
from workbench.plate.plate_toml import read_plate
from workbench.session.command import UnknownCommand
from workbench.session.journal import codec
from workbench.session.journal.entry import Ending, Entry
from workbench.session.restored_targets import recalled_state
from workbench.session.start import start
from workbench.session.state import Session

NAME, NUMBER = "workbench.journal", 1
SCHEMA = f"{NAME}/{NUMBER}"
JOURNAL = "journal.jsonl"
ROBOT, PLATE = Path(codec.INPUTS, "robot.toml"), Path(codec.INPUTS, "plate.toml")


@dataclass(frozen=True)
class _Input:
    """A file of a recording; it is its content, wherever it is."""

    content: bytes
    path: Path = field(compare=False)

    @classmethod
    def of(cls, path: Path) -> "_Input":
        return cls(read_bytes(path, wanted="the whole folder of the recording"), path)


@lru_cache(maxsize=8)
def _robot(file: _Input) -> Robot:
    return read_toml(file.path)


@lru_cache(maxsize=8)
def _plate(file: _Input) -> Plate:
    return read_plate(file.path)


def inputs(folder: Path) -> tuple[Robot, Plate]:
    """Nominal robot and first fixture of a recording, the same objects for the same files.

    What was worked out of them, the poses of a region above all, is then known in the next recording too.
    """
    return _robot(_Input.of(folder / ROBOT)), _plate(_Input.of(folder / PLATE))


@dataclass(frozen=True, eq=False)
class JournalLine:
    """One command of a recording.

    Args:
        entry: The command and what became of it.
        title: The command in words.
        messages: Messages that it gave.
        numbers: What changed in the session.
        text: The line itself.
    """

    entry: Entry
    title: str
    messages: tuple[str, ...]
    numbers: dict[str, Any]
    text: str

    @property
    def is_sealed(self) -> bool:
        """Whether it has a checksum; earlier versions wrote none."""
        return codec.CHECKSUM.search(self.text.encode()) is not None


@dataclass(frozen=True, eq=False)
class Recording:
    """A recording as it was read.

    Args:
        folder: Where it is.
        header: Its first line.
        lines: Its commands, in order.
        length: Bytes of the journal that are whole lines and stay.
        unsettled: The last line, if it stands beside the journal: it takes its place there.
        notes: What a reader should know, one sentence each.
    """

    folder: Path
    header: dict[str, Any]
    lines: tuple[JournalLine, ...]
    length: int
    notes: tuple[str, ...] = ()
    unsettled: str = ""

    @property
    def entries(self) -> tuple[Entry, ...]:
        return tuple(line.entry for line in self.lines)

    @property
    def seconds(self) -> float:
        return self.lines[-1].entry.at if self.lines else 0.0

    @cached_property
    def robot(self) -> Robot:
        return _robot(_Input.of(self.folder / ROBOT))

    @cached_property
    def plate(self) -> Plate:
        return _plate(_Input.of(self.folder / PLATE))

    @cached_property
    def first(self) -> Session:
        """The session in which nothing has happened yet, the arm in the branches of that time."""
        stood = self.header.get("numbers", {}).get("targets", {}).values()
        states = tuple(recalled_state(numbers) for numbers in stood)
        return start(self.robot, self.plate, is_given=bool(self.header.get("plate_given")), states=states)

    def truncated_at(self, step: int) -> "Recording":
        """The recording cut off after so many commands."""
        if not 0 <= step <= len(self.lines):
            raise OptionError(
                f"step must be 0 to {len(self.lines)} in {self.folder}, got {step}", option="step", found=step
            )
        return replace(self, lines=self.lines[:step])


def read_recording(folder: Path | str, *, to: int | None = None) -> Recording:
    """Read a recording.

    Args:
        folder: Where it is.
        to: Read up to this step only; what follows may be damaged.
    """
    folder = Path(folder)
    path = folder / JOURNAL
    try:
        content = read_bytes(path, wanted="a recording")
    except FileError as error:
        if path.exists():
            raise error from None
        raise FileError(
            f"has no {JOURNAL}; give a folder recorded by 'workbench serve'", path=str(folder)
        ) from None
    *whole, rest = content.split(b"\n")
    if not rest and len(whole) > 1 and _is_torn(whole[-1]):
        rest = whole.pop() + b"\n"
    if not whole:
        raise FileError("has no complete line; the recording was stopped before it began", path=str(path))
    header, unsettled = _header(whole[0], path), b""
    length = len(content) - len(rest)
    if (place := _last_place(folder)) is not None:
        step, text = place
        if step == len(whole) - 1:
            length -= len(whole.pop()) + 1
        if step == len(whole):
            whole.append(text)
            unsettled, rest = text, b""
    wanted = whole[1:] if to is None else whole[1 : max(to, 0) + 1]
    lines = tuple(_line(text, number, path) for number, text in enumerate(wanted, start=1))
    notes = tuple(line.entry.command.note for line in lines if isinstance(line.entry.command, UnknownCommand))
    if rest:
        torn = f"the last line of {path} is incomplete and was ignored: the program was stopped there"
        notes = (torn, *notes)
    found = Recording(folder, header, lines, length, notes, unsettled.decode())
    return found if to is None else found.truncated_at(to)


def _last_place(folder: Path) -> tuple[int, bytes] | None:
    """Step and line of the newest place of a drag that stands beside the journal whole."""
    found = []
    for name in codec.PLACES:
        with contextlib.suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
            text = (folder / name).read_bytes().partition(b"\n")[0]
            if codec.CHECKSUM.search(text) and codec.is_whole(text):
                line = json.loads(text)
                found.append((float(line["at"]), max(int(line["step"]), 1), text))
    return max(found)[1:] if found else None


def _is_torn(text: bytes) -> bool:
    """Whether this can only be what a kill or a loss of power left of a line."""
    try:
        return not codec.is_whole(text) or _is_mixed(json.loads(text))
    except (ValueError, RecursionError):
        return True
    except (KeyError, TypeError, AttributeError):  # another kind of damage
        return False


def _header(text: bytes, path: Path) -> dict[str, Any]:
    try:
        header = json.loads(text)
        name, _, number = header["schema"].partition("/")
        kind = int(number)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise FileError("is not a journal: its first line names no schema", path=str(path)) from None
    if name != NAME or kind > NUMBER:
        raise FileError(
            f"has the schema {header['schema']}, and this version reads {SCHEMA}; install a newer workbench",
            path=str(path),
        )
    return header


def _line(text: bytes, step: int, path: Path) -> JournalLine:
    try:
        if not codec.is_whole(text):
            raise ValueError("it was changed after it was recorded")
        found = json.loads(text)
        if found["step"] != step:
            raise ValueError(f"it says step {found['step']}")
        if not isinstance(found["numbers"], dict) or not isinstance(found["fields"], dict):
            raise ValueError("its fields and numbers must be tables")
        if _is_mixed(found):
            raise ValueError("its start and end are of different positions of a drag")
        load = partial(_load, path.parent)
        command = codec.decode(found["command"], found["fields"], load, title=found["title"])
        entry = Entry(
            command=command,
            ending=Ending(found["ending"]),
            basis=int(found["basis"]),
            time=datetime.fromisoformat(found["time"]).timestamp(),
            seconds=float(found["seconds"]),
            text=found["text"],
            at=float(found["at"]),
        )
        return JournalLine(entry, found["title"], tuple(found["says"]), found["numbers"], text.decode())
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
        why = f"'{error.args[0]}' is missing" if isinstance(error, KeyError) else str(error)
        raise FileError(
            f"step {step} can't be read ({why}); --step {step - 1} opens the session before it",
            path=str(path),
            line=step + 1,
        ) from None


def _is_mixed(line: dict[str, Any]) -> bool:
    """Whether a line begins with one place of a drag and ends with another.

    Earlier versions wrote places over one another, and a kill could leave half of each.
    """
    if line["command"] != "MoveTarget":
        return False
    fields = line["fields"]
    place = line["numbers"].get("targets", {}).get(str(fields.get("target", -1) + 1))
    return place is not None and any(place[name] != fields[name] for name in ("xyz", "rpy"))


def _load(folder: Path, name: str) -> bytes:
    """A file of the recording, exactly as it was then."""
    place = Path(name)
    if place.is_absolute() or place.parts[:1] != (codec.INPUTS,) or ".." in place.parts:
        raise ValueError(f"'{name}' lies outside the recording")
    try:
        content = read_bytes(folder / place, wanted="the recording's own files")
    except FileError:
        raise ValueError(f"the file '{name}' is missing") from None
    if codec.file_name(content, place.suffix) != name:
        raise ValueError(f"the file '{name}' was changed since")
    return content
