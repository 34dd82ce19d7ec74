"""Serving the app until it is interrupted.

The page can be opened as soon as the arm is read: the browser loads while the program reads the modules that
only the session needs.
"""

import gc
import os
import signal
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any

import viser

from workbench.base.files import read_bytes
from workbench.base.threads import one_thread
from workbench.views.page.html import block, text
from workbench.views.page.local_server import LocalServer, bound, page_address
from workbench.views.page.viser_internals import stop_server


def serve(
    read: Callable[[], tuple[Any, Any]],
    *,
    data: Path | str | None = None,
    host: str = "127.0.0.1",
    port: int | None = None,
    open_browser: bool = True,
    begin: Callable | None = None,
    sentence: str = "Solving inverse kinematics for the targets",
    demo: bool = False,
    beside: Iterable[Callable] = (),
    asks: bool = False,
    on_ready: Callable[[str], None] | None = None,
) -> None:
    """Show the page until interrupted.

    Args:
        read: Reads the nominal robot and the fixture with its targets; None as the fixture for one that is
            made for the arm. What it raises comes out, and nobody has been told of the page.
        data: Measurement file, or folder of pictures, to begin with.
        host: Address to listen at; anything but the loopback address lets other machines in.
        port: Port; 0 for any free one; None for the usual one, or any free one where that is taken.
        open_browser: Whether to open the page in the user's browser.
        begin: Makes the session of robot and plate, with what follows it; tells how far it is. None: one that
            is not recorded.
        sentence: What the page says until then.
        demo: Whether the demo plays first.
        beside: As of `App`.
        asks: Whether the start card is shown.
        on_ready: Told the page's address as soon as it can be opened.
    """
    first = None if data is None else _content(Path(data))
    before, stop = signal.getsignal(signal.SIGINT), threading.Event()
    server = bound(host, port)
    end: Callable[[], None] = partial(stop_server, server)
    try:
        waiting = server.gui.add_html(block(f"{text(sentence)} …"))
        robot, plate = read()
        signal.signal(signal.SIGINT, _stopped_by_interrupt(stop))
        _announce(server, on_ready, open_browser)

        def tell(part: float, step: str) -> None:
            waiting.content = block(f"{text(sentence)} … {100 * part:.0f} % ({text(step)})")

        from workbench.session.start import default_circle
        from workbench.views.page.app import App

        if stop.is_set():  # between the steps of the start, which itself is not broken off anywhere
            return
        with one_thread():
            plate = default_circle(robot) if plate is None else plate
            begun = begin(robot, plate, tell) if begin else None
        waiting.remove()
        app = App(
            robot,
            plate,
            begun=begun,
            data=first,
            server=server,
            demo=1.0 if demo else None,
            beside=beside,
            asks=asks,
        )
        end = app.close
        gc.freeze()  # no drag waits for a look through all that a start makes
        with one_thread():
            stop.wait()
    finally:
        signal.signal(signal.SIGINT, before)
        end()


def _content(data: Path) -> tuple[str, bytes]:
    """Name and contents of a file; of a folder, those of its archive."""
    if data.is_dir():
        from workbench.session.commands.data import packed

        return packed(data)
    return data.name, read_bytes(data, wanted="a measurement file")


def _announce(server: viser.ViserServer, on_ready: Callable[[str], None] | None, open_browser: bool) -> None:
    url = page_address(server)
    if on_ready is not None:
        on_ready(url)
        if isinstance(server, LocalServer) and server.key:  # other machines can reach it
            on_ready("Anyone on the network who has this link can control the workbench.")
    if open_browser and _has_browser():
        webbrowser.open(url)


def _has_browser() -> bool:
    """Whether there is a screen for a browser; a text browser would only cover the terminal's output."""
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
