"""A recording's pictures, drawn from its journal."""

from collections.abc import Callable, Iterator
from pathlib import Path

from workbench.errors import FileError
from workbench.record.blueprint import blueprint
from workbench.record.canvas import Canvas
from workbench.record.drawing import Drawing, thinned
from workbench.record.entities import Moment
from workbench.record.outlet import FileOutlet
from workbench.session.journal.reader import Recording
from workbench.session.journal.replay import steps
from workbench.session.state import Severity

Progress = Callable[[float, str], None]


def write_pictures(recording: Recording, path: Path, *, progress: Progress | None = None) -> Path:
    """Do all commands again and draw them into a file for the viewer.

    Raises:
        FileError: it can't be written.
    """
    trouble: list[str] = []
    try:
        outlet = FileOutlet(
            path, recording.folder.name, blueprint=blueprint(recording.first), tell=trouble.append
        )
    except OSError as error:
        raise FileError(
            f"can't be written ({error.strerror}); choose another place", path=str(path)
        ) from None
    canvas = Canvas([outlet])
    draw_all(recording, canvas, progress=progress)
    canvas.close()
    if trouble:
        raise FileError("can't be written as a whole; is the disk full?", path=str(path))
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
