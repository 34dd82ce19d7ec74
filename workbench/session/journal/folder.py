"""A recording's folder: creating, continuing and branching it.

    recordings/2026-11-21-133000/
        journal.jsonl     a header, then one line a command
        inputs/           robot, plate and measurement files, as they were, and results of fits
        session.rrd       pictures for the rerun viewer

A session begins from the recording's own copies of robot and plate, so that a replay has the same beginning
to the last digit. The header holds their digests, and like every line a checksum.
"""

import json
import shutil
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

from workbench.arm.robot import Robot
from workbench.arm.robot_toml import write_toml
from workbench.base.errors import OptionError, WorkbenchError
from workbench.base.files import write_text
from workbench.base.installed_package import package_version
from workbench.plate.plate import Plate
from workbench.plate.plate_toml import write_plate
from workbench.report.json import document
from workbench.session.command import AbstractCommand
from workbench.session.commands.drag import DropTarget
from workbench.session.journal import codec
from workbench.session.journal.numbers import changed_numbers
from workbench.session.journal.reader import JOURNAL, PLATE, ROBOT, SCHEMA, Recording, inputs, read_own
from workbench.session.journal.replay import Restored
from workbench.session.journal.writer import Appender, Logbook
from workbench.session.page_state import Severity
from workbench.session.start import start
from workbench.session.state import Session
from workbench.session.view import AbstractKeeper, Entry

ROOT = Path("recordings")
"""Where sessions go by default, below the current folder."""
NO_MORE = "from here on the session is not recorded"


@dataclass(frozen=True, eq=False)
class StartedSession:
    """A new session and its keepers.

    Args:
        session: To begin with.
        keepers: What follows its commands, such as its journal.
        folder: Where it is recorded; None if nowhere.
        entries: Commands before, if the session goes on from a recording.
        trouble: Why it is recorded nowhere or elsewhere; empty if all is as it was asked for.
    """

    session: Session
    keepers: tuple[AbstractKeeper, ...] = ()
    folder: Path | None = None
    entries: tuple[Entry, ...] = ()
    trouble: str = ""

    @property
    def opening(self) -> tuple[AbstractCommand, ...]:
        """What comes first: the end of a drag in which the program was stopped."""
        drag = None if self.session.page.only_shown else self.session.drag
        return () if drag is None else (DropTarget(drag.client),)


def unrecorded_session(robot: Robot, plate: Plate, *, is_given: bool = False) -> StartedSession:
    """A new session without a recording."""
    return StartedSession(start(robot, plate, is_given=is_given))


def begin(
    robot: Robot, plate: Plate, *, is_given: bool = False, folder: Path | None = None, root: Path = ROOT
) -> StartedSession:
    """A new session, recorded in a new folder.

    If none can be created the session starts anyway, and the user is told.

    Args:
        robot: Nominal robot.
        plate: Fixture.
        is_given: Whether the fixture is the user's, not one made for the arm.
        folder: Where to record; a folder below `root`, named by date and time, if None.
        root: Where recordings go.
    """
    try:
        folder = _make(folder, root)
        write_toml(robot, folder / ROBOT)
        write_plate(plate, folder / PLATE)
        session = start(*inputs(folder), is_given=is_given)
        header = document(
            SCHEMA,
            workbench=package_version(),
            began=_now().isoformat(timespec="seconds"),
            robot=session.robot.name,
            plate=session.plate.name,
            plate_given=session.is_plate_given,
            numbers=changed_numbers(session, None),
        )
        file = Appender(folder / JOURNAL)
        file.add((_sealed(header, folder), {}, False))
    except (OSError, WorkbenchError) as error:
        session = start(robot, plate, is_given=is_given)
        return _without_folder(session, "this session is not recorded", error, folder or root)
    return StartedSession(session, (Logbook(file),), folder)


def resume(recording: Recording, session: Session) -> StartedSession:
    """Continue a recording at its end, in its own folder.

    Args:
        recording: As it was read.
        session: Its state after the last line.
    """
    folder = recording.folder
    try:
        file = Appender(folder / JOURNAL, length=recording.length)
    except OSError as error:
        return _without_folder(session, NO_MORE, error, folder, recording.entries)
    return StartedSession(session, (Logbook(file),), folder, recording.entries)


