"""The session that `serve` shows: a new one, one that goes on, or a branch of one; recorded or not."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.cli.options import say
from workbench.errors import OptionError


@dataclass(frozen=True, eq=False)
class Opening:
    """What the app begins with.

    Args:
        robot: Nominal robot.
        plate: Fixture.
        begin: Makes the session of the two, once the page is there.
    """

    robot: Any
    plate: Any
    begin: Callable


def open_session(robot: str, plate: str, *, session: Path | None, step: int | None, record: bool) -> Opening:
    """Decide where the session comes from and where it goes."""
    from workbench.session.journal import folder as folders
    from workbench.session.journal.reader import JOURNAL

    if step is not None and session is None:
        raise OptionError("--step needs --session DIR, the recording to branch off from")
    if session is not None and (step is not None or (session / JOURNAL).exists()):
        return _again(session, step, record)
    from workbench.fabricate.as_measured import load_plate
    from workbench.robots import load_robot

    def begin(robot, plate):
        return (
            _told(folders.begin(robot, plate, folder=session)) if record else folders.unrecorded(robot, plate)
        )

    return Opening(load_robot(robot), load_plate(plate), begin)


def _again(session: Path, step: int | None, record: bool) -> Opening:
    """Go on with a recording at its end, or branch off from a step."""
    from workbench.session.journal import folder as folders
    from workbench.session.journal.reader import read_recording
    from workbench.session.journal.replay import replay

    recording = read_recording(session, to=step)
    for note in recording.notes:
        say(f"note: {note}")

    def begin(robot, plate):
        now = replay(recording.first, recording.entries)
        if not record:
            return folders.Begun(now, entries=recording.entries)
        go_on = folders.resume if step is None else folders.branch
        return _told(go_on(recording, now))

    return Opening(recording.robot, recording.plate, begin)


def _told(begun):
    """Say where the session is recorded."""
    if begun.folder is not None:
        say(f"recording: {begun.folder}")
    return begun
