"""Commands: review, replay."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from workbench.base.errors import OptionError
from workbench.base.wording import plural
from workbench.cli import options as opt
from workbench.cli.exit_status import at_once, in_section
from workbench.cli.options import argument, option

if TYPE_CHECKING:
    from workbench.extras.review.compare_sessions import ComparedSessions

RecordingArgument = Annotated[Path, argument("A recording: a folder such as recordings/sample.")]


@in_section("Files")
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
    from workbench.extras.review.viewer import show_recordings

    with opt.progress_bar("drawing"):
        pictures = show_recordings(found, compared=compared, out=out, web=web, say=opt.say)
    if out is not None:
        opt.say(f"pictures: {pictures}")


def _compare(found: list, json: Path | None) -> "ComparedSessions":
    """Differences, and parameters that moved beyond their standard errors."""
    from workbench.extras.review.compare_sessions import compare

    with opt.progress_bar("replay"):
        compared = compare(found)
    opt.say_notes(compared.notes)
    opt.show(compared.tables())
    opt.write_result(json, compared.json())
    return compared


@in_section("Files")
def replay(
    recording: RecordingArgument,
    to: Annotated[int | None, option("Replay only up to this step.")] = None,
    report: Annotated[Path | None, option("Write the session's report here (.html), one file.")] = None,
    json: opt.JsonOption = None,
) -> None:
    """Replay a recorded session and compare its numbers with the recorded ones."""
    from workbench.session.journal.reader import read_recording
    from workbench.session.journal.restore import restore

    opt.check_writable(report, json)
    found = read_recording(recording, to=to)
    opt.say_notes(found.notes)
    with opt.progress_bar("replay"):
        replayed = restore(found, is_computed=True)
    opt.say(f"{plural(len(found.lines), 'step')}, {replayed.compared} numbers compared: {replayed.text}")
    opt.write_result(json, replayed.json())
    if report is not None:
        from workbench.extras.review.session_report import write_page

        opt.say(f"report: {write_page(found, replayed, report)}")
    if replayed.differences:
        opt.fail(f"the replay differs from the recording: {replayed.text}; {replayed.reason}")
