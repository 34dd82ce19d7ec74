"""Commands: review, replay."""

from pathlib import Path
from typing import Annotated

from workbench.base.wording import plural
from workbench.cli import options as opt
from workbench.cli.exit_status import in_section
from workbench.cli.options import argument, option

RecordingArgument = Annotated[Path, argument("A recording: a folder such as recordings/sample.")]


@in_section("Files")
def review(
    recording: RecordingArgument,
    web: Annotated[bool, option("--web", "Open the viewer in the browser.")] = False,
    out: Annotated[Path | None, option("Write the scene here (.rrd) instead of opening a viewer.")] = None,
) -> None:
    """Open a recorded session in the rerun viewer."""
    from workbench.session.journal.reader import read_recording

    found = read_recording(recording)
    opt.say_notes(found.notes)
    opt.check_writable(out)
    from workbench.extras.review.viewer import show_recording

    with opt.progress_bar("drawing"):
        show_recording(found, out=out, web=web, say=opt.say)
    if out is not None:
        opt.say(f"pictures: {out}")
    written = {"steps": len(found.lines), "notes": [*found.notes], "out": out and str(out)}
    opt.write_result({"schema": "workbench.review/1"} | written)


@in_section("Files")
def replay(
    recording: RecordingArgument, to: Annotated[int | None, option("Replay only up to this step.")] = None
) -> None:
    """Replay a recorded session and compare its numbers with the recorded ones."""
    from workbench.session.journal.reader import read_recording
    from workbench.session.journal.replay import restore

    found = read_recording(recording, to=to)
    opt.say_notes(found.notes)
    with opt.progress_bar("replay"):
        replayed = restore(found, is_computed=True)
    says = replayed.warning or "all the same"
    opt.say(f"{plural(len(found.lines), 'step')}, {replayed.compared} numbers compared: {says}")
    opt.write_result(replayed.json())
    if replayed.differences:
        opt.fail(f"the replay differs from the recording: {says}")
