"""Reading a recording: its header, its commands, and the state of its last line.

A last line that has no line end, is not valid JSON, or contradicts its checksum means that the program was
stopped or lost power while writing it: it is skipped with a note. Any other damage is refused, with the last
step up to which the recording can be used. Of lines with the same step, as the places of a drag, the last one
stands for all from the first.

A recording may come from anybody: of its folder only regular files are opened, never what a link leads to.
"""

import json
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import cached_property, lru_cache, partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.robot_toml import read_toml
from workbench.base import se3
from workbench.base.errors import MALFORMED, FileError, OptionError, WorkbenchError
from workbench.base.files import open_regular, read_bytes
from workbench.plate.plate import Plate
from workbench.plate.plate_toml import read_plate
from workbench.session.command import UnknownCommand
from workbench.session.journal import codec
from workbench.session.start import start
from workbench.session.state import Session
from workbench.session.target_postures import TargetState
from workbench.session.view import Ending, Entry

NAME, NUMBER = "workbench.journal", 1
SCHEMA = f"{NAME}/{NUMBER}"
JOURNAL = "journal.jsonl"
ROBOT, PLATE = Path(codec.INPUTS, "robot.toml"), Path(codec.INPUTS, "plate.toml")
STEP = re.compile(rb'\{"step": (\d+),')
"""How a line begins."""
T = TypeVar("T")
MET = 1e-6
"""Maximum distance of the tool from a target that a recorded posture reaches [m]."""


@dataclass(frozen=True)
class _Input:
    """A file of a recording; it is its content, wherever it is."""

    content: bytes
    path: Path = field(compare=False)


@lru_cache(maxsize=16)
def _parsed(file: _Input, read: Callable[[Path], T]) -> T:
    return read(file.path)


def read_own(path: Path) -> bytes:
    """Content of a file of a recording."""
    if path.parent.is_symlink():
        raise FileError("is a link; give the recording itself", path=str(path.parent))
    return read_bytes(path, wanted="the whole folder of the recording", opener=open_regular)


def inputs(folder: Path) -> tuple[Robot, Plate]:
    """Nominal robot and first fixture of a recording, the same objects for the same files.

    What was worked out of them, the poses of a region above all, is then known in the next recording too.
    """
    robot, plate = folder / ROBOT, folder / PLATE
    return _parsed(_Input(read_own(robot), robot), read_toml), _parsed(
        _Input(read_own(plate), plate), read_plate
    )


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


