"""The session that `serve` shows: a new one, one that goes on, or a branch of one; recorded or not."""

import shlex
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import workbench as wb
from workbench.base.errors import OptionError
from workbench.cli import options as opt

HEAD_START = 3.0
"""How long a recording leaves the processor to the page's first picture [s]; nothing is lost meanwhile."""


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


def open_session(
    robot: str, plate: str | None, *, session: Path | None, step: int | None, record: bool, live: str | None
) -> Opening:
    """Decide where the session comes from and where it goes."""
    if step is not None and session is None:
        raise OptionError("--step needs --session DIR, the recording to branch off from")
    if live is not None:
        _check_viewer(live)
    if session is not None and (step is not None or _is_session(session)):
        return _again(session, step, record, live)

    is_given = plate is not None

    def begin(robot, plate):
        from workbench.session.journal import folder as folders

        if record:
            return _followed(folders.begin(robot, plate, is_given=is_given, folder=session), live)
        made = folders.unrecorded(robot, plate, is_given=is_given)
        return _followed(made, live)

    if plate is not None or robot.startswith("aria"):
        return Opening(wb.load_robot(robot), wb.load_plate(plate or "table2"), begin)
    from workbench.session.start import suited_plate

    arm = wb.load_robot(robot)
    return Opening(arm, suited_plate(arm), begin)


def _is_session(folder: Path) -> bool:
    from workbench.session.journal.reader import JOURNAL

    return (folder / JOURNAL).exists()


def _again(session: Path, step: int | None, record: bool, live: str | None) -> Opening:
    """Go on with a recording at its end, or branch off from a step."""
    from workbench.session.journal import folder as folders
    from workbench.session.journal.reader import read_recording
    from workbench.session.journal.replay import restore

    recording = read_recording(session, to=step)
    for note in recording.notes:
        opt.say(f"note: {note}")

    def begin(robot, plate):
        with opt.progress_bar("coming to the last state") as progress:
            now = restore(recording, progress=progress)
        if not record:
            return _followed(folders.Begun(now, entries=recording.entries), live)
        go_on = folders.resume if step is None else folders.branch
        return _followed(go_on(recording, now), live)

    return Opening(recording.robot, recording.plate, begin)


def _followed(begun, live: str | None):
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


def _check_viewer(address: str) -> None:
    """Refuse an address where no viewer listens before anything begins."""
    from workbench.views.recording.rerun_output import url_of

    url_of(address)
