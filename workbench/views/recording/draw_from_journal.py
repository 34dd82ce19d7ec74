"""A recording's pictures, drawn from its journal."""

from collections.abc import Callable, Iterator
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from workbench.base.errors import FileError
from workbench.session.journal.reader import Recording
from workbench.session.journal.replay import steps
from workbench.session.state import Severity
from workbench.views.recording.blueprint import blueprint, side_by_side
from workbench.views.recording.canvas import Canvas
from workbench.views.recording.compare_sessions import compare
from workbench.views.recording.draw_steps import Drawing, thinned
from workbench.views.recording.moment import Moment
from workbench.views.recording.rerun_output import FileOutlet

Progress = Callable[[float, str], None]


def write_pictures(recording: Recording, path: Path, *, progress: Progress | None = None) -> Path:
    """Do all commands again and draw them into a file for the viewer.

    Raises:
        FileError: it can't be written.
    """
    outlet = _outlet(path, recording.folder.name, blueprint(recording.first))
    draw_all(recording, Canvas([outlet]), progress=progress)
    return _finish(outlet, path)


def _outlet(path: Path, name: str, layout: rrb.Blueprint) -> FileOutlet:
    try:
        return FileOutlet(path, name, blueprint=layout)
    except OSError as error:
        raise FileError(
            f"can't be written ({error.strerror}); choose another place", path=str(path)
        ) from None


def _finish(outlet: FileOutlet, path: Path) -> Path:
    """The file, if it is whole."""
    outlet.close()
    if outlet.trouble:
        raise FileError(f"{outlet.trouble}; choose another place", path=str(path))
    return path


def draw_all(recording: Recording, canvas: Canvas, *, progress: Progress | None = None) -> None:
    """Draw every step of a recording onto a canvas."""
    drawing = Drawing(canvas)
    for moment in thinned(moments(recording)):
        drawing.draw(moment)
        if progress is not None:
            progress(moment.step / max(len(recording.lines), 1), "drawing")


def moments(recording: Recording) -> Iterator[Moment]:
    """Every step of a recording, done again."""
    yield Moment(0, 0.0, recording.first)
    again = steps(recording.first, recording.entries)
    for step, (line, session) in enumerate(zip(recording.lines, again, strict=True), start=1):
        said = session
        for text in line.says:
            if all(m.text != text for m in said.messages):
                said = said.tell(Severity.INFO, text)
        yield Moment(step, line.entry.at, said, line.entry)


def write_comparison(first: Recording, second: Recording, path: Path) -> Path:
    """Two sessions in one file, below `A/` and `B/`, with the table of what differs."""
    layout = side_by_side(first.first, second.first)
    outlet = _outlet(path, f"{first.folder.name} with {second.folder.name}", layout)
    for prefix, recording in (("A/", first), ("B/", second)):
        draw_all(recording, Canvas([outlet], prefix=prefix))
    text = compare([first, second]).markdown()
    Canvas([outlet]).log("differences", rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)
    return _finish(outlet, path)