@dataclass(frozen=True, eq=False)
class Recording:
    """A recording as it was read.

    Args:
        folder: Where it is.
        header: Its first line.
        robot: Nominal robot.
        plate: First fixture.
        lines: Its commands, in order.
        length: Bytes of the journal that are whole lines and stay.
        is_torn: Whether an incomplete last line was left out.
    """

    folder: Path
    header: dict[str, Any]
    robot: Robot
    plate: Plate
    lines: tuple[JournalLine, ...]
    length: int
    is_torn: bool = False

    @property
    def is_own(self) -> bool:
        """Whether this user began it on this machine."""
        return "origin" in self.header and self.header["origin"] == codec.origin(self.header)

    @property
    def entries(self) -> tuple[Entry, ...]:
        return tuple(line.entry for line in self.lines)

    @property
    def skipped(self) -> str:
        """Which commands are skipped, in one sentence; empty if none is."""
        steps: dict[str, list[str]] = {}
        for number, entry in enumerate(self.entries, start=1):
            if isinstance(entry.command, UnknownCommand):
                steps.setdefault(entry.command.name, []).append(str(number))
        if not steps:
            return ""
        named = "; ".join(f"{name} (step {', '.join(numbers)})" for name, numbers in steps.items())
        why = "an extra isn't installed, or only another version has them"
        return f"skipped, with what needs them, as commands unknown here: {named}; {why}"

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader should know, one sentence each."""
        torn = f"the last line of {self.folder / JOURNAL} is incomplete and was ignored"
        return tuple(filter(None, (torn if self.is_torn else "", self.skipped)))

    @cached_property
    def first(self) -> Session:
        """The session in which nothing has happened yet, the arm in the branches of that time."""
        states = _first_states(self.header, self.robot, self.plate)
        return start(self.robot, self.plate, is_given=bool(self.header.get("plate_given")), states=states)


def read_recording(folder: Path | str, *, to: int | None = None) -> Recording:
    """Read a recording.

    Args:
        folder: Where it is.
        to: Read up to this step only; what follows may be damaged.
    """
    folder = Path(folder)
    path = folder / JOURNAL
    if not path.exists() and not path.is_symlink():
        raise FileError(f"has no {JOURNAL}; give a folder recorded by 'workbench serve'", path=str(folder))
    content = read_bytes(path, wanted="a recording", opener=open_regular)
    *whole, rest = content.split(b"\n")
    if not rest and len(whole) > 1 and not codec.is_whole(whole[-1]):  # a kill or a loss of power left it
        rest = whole.pop() + b"\n"
    if not whole:
        raise FileError("has no complete line; the recording was stopped before it began", path=str(path))
    header, placed = _header(whole[0], path), list[tuple[int, bytes]]()
    begins = [text[: step.end()] if (step := STEP.match(text)) else text for text in whole]
    last = {begin: k for k, begin in enumerate(begins)}
    k = 0
    while (k := k + 1) < len(whole):
        k = last[begins[k]]
        placed.append((k + 1, whole[k]))
    wanted = placed if to is None else placed[: max(to, 0)]
    lines = tuple(_line(text, step, path, place) for step, (place, text) in enumerate(wanted, start=1))
    robot, plate = inputs(folder)
    found = Recording(folder, header, robot, plate, lines, len(content) - len(rest), bool(rest))
    if to is not None and not 0 <= to <= len(found.lines):
        wrong = f"step must be 0 to {len(found.lines)} in {found.folder}, got {to}"
        raise OptionError(wrong, option="step", found=to)
    return replace(found, lines=found.lines[:to])


def _header(text: bytes, path: Path) -> dict[str, Any]:
    """The first line, with its checksum and the digests of the inputs; until 27 November 2026 it had none."""
    try:
        header = json.loads(text)
        name, _, number = header["schema"].partition("/")
        kind = int(number)
    except MALFORMED:
        raise FileError("is not a journal: its first line names no schema", path=str(path)) from None
    if name != NAME or kind > NUMBER:
        why = f"has the schema {header['schema']}, and this version reads {SCHEMA}"
        raise FileError(f"{why}; install a newer workbench", path=str(path))
    if not isinstance(header.get("numbers"), dict):
        raise FileError("the first line has no table of numbers", path=str(path), line=1)
    digests, is_early = header.get("inputs"), not {codec.CHECK, "inputs"} & header.keys()
    header.pop(codec.CHECK, None)
    if not is_early and not (codec.is_whole(text) and isinstance(digests, dict)):
        raise FileError("the first line was changed after it was recorded", path=str(path), line=1)
    for file in (ROBOT, PLATE):
        if not is_early and codec.digest(read_own(path.parent / file)) != digests.get(file.name):
            raise FileError("was changed after it was recorded", path=str(path.parent / file))
    return header


def _first_states(header: dict[str, Any], robot: Robot, plate: Plate) -> tuple[TargetState, ...]:
    """How the arm stood at the beginning; nothing where these are no postures of this arm at this plate."""
    try:
        written = header["numbers"]["targets"].values()
        states = tuple(codec.record(TargetState, one) for one in written)
        reached = [i for i, state in enumerate(states) if state.reached]
        tools = tool_poses(robot, Motion(np.array([states[i].q for i in reached]).reshape(-1, robot.dof)))
        places = (se3.inverse(robot.base.pose) @ tools)[:, :3, 3]
        is_met = np.abs(places - plate.poses[reached, :3, 3]).max(initial=0.0) < MET
    except (*MALFORMED, WorkbenchError):
        return ()
    return states if is_met and len(states) == len(plate) else ()


def _line(text: bytes, step: int, path: Path, place: int) -> JournalLine:
    try:
        if not codec.is_whole(text):
            raise ValueError("it was changed after it was recorded")
        found = json.loads(text)
        if found["step"] != step:
            raise ValueError(f"it says step {found['step']}")
        if not isinstance(found["numbers"], dict) or not isinstance(found["fields"], dict):
            raise ValueError("its fields and numbers must be tables")
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
            result=codec.decode_result(found.get("result"), load),
        )
        return JournalLine(entry, found["title"], tuple(found["says"]), found["numbers"], text.decode())
    except (*MALFORMED, WorkbenchError, codec.LostFile) as error:
        why = f"'{error.args[0]}' is missing" if isinstance(error, KeyError) else str(error)
        remedy = f"--step {step - 1} opens the session before it"
        raise FileError(f"step {step} can't be read ({why}); {remedy}", path=str(path), line=place) from None


def _load(folder: Path, name: str) -> bytes:
    """A file of the recording, exactly as it was then."""
    place = Path(name)
    if place.is_absolute() or place.parts[:1] != (codec.INPUTS,) or ".." in place.parts:
        raise codec.LostFile(f"'{name}' lies outside the recording")
    try:
        content = read_own(folder / place)
    except FileError:
        raise codec.LostFile(f"the file '{name}' is missing") from None
    if codec.file_name(content, place.suffix) != name:
        raise codec.LostFile(f"the file '{name}' was changed since")
    return content
