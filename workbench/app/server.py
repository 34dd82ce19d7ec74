"""The app: a session, its worker, and a page that shows it."""

import signal
import threading
import webbrowser
from collections.abc import Callable
from pathlib import Path

import viser

from workbench.app.demo import Demo
from workbench.app.html import block
from workbench.app.local import EVERYWHERE, LOOPBACK, local_server, stop_server
from workbench.app.render import BrowserView
from workbench.design.plate import Plate
from workbench.errors import FileError, OptionError
from workbench.robots.robot import Robot
from workbench.session.commands import CHORES, LoadData
from workbench.session.journal.folder import Begun, unrecorded
from workbench.session.steering import VirtualDriver
from workbench.session.worker import Worker

Begin = Callable[[Robot, Plate], Begun]
PORT = 8090
"""Port that is tried first where none is asked for."""


class App:
    """A running app.

    Args:
        robot: Nominal robot.
        plate: Fixture with its targets.
        data: Measurement file to begin with.
        host: Address to listen at.
        port: Port; 0 for any free one; None for the usual one, or any free one where that is taken.
        begin: Makes the session of robot and plate, with what follows it, such as a recording.
        demo: Pace of the demo that plays at first, 1 for two minutes; None: no demo.
        on_bound: Told the page's address as soon as it can be opened, before the session is worked out.
    """

    def __init__(
        self,
        robot: Robot,
        plate: Plate,
        *,
        data: Path | str | None = None,
        host: str = "127.0.0.1",
        port: int | None = 0,
        begin: Begin = unrecorded,
        demo: float | None = None,
        on_bound: Callable[[str], None] | None = None,
    ):
        first = None if data is None else _file(data)
        self.server = _serve(host, port)
        waiting = self.server.gui.add_html(block("Working out how the arm reaches the targets …"))
        if on_bound is not None:
            on_bound(self.url)
        try:
            begun = begin(robot, plate)
        except BaseException:
            stop_server(self.server)
            raise
        waiting.remove()
        self.worker = Worker(begun.session, keepers=begun.keepers, journal=begun.entries, chores=CHORES)
        self.view = BrowserView(self.server, self.worker)
        self.worker.add_view(self.view)
        self.worker.add_view(VirtualDriver(self.worker))
        if first is not None:
            self.worker.submit(first)
        self.demo = None if demo is None else Demo(self.worker, pace=demo)

    @property
    def url(self) -> str:
        """Address of the page."""
        host = self.server.get_host()
        return f"http://{LOOPBACK[0] if host in EVERYWHERE else host}:{self.server.get_port()}"

    def close(self) -> None:
        """Stop the demo, the worker and the server."""
        if self.demo is not None:
            self.demo.stop()
        self.worker.close()
        stop_server(self.server)


def serve(
    robot: Robot,
    plate: Plate,
    *,
    data: Path | str | None = None,
    host: str = "127.0.0.1",
    port: int | None = None,
    open_browser: bool = True,
    begin: Begin = unrecorded,
    demo: bool = False,
    on_ready: Callable[[str], None] | None = None,
) -> None:
    """Show the page until interrupted.

    Args:
        robot: Nominal robot.
        plate: Fixture with its targets.
        data: Measurement file to begin with.
        host: Address to listen at; anything but the loopback address lets other machines in.
        port: Port; None for the usual one, or any free one where that is taken.
        open_browser: Whether to open the page in the user's browser.
        begin: Makes the session of robot and plate, with what follows it, such as a recording.
        demo: Whether a story of two minutes plays at first.
        on_ready: Told the page's address as soon as it can be opened.

    Raises:
        OptionError: the port is taken or can't be used.
        FileError: the measurement file can't be opened.
    """

    def bound(url: str) -> None:
        if on_ready is not None:
            on_ready(url)
        if open_browser:
            webbrowser.open(url)

    app, stop = None, threading.Event()
    before = signal.signal(signal.SIGINT, _stopped_by_interrupt(stop))
    try:
        pace = 1.0 if demo else None
        app = App(robot, plate, data=data, host=host, port=port, begin=begin, demo=pace, on_bound=bound)
        stop.wait()
    except KeyboardInterrupt:
        pass
    finally:
        signal.signal(signal.SIGINT, before)
        if app is not None:
            app.close()


def _stopped_by_interrupt(stop: threading.Event) -> Callable[[int, object], None]:
    """A handler that asks to stop: an exception raised in the midst of a library may be lost there.

    A second interrupt ends the program wherever it is.
    """

    def handle(number: int, frame: object) -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        stop.set()

    return handle


def _serve(host: str, port: int | None) -> viser.ViserServer:
    if port is not None:
        return local_server(host=host, port=port, label="Workbench")
    try:
        return local_server(host=host, port=PORT, label="Workbench")
    except OptionError:
        return local_server(host=host, port=0, label="Workbench")


def _file(path: Path | str) -> LoadData:
    try:
        return LoadData(Path(path).name, Path(path).read_bytes())
    except OSError as error:
        raise FileError(
            f"can't be opened ({error.strerror}); give a measurement file", path=str(path)
        ) from None