def go_on(restored: Restored, *, is_branch: bool = False, root: Path = ROOT) -> StartedSession:
    """Continue a recording that was opened again: in its own folder, if it came out as it was recorded.

    Otherwise, and if asked to, in a new one; the user is told of the difference. One from elsewhere is only
    shown, unless the user asks for a new one.

    Args:
        restored: The recording and its session.
        is_branch: Whether to go on in a new one.
        root: Where new recordings go.
    """
    recording, session, warning = restored.recording, restored.session, restored.warning
    if not (recording.is_own or is_branch):
        why = (
            f"{recording.folder.name} was recorded on another machine, or by an earlier version, and is only "
            f"shown; start with --step {len(recording.lines)} to continue it in a copy below {root}"
        )
        begun = go_on_unrecorded(restored)
        return replace(begun, session=begun.session.updated("page", only_shown=why), trouble=why)
    if not warning:
        return branch(recording, session, root=root) if is_branch else resume(recording, session)
    text = f"{warning}; that recording is left unchanged, and the session continues in a new one"
    begun = branch(recording, session.with_message(Severity.WARNING, text), root=root)
    return replace(begun, trouble="; ".join(filter(None, (text, begun.trouble))))


def go_on_unrecorded(restored: Restored) -> StartedSession:
    """Continue a recording that was opened again without recording what follows."""
    session, warning = restored.session, restored.warning
    session = session.with_message(Severity.WARNING, warning) if warning else session
    return StartedSession(session, entries=restored.recording.entries, trouble=warning)


def branch(recording: Recording, session: Session, *, root: Path = ROOT) -> StartedSession:
    """Go on from a step of a recording, in a new folder with a copy of all that went before.

    Args:
        recording: Cut off after that step.
        session: Its state there.
        root: Where recordings go.
    """
    branched = {"from": recording.folder.name, "step": len(recording.lines)}
    header = recording.header | {"branched": branched, "began": _now().isoformat(timespec="seconds")}
    folder = None
    try:
        folder = _make(None, root)
        of_old, of_new = (place / ROBOT.parent for place in (recording.folder, folder))
        shutil.copytree(of_old, of_new, symlinks=True, dirs_exist_ok=True)
        lines = [_sealed(header, folder), *(line.text for line in recording.lines)]
        write_text(folder / JOURNAL, "".join(f"{line}\n" for line in lines))
        file = Appender(folder / JOURNAL, length=(folder / JOURNAL).stat().st_size)
    except (OSError, WorkbenchError) as error:
        return _without_folder(session, NO_MORE, error, folder or root, recording.entries)
    return StartedSession(session, (Logbook(file),), folder, recording.entries)


def _without_folder(
    session: Session, text: str, error: Exception, place: Path, entries: tuple[Entry, ...] = ()
) -> StartedSession:
    """The session all the same; its user is told."""
    why = str(error)
    if isinstance(error, OSError):
        remedy = "start in a writable folder, or give one with --session"
        why = f"{place.resolve()} can't be written ({error.strerror}); {remedy}"
    trouble = f"{text}: {why}"
    return StartedSession(session, (Logbook(None, trouble=trouble),), None, entries, trouble)


def _sealed(header: dict[str, Any], folder: Path) -> str:
    """The first line of a journal: with the digests of the inputs as they stand, and from which machine."""
    digests = {path.name: codec.digest(read_own(folder / path)) for path in (ROBOT, PLATE)}
    header = header | {"inputs": digests}
    return codec.sealed(json.dumps(header | {"origin": codec.origin(header)}, ensure_ascii=False))


def _make(folder: Path | None, root: Path) -> Path:
    """A folder that was not there, or one that is empty."""
    if folder is not None:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise OptionError(f"{folder} already exists and holds no session; give a new folder")
        folder.mkdir(parents=True, exist_ok=True)
        return folder
    stem = f"{_now():%Y-%m-%d-%H%M%S}"
    root.mkdir(parents=True, exist_ok=True)
    for number in range(1, 1000):
        made = root / (stem if number == 1 else f"{stem}-{number}")
        with suppress(FileExistsError):
            made.mkdir()
            return made
    raise OptionError(f"{root} already has 999 recordings from this second; try again")


def _now() -> datetime:
    return datetime.now().astimezone()
