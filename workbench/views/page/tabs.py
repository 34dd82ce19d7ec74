"""Tabs that the program can open. viser has no word for that: a page whose chosen tab is gone shows the first
one left, so all but the wanted tab are taken away until the page has drawn itself so, and told it.
"""

import itertools
import json
import re
import threading
from collections.abc import Callable
from functools import partial

import viser

from workbench.session.page_state import Tab
from workbench.views.page.local_server import LocalServer
from workbench.views.page.viser_internals import run_script, show_tabs, tab_number

SIZED = """{
  const tell = () => { new Image().src = `ADDRESS${innerWidth}x${innerHeight}`; };
  let soon;
  addEventListener("resize", () => { clearTimeout(soon); soon = setTimeout(tell, 400); });
  tell();
}"""
STYLE = 'width="1" height="1" style="position:absolute;opacity:0"'


class PageSignals:
    """Messages from the pages of a local server: viser has no message for it, so a page asks for a picture.

    The picture is not there; its address is the message. It holds a secret, so that no other page can send
    one.
    """

    def __init__(self, server: viser.ViserServer):
        self._server = server
        self._waiting: dict[str, threading.Event] = {}
        self._answers: dict[str, Callable[[], None]] = {}
        self._sized: dict[str, Callable[[int, int], None]] = {}
        if isinstance(server, LocalServer):
            server.heard = self._heard

    def dark(self, do: Callable[[bool], None]) -> str:
        """HTML that reports whether the page's system prefers dark colours, now and when that changes."""
        self._answers |= {"dark": lambda: do(True), "light": lambda: do(False)}
        dark = f'<source media="(prefers-color-scheme: dark)" srcset="{self._address("dark")}">'
        return f'<picture>{dark}<img src="{self._address("light")}" alt="" {STYLE}></picture>'

    def turned(self, do: Callable[[Tab], None]) -> None:
        """Have every page tell which of its tabs is open, also a page that comes later."""
        addresses = {tab: self.pressed(f"open-{tab}", partial(do, tab)) for tab in Tab}
        run_script(self._server.gui, f"window.tabs = {json.dumps(addresses)};")

    def sized(self, client: viser.ClientHandle, do: Callable[[int, int], None]) -> None:
        """Have a client's page tell the width and height of its window [px], now and when they change: the
        camera's are those of the scene, without a docked panel, in the screen's pixels."""
        self._sized[name := f"window-{client.client_id}"] = do
        address = self._address(f"{name}-")
        run_script(client.gui, SIZED.replace("ADDRESS", address))

    def pressed(self, text: str, do: Callable[[], None]) -> str:
        """Where a link leads that does something: a page gets no answer there, and stays as it is."""
        self._answers[text] = do
        return self._address(text)

    def drawn(self, text: str) -> tuple[str, threading.Event]:
        """HTML that tells once it is on the page, and what is set then."""
        event = self._waiting[text] = threading.Event()
        return f'<img src="{self._address(text)}" alt="" {STYLE}>', event

    def _heard(self, text: str) -> None:
        if (event := self._waiting.pop(text, None)) is not None:
            event.set()
        elif text in self._answers:
            self._answers[text]()
        elif size := re.fullmatch(r"(window-\d+)-(\d{1,5})x(\d{1,5})", text):
            name, width, height = size.groups()
            if (do := self._sized.get(name)) is not None:
                do(int(width), int(height))

    def _address(self, text: str) -> str:
        return self._server.message_path + text if isinstance(self._server, LocalServer) else ""


PATIENCE = 5.0
"""How long a page may take to draw itself; one in the background does not at all [s]."""


class Tabs:
    """The tab group of the panel; a new page opens the `first` one, or else the leftmost."""

    def __init__(self, server: viser.ViserServer, signals: PageSignals, *, first: Tab | None = None):
        self._server, self._signals, self._opened = server, signals, first
        self._numbers = itertools.count()
        self._latest: dict[int, str] = {}
        self._group = server.gui.add_tab_group()

    def add(self, tab: Tab) -> viser.GuiTabHandle:
        """One more tab, to be filled within `with`."""
        return self._group.add_tab(tab)

    def show(self, is_shown: bool) -> None:
        """Show the tabs, or leave their place to something else."""
        self._group.visible = is_shown

    def ready(self) -> None:
        """All tabs are there: open the first one on every page, those included that have come before it."""
        self._server.on_client_connect(self._arrived)

    def open(self, tab: Tab) -> None:
        """Open a tab on every page, and on those that come later."""
        self._opened = tab
        for client in self._server.get_clients().values():
            self.open_on(client, tab)

    def _arrived(self, client: viser.ClientHandle) -> None:
        if self._opened is not None:
            self.open_on(client, self._opened)

    def open_on(self, client: viser.ClientHandle, tab: Tab) -> None:
        threading.Thread(target=self._opening, args=(client, tab), name="workbench-tab", daemon=True).start()

    def _opening(self, client: viser.ClientHandle, tab: Tab) -> None:
        self._send(client, slice(k := tab_number(self._group, tab), k + 1))
        sign, event = self._signals.drawn(f"tab-{next(self._numbers)}")
        self._latest[client.client_id] = sign
        shown = client.gui.add_html(sign)
        event.wait(PATIENCE)
        shown.remove()
        if self._latest.get(client.client_id) is sign:  # or else the next one brings the others back
            self._send(client, slice(None))

    def _send(self, client: viser.ClientHandle, which: slice) -> None:
        if client.client_id not in self._server.get_clients():
            return
        show_tabs(client, self._group, which)
