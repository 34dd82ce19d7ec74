"""Recorded sessions: review, replay, and the one shown by `serve`: new, continued or branched."""

import shlex
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import workbench as wb
from workbench.base.assets import built_in_robots
from workbench.base.errors import OptionError
from workbench.base.progress import running
from workbench.base.wording import plural
from workbench.cli import options as opt
from workbench.cli.exit_status import at_once
from workbench.cli.options import argument, option

if TYPE_CHECKING:
    from workbench.session.journal.compare_sessions import ComparedSessions

RecordingArgument = Annotated[Path, argument("A recording: a folder such as recordings/sample.")]


def review(
    recording: RecordingArgument,
    others: Annotated[
        list[Path] | None,
        option("--with", "Another recording to compare with; give several to see changes over time."),
    ] = None,
    web: Annotated[bool, option("--web", "Open the viewer in the browser.")] = False,
    out: Annotated[Path | None, option("Write the scene here (.rrd) instead of opening a viewer.")] = None,
    json: opt.JsonOption = None,
) -> None:
    """Open recorded sessions in the rerun viewer; two of them side by side."""
    from workbench.session.journal.reader import read_recording

    if out is None:
        at_once()
    found = [read_recording(folder) for folder in (recording, *(others or []))]
    opt.say_notes(note for r in found for note in r.notes)
    opt.check_writable(out, json)
    compared = None
    if len(found) > 1:
        compared = _compare(found, json)
    elif json is not None:
        raise OptionError("--json needs --with, another recording to compare with")
    if len(found) > 2:
        return
    from workbench.views.recording.review import show_recordings

    with opt.progress_bar("drawing"):
        pictures = show_recordings(found, compared=compared, out=out, web=web, say=opt.say)
    if out is not None:
        opt.say(f"pictures: {pictures}")


def _compare(found: list, json: Path | None) -> "ComparedSessions":
    """Differences, and parameters that moved beyond their standard errors."""
    from workbench.session.journal.compare_sessions import compare

    with opt.progress_bar("replay"):
        compared = compare(found)
    opt.say_notes(compared.notes)
    opt.show(compared.tables())
    opt.write_result(json, compared.json())
    return compared


def replay(
    recording: RecordingArgument,
    to: Annotated[int | None, option("Replay only up to this step.")] = None,
    report: Annotated[Path | None, option("Write the session's report here (.html), one file.")] = None,
    json: opt.JsonOption = None,
) -> None:
    """Replay a recorded session and compare all numbers with the recorded ones."""
    from workbench.session.journal.compare_numbers import check
    from workbench.session.journal.reader import read_recording

    opt.check_writable(report, json)
    found = read_recording(recording, to=to)
    opt.say_notes(found.notes)
    with opt.progress_bar("replay"):
        replayed = check(found)
    opt.say(f"{plural(replayed.steps, 'step')}, {replayed.compared} numbers compared: {replayed.text}")
    opt.write_result(json, replayed.json())
    if report is not None:
        from workbench.views.recording.session_report import write_page

        opt.say(f"report: {write_page(found, replayed, report)}")
    if replayed.differences:
        opt.fail(f"the replay differs from the recording: {replayed.text}")


HEAD_START = 3.0
"""Delay of the recording's start, so that the page's first picture comes sooner [s]; nothing is lost."""


@dataclass(frozen=True, eq=False)
class Opening:
    """How the app starts.

    Args:
        read: Reads nominal robot and fixture; None as the fixture for one that is made for the arm.
        begin: Makes the session from both once the page is open, and reports its progress.
        is_certain: Whether both are built in, so that they need no checks.
    """

    read: Callable[[], tuple[Any, Any]]
    begin: Callable
    is_certain: bool = False


def open_session(
    robot: str, plate: str | None, *, session: Path | None, step: int | None, record: bool, live: str | None
) -> Opening:
    """Decide where the session comes from and where it is recorded."""
    if step is not None and session is None:
        raise OptionError("--step needs --session DIR, the recording to branch off from")
    if live is not None:
        from workbench.views.recording.rerun_output import url_of

        url_of(live)  # refused where no viewer listens, before anything begins
    if session is not None and (step is not None or _is_session(session)):
        return _reopen(session, step, record, live)

    is_given = plate is not None

    def begin(robot, plate, progress):
        from workbench.session.journal import folder as folders

        if record:
            return _with_recorder(folders.begin(robot, plate, is_given=is_given, folder=session), live)
        made = folders.unrecorded_session(robot, plate, is_given=is_given)
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
        from workbench.session.journal.restore import restore

        recording = recorded()
        with opt.progress_bar("replaying to the last state") as shown:

            def show(part: float, text: str) -> None:
                shown(part, text)
                progress(part, text)

            with running(show):
                restored = restore(recording)
        if not record:
            return _with_recorder(folders.go_on_unrecorded(restored), live)
        return _with_recorder(folders.go_on(restored, is_branch=step is not None), live)

    return Opening(read, begin)


def _with_recorder(begun, live: str | None):
    """The session with its recorder; prints where it is stored and how to stop."""
    if begun.folder is None:
        opt.say("session:  not recorded")
        opt.say("to stop:  Ctrl-C")
    else:
        opt.say(f"session:  recorded in {begun.folder}")
        opt.say(f"to stop:  Ctrl-C; to continue: workbench serve --session {shlex.quote(str(begun.folder))}")
    if begun.trouble:
        opt.say(f"note:     {begun.trouble}")
    if begun.folder is None and live is None:
        return begun
    from workbench.views.recording.recorder import recorder

    return replace(begun, keepers=(*begun.keepers, recorder(begun.folder, live=live, after=HEAD_START)))
