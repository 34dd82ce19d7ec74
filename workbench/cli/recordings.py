"""The commands about recorded sessions: review, replay."""

from pathlib import Path
from typing import Annotated

from workbench.base.errors import OptionError
from workbench.cli import options as opt
from workbench.cli.options import argument, option

RecordingArgument = Annotated[Path, argument("A recording: a folder such as recordings/sample.")]


def review(
    recording: RecordingArgument,
    others: Annotated[
        list[Path] | None,
        option("--with", "Another recording, to compare; more than one: what moved over time."),
    ] = None,
    web: Annotated[bool, option("--web", "Open the viewer in the browser.")] = False,
    out: Annotated[Path | None, option("Write the pictures here (.rrd) and open no viewer.")] = None,
    json: opt.JsonOption = None,
) -> None:
    """Open recorded sessions in the rerun viewer; two of them side by side."""
    from workbench.session.journal.reader import read_recording

    found = [read_recording(folder) for folder in (recording, *(others or []))]
    opt.say_notes(note for r in found for note in r.notes)
    opt.check_writable(out, json)
    if len(found) > 1:
        _compare(found, json)
    elif json is not None:
        raise OptionError("--json needs --with, another recording to compare with")
    if len(found) > 2:
        return
    from workbench.views.recording.review import show_recordings

    with opt.progress_bar("drawing") as progress:
        pictures = show_recordings(found, out=out, web=web, progress=progress, say=opt.say)
    if out is not None:
        opt.say(f"pictures: {pictures}")


def _compare(found: list, json: Path | None) -> None:
    """What differs, and which parameters have moved beyond their standard errors."""
    from workbench.views.recording.compare_sessions import compare

    compared = compare(found)
    opt.show(compared.tables())
    opt.write_result(json, compared.json())


def replay(
    recording: RecordingArgument,
    to: Annotated[int | None, option("Up to this step only.")] = None,
    report: Annotated[Path | None, option("Write the session's report here (.html), one file.")] = None,
    json: opt.JsonOption = None,
) -> None:
    """Do a recorded session again and compare all numbers with those of then."""
    from workbench.session.journal.compare_numbers import check
    from workbench.session.journal.reader import read_recording

    opt.check_writable(report, json)
    found = read_recording(recording, to=to)
    opt.say_notes(found.notes)
    with opt.progress_bar("replay") as progress:
        replayed = check(found, progress=progress)
    opt.say(f"{replayed.steps} steps, {replayed.compared} numbers compared: {replayed.words}")
    opt.write_result(json, replayed.json())
    if report is not None:
        from workbench.views.recording.session_report import write_page

        opt.say(f"report: {write_page(found, replayed, report)}")
    if replayed.differences:
        opt.fail(f"the replay differs from the recording: {replayed.words}")
