"""A recorder for a session's folder, and for a viewer that is open."""

from pathlib import Path

from workbench.session.state import Session
from workbench.views.recording.blueprint import blueprint
from workbench.views.recording.canvas import Canvas
from workbench.views.recording.outlet import (
    AbstractOutlet,
    FileOutlet,
    Tell,
    ViewerOutlet,
)
from workbench.views.recording.recorder import Recorder

STEM = "session"


def recorder(folder: Path | None, *, live: str | None = None) -> Recorder:
    """Draws a session into its folder, and into an open viewer.

    Args:
        folder: The session's recording; None if there is none.
        live: Address of a viewer; None if there is none.
    """

    def open_canvas(session: Session, tell: Tell) -> Canvas:
        layout = blueprint(session)
        name = "session" if folder is None else folder.name
        outlets: list[AbstractOutlet] = []
        if folder is not None:
            outlets.append(FileOutlet(_part(folder), name, blueprint=layout, tell=tell))
        if live is not None:
            outlets.append(ViewerOutlet(live, name, blueprint=layout))
        return Canvas(outlets)

    return Recorder(open_canvas)


def parts(folder: Path) -> list[Path]:
    """Pictures of a recording: one file for every time that it was opened."""
    numbered = sorted(folder.glob(f"{STEM}-*.rrd"), key=lambda p: (len(p.name), p.name))
    first = folder / f"{STEM}.rrd"
    return [*([first] if first.exists() else []), *numbered]


def _part(folder: Path) -> Path:
    """The file for this time: nothing is written over."""
    count = len(parts(folder))
    return folder / (f"{STEM}.rrd" if count == 0 else f"{STEM}-{count + 1}.rrd")
