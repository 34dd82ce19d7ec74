"""The session that `serve` shows: a new one, one that goes on, or a branch of one; recorded or not."""

import shlex
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import workbench as wb
from workbench.base.assets import built_in_robots
from workbench.base.errors import OptionError
from workbench.cli import options as opt

HEAD_START = 3.0
"""How long a recording leaves the processor to the page's first picture [s]; nothing is lost meanwhile."""


@dataclass(frozen=True, eq=False)
class Opening:
    """What the app begins with.

    Args:
        read: Reads nominal robot and fixture; None as the fixture for one that is made for the arm.
        begin: Makes the session of the two, once the page is there.
        is_certain: Whether both are built in, so that nothing can be wrong with them.
    """

    read: Callable[[], tuple[Any, Any]]
    begin: Callable
    is_certain: bool = False


def open_session(
    robot: str, plate: str | None, *, session: Path | None, step: int | None, record: bool, live: str | None
) -> Opening:
    """Decide where the session comes from and where it goes."""
    if step is not None and session is None:
        raise OptionError("--step needs --session DIR, the recording to branch off from")
    if live is not None:
        from workbench.views.recording.rerun_output import url_of

        url_of(live)  # refused where no viewer listens, before anything begins
    if session is not None and (step is not None or _is_session(session)):
        return _reopen(session, step, record, live)

    is_given = plate is not None

    def begin(robot, plate):
        from workbench.session.journal import folder as folders

        if record:
            return _with_recorder(folders.begin(robot, plate, is_given=is_given, folder=session), live)
        made = folders.unrecorded(robot, plate, is_given=is_given)
        return _with_recorder(made, live)

    def read():
        from workbench.plate.plate_toml import load_plate

        arm = wb.load_robot(robot)
        if plate is not None:
            return arm, wb.load_plate(plate)
        return arm, load_plate("table2") if robot.startswith("aria") else None

    return Opening(read, begin, is_certain=plate is None and robot.lower() in built_in_robots())


def _is_session(folder: Path) -> bool:
    from workbench.session.journal.reader import JOURNAL

    return (folder / JOURNAL).exists()


def _reopen(session: Path, step: int | None, record: bool, live: str | None) -> Opening:
    """Go on with a recording at its end, or branch off from a step."""

    @cache
    def recorded():
        from workbench.session.journal.reader import read_recording

        return read_recording(session, to=step)

    def read():
        opt.say_notes(recorded().notes)
        return recorded().robot, recorded().plate

    def begin(robot, plate):
        from workbench.session.journal import folder as folders
        from workbench.session.journal.replay import restore

        recording = recorded()
        with opt.progress_bar("coming to the last state") as progress:
            now = restore(recording, progress=progress)
        if not record:
            return _with_recorder(folders.Begun(now, entries=recording.entries), live)
        go_on = folders.resume if step is None else folders.branch
        return _with_recorder(go_on(recording, now), live)

    return Opening(read, begin)


def _with_recorder(begun, live: str | None):
    """The session with its pictures; says where it is kept, and how to stop."""
    if begun.folder is None:
        opt.say("session:  not kept")
        opt.say("to stop:  Ctrl-C")
    else:
        opt.say(f"session:  kept in {begun.folder}")
        opt.say(f"to stop:  Ctrl-C; to go on: workbench serve --session {shlex.quote(str(begun.folder))}")
    if begun.trouble:
        opt.say(f"note:     {begun.trouble}")
    if begun.folder is None and live is None:
        return begun
    from workbench.views.recording.recorder import recorder

    return replace(begun, keepers=(*begun.keepers, recorder(begun.folder, live=live, after=HEAD_START)))
