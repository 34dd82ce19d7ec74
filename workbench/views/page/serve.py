"""Serving the app until it is interrupted.

The page can be opened before the program has read its own modules, which takes most of the start: the
browser loads meanwhile.
"""

import contextlib
import gc
import os
import signal
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import viser

from workbench.base.errors import OptionError
from workbench.base.files import read_bytes
from workbench.base.threads import one_thread
from workbench.views.page.html import block
from workbench.views.page.local_server import is_open, local_server, page_address, stop_server

PORT = 8090
"""Port that is tried first where none is asked for."""


def serve(
    robot: Any,
    plate: Any,
    *,
    data: Path | str | None = None,
    host: str = "127.0.0.1",
    port: int | None = None,
    open_browser: bool = True,
    begin: Callable | None = None,
    demo: bool = False,
    source: tuple[str, Iterable[str]] | None = None,
    asks: bool = False,
    on_ready: Callable[[str], None] | None = None,
) -> None:
    """Show the page until interrupted.

    Args:
        robot: Nominal robot.
        plate: Fixture with its targets.
        data: Measurement file, or folder of pictures, to begin with.
        host: Address to listen at; anything but the loopback address lets other machines in.
        port: Port; 0 for any free one; None for the usual one, or any free one where that is taken.
        open_browser: Whether to open the page in the user's browser.
        begin: Makes the session of robot and plate, with what follows it; None: one that is not recorded.
        demo: Whether a story of two minutes plays at first.
        source: Name and lines of a live source that tells where a real arm stands.
        asks: Whether a card asks first what the user has.
        on_ready: Told the page's address as soon as it can be opened.

    Raises:
        OptionError: the port is taken or can't be used.
        FileError: the measurement file can't be opened.
    """
    first = None if data is None else _content(Path(data))
    stop = threading.Event()
    before = signal.signal(signal.SIGINT, _stopped_by_interrupt(stop))
    names: list[str] = []  # of the session on the page, once there is one
    server = bound(host, port, lambda: names[0] if names else "")
    end: Callable[[], None] = partial(stop_server, server)
    try:
        waiting = server.gui.add_html(block("Working out how the arm reaches the targets …"))
        _announce(server, on_ready, open_browser)
        with _without_collection():
            from workbench.session.journal.folder import unrecorded
            from workbench.views.page.app import App

            with one_thread():
                begun = (begin or unrecorded)(robot, plate)
            waiting.remove()
            names.append(begun.name)
            pace = 1.0 if demo else None
            app = App(
                robot, plate, begun=begun, data=first, server=server, demo=pace, source=source, asks=asks
            )
            end = app.close
        with one_thread():
            stop.wait()
    except KeyboardInterrupt:
        pass
    finally:
        signal.signal(signal.SIGINT, before)
        end()


def _content(data: Path) -> tuple[str, bytes]:
    """Name and contents of a file; of a folder of pictures, those of its archive."""
    if data.is_dir():
        from workbench.data.camera.folder import packed

        return f"{data.resolve().name}.tar", packed(data)
    return data.name, read_bytes(data, wanted="a measurement file")


@contextlib.contextmanager
def _without_collection() -> Iterator[None]:
    """What a start makes stays for good: to look through it for garbage takes a quarter of the time.

    Later collections leave it out too, so that no drag waits for one.
    """
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


def bound(host: str, port: int | None, shown: Callable[[], str] = str) -> viser.ViserServer:
    """A server at a port; at the usual one, or any free one where that is taken, if None."""
    bind = partial(local_server, host=host, shown=shown)
    if port is not None:
        return bind(port=port)
    try:
        return bind(port=PORT)
    except OptionError:
        return bind(port=0)


def _announce(server: viser.ViserServer, on_ready: Callable[[str], None] | None, open_browser: bool) -> None:
    url = page_address(server)
    if on_ready is not None:
        on_ready(url)
        if is_open(server):
            on_ready("Anybody in the network who has this link can steer the workbench.")
    if open_browser and _has_browser():
        webbrowser.open(url)


def _has_browser() -> bool:
    """Whether there is a screen for a browser; one for terminals would only cover what is said there."""
    screens = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    return sys.platform in ("darwin", "win32") or any(os.environ.get(name) for name in screens)


def _stopped_by_interrupt(stop: threading.Event) -> Callable[[int, object], None]:
    """A handler that asks to stop: an exception raised inside a library may be lost there.

    A second interrupt ends the program wherever it is.
    """

    def handle(number: int, frame: object) -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        stop.set()

    return handle
