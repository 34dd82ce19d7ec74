"""Recordings in the rerun viewer, and their pictures drawn again from the journal.

Where a file has no end, as that of a session that is running or was killed, they may lack what came last.
"""

import contextlib
import os
import secrets
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

os.environ.setdefault("RERUN_ANALYTICS_ENABLED", "false")
from rerun.chunk import RrdReader

from workbench.base.errors import FileError, OptionError
from workbench.base.files import write_bytes
from workbench.base.progress import progress
from workbench.session.journal.reader import Recording
from workbench.session.journal.replay import steps
from workbench.session.page_state import Severity
from workbench.session.view import Moment
from workbench.views.recording.canvas import STEP, Canvas
from workbench.views.recording.contents import MomentDrawing
from workbench.views.recording.recorder import parts
from workbench.views.recording.rerun_output import FileOutlet

ADDRESS = "127.0.0.1"
BEHIND = 5
"""Last commands that may have drawn no number, as the grab of a target."""


def show_recording(
    recording: Recording,
    *,
    out: Path | None = None,
    web: bool = False,
    say: Callable[[str], None] = lambda text: None,
) -> None:
    """Open a recording in the viewer, returning when it is closed; or write one file for it.

    Args:
        out: Write one file here instead of opening a viewer.
        web: Whether to open the viewer in the browser.
        say: Told what is done besides.
    """
    with tempfile.TemporaryDirectory(prefix="workbench-") as room:
        files = pictures_of(recording, Path(room), say=say)
        if out is None:
            _open(files, web)
        else:
            _join(files, out, Path(room))


def pictures_of(
    recording: Recording, room: Path, *, say: Callable[[str], None] = lambda text: None
) -> list[Path]:
    """Files that a viewer can open, showing the whole session.

    `room` is where those are made that the recording does not have as they should be.
    """
    files, last = parts(recording.folder), -1
    for path in files:
        if (shown := _last_step(path)) is None:
            say(f"note: {path.name} has no end, as of a session that is running or was killed")
            break
        last = max(last, shown)
    else:
        if last >= len(recording.lines) - BEHIND:
            return files
    say("note: the scene is redrawn from the journal")
    return [write_pictures(recording, room / "drawn.rrd")]


def _last_step(path: Path) -> int | None:
    """The last step that a file shows, by what nearly every step draws; None if its end is missing."""
    last = -1
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that the file has no index is what we are here for
            (reader := RrdReader(path)).store()  # which needs an end
            for chunk in reader.stream():
                if STEP in chunk.timeline_names and chunk.entity_path == "/predicted/position_mm":
                    steps = chunk.to_record_batch().column(STEP).to_pylist()
                    last = max(last, *steps)
    except Exception:
        return None
    return last


def _join(files: list[Path], out: Path, room: Path) -> Path:
    """One file of several, written whole or not at all."""
    joined = files[0]
    if len(files) > 1:
        joined = room / "joined.rrd"
        command = [_program(), "rrd", "merge", *map(str, files), "-o", str(joined)]
        if subprocess.run(command, capture_output=True, check=False).returncode != 0:
            raise FileError(
                f"the recording's parts can't be joined in {room}; free some space there", path=str(out)
            )
    return write_bytes(out, joined.read_bytes())


def _open(files: list[Path], web: bool) -> None:
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with contextlib.suppress(KeyboardInterrupt), opened(files if web else []) as links:
        shown = ["--web-viewer", *links] if web else map(str, files)
        program = subprocess.Popen([_program(), "--bind", ADDRESS, *shown], start_new_session=True)
        try:
            program.wait()
        finally:  # with what it has started itself
            with contextlib.suppress(ProcessLookupError):
                os.killpg(program.pid, signal.SIGTERM)
            if program.wait() > 0:
                raise OptionError("the rerun viewer could not be opened; try --web, or --out FILE.rrd")


def _program() -> str:
    return shutil.which("rerun", path=Path(sys.executable).parent) or "rerun"


class FileServer(ThreadingHTTPServer):
    """Serves some files to the viewer in the browser, each under a path that nobody can guess.

    rerun's own server gives a recording to whoever asks, a foreign page that has rebound its name included.
    Here a recording has a secret in its path, and a request must name this server as its host.
    """

    daemon_threads = True

    def __init__(self, files: Sequence[Path]):
        super().__init__((ADDRESS, 0), _Request)
        secret = secrets.token_urlsafe(16)
        self.host = f"{ADDRESS}:{self.server_port}"
        self.files: Mapping[str, Path] = {f"/{secret}/{i}/{path.name}": path for i, path in enumerate(files)}


class _Request(BaseHTTPRequestHandler):
    server: FileServer

    def do_GET(self) -> None:
        """Send the file; any page may read it that knows the path."""
        path = self.server.files.get(self.path)
        if path is None or self.headers.get_all("Host") != [self.server.host]:
            self.send_error(403)
            return
        with path.open("rb") as file, contextlib.suppress(ConnectionError):
            self.send_response(200)
            self.send_header("Content-Type", "application/octet-stream")
            self.send_header("Content-Length", str(path.stat().st_size))
            self.send_header("Access-Control-Allow-Origin", "*")
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            shutil.copyfileobj(file, self.wfile)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing."""


@contextlib.contextmanager
def opened(files: Sequence[Path]) -> Iterator[list[str]]:
    """Addresses of the files, while they are served."""
    with FileServer(files) as door:
        threading.Thread(target=door.serve_forever, name="workbench-door", daemon=True).start()
        try:
            yield [f"http://{door.host}{path}" for path in door.files]
        finally:
            door.shutdown()


def write_pictures(recording: Recording, path: Path) -> Path:
    """Do all commands again and draw them into a file for the viewer."""
    try:
        outlet = FileOutlet(path, recording.folder.name)
    except OSError as error:
        text = f"can't be written ({error.strerror}); choose another place"
        raise FileError(text, path=str(path)) from None
    drawing = MomentDrawing(Canvas([outlet]))
    for moment in moments(recording):
        drawing.draw(moment)
        progress(moment.step / max(len(recording.lines), 1), "drawing")
    drawing.end(len(recording.lines))
    outlet.close()
    if outlet.trouble:
        raise FileError(f"{outlet.trouble}; choose another place", path=str(path))
    return path


def moments(recording: Recording) -> Iterator[Moment]:
    """Every step of a recording, done again by what was kept of it."""
    yield Moment(0, 0.0, recording.first)
    again = steps(recording.first, recording.entries)
    for step, (line, session) in enumerate(zip(recording.lines, again, strict=True), start=1):
        shown = session
        for text in line.messages:
            if all(m.text != text for m in shown.page.messages):
                shown = shown.with_message(Severity.INFO, text)
        yield Moment(step, line.entry.at, shown, line.entry)
