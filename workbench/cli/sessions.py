"""The session shown by `serve`: new, continued or branched."""

import shlex
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import workbench as wb
from workbench.base.errors import OptionError
from workbench.base.progress import running
from workbench.cli import options as opt

RECORDING_DELAY = 3.0
"""Delay of the recording's start, so that the page's first picture comes sooner [s]; nothing is lost."""


def open_session(
    robot: str, plate: str | None, *, session: Path | None, step: int | None, record: bool, live: str | None
) -> dict[str, Any]:
    """Where the session comes from and where it is recorded, as arguments of `serve`."""
    if step is not None and session is None:
        raise OptionError("--step needs --session DIR, the recording to branch off from")
    if live is not None:
        from workbench.views.recording.rerun_output import url_of

        url_of(live)  # refused where no viewer listens, before anything begins
    if session is not None:
        from workbench.session.journal.reader import JOURNAL

        if step is not None or (session / JOURNAL).exists():
            return _reopen(session, step, record, live)

    def begin(arm, drawn, progress):
        from workbench.session.journal import folder as folders

        make = partial(folders.begin, folder=session) if record else folders.unrecorded_session
        return _with_recorder(make(arm, drawn, is_given=plate is not None), live)

    def read():
        source = "table2" if plate is None and robot.startswith("aria") else plate
        return wb.load_robot(robot), None if source is None else wb.load_plate(source)

    return {"read": read, "begin": begin}


def _reopen(session: Path, step: int | None, record: bool, live: str | None) -> dict[str, Any]:
    """Continue a recording at its end, or branch off from a step."""

    @cache
    def recorded():
        from workbench.session.journal.reader import read_recording

        return read_recording(session, to=step)

    def read():
        opt.say_notes(recorded().notes)
        return recorded().robot, recorded().plate

    def begin(robot, plate, progress):
        from workbench.session.journal import folder as folders
        from workbench.session.journal.replay import restore

        recording = recorded()
        with opt.progress_bar("replaying to the last state") as shown:

            def tell(part: float, text: str) -> None:
                shown(part, text)
                progress(part, text)

            with running(tell):
                restored = restore(recording)
        if not record:
            return _with_recorder(folders.go_on_unrecorded(restored), live)
        return _with_recorder(folders.go_on(restored, is_branch=step is not None), live)

    return {"read": read, "begin": begin, "sentence": f"Opening {session.resolve().name}"}


def _with_recorder(begun, live: str | None):
    """The session with its recorder; prints where it is stored and how to stop."""
    if begun.folder is None:
        opt.say("session:  not recorded\nto stop:  Ctrl-C")
    else:
        opt.say(f"session:  recorded in {begun.folder}")
        opt.say(f"to stop:  Ctrl-C; to continue: workbench serve --session {shlex.quote(str(begun.folder))}")
    if begun.trouble:
        opt.say(f"note:     {begun.trouble}")
    if begun.folder is None and live is None:
        return begun
    from workbench.views.recording.recorder import recorder

    return replace(begun, keepers=(*begun.keepers, recorder(begun.folder, live=live, after=RECORDING_DELAY)))
