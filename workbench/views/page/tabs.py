"""Tabs that the program can open, and what pages tell it."""

import json
import re
from collections.abc import Callable
from functools import partial

import viser

from workbench.session.page_state import Tab
from workbench.views.page.local_server import LocalServer
from workbench.views.page.viser_internals import run_script

SIZED = """{
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const tell = () => {
    new Image().src = `ADDRESS${innerWidth}x${innerHeight}${dark.matches ? "-dark" : ""}`;
  };
  let soon;
  addEventListener("resize", () => { clearTimeout(soon); soon = setTimeout(tell, 400); });
  dark.addEventListener("change", tell);
  tell();
}"""


class PageSignals:
    """Messages from the pages of a local server: viser has no message for it, so a page asks for a picture.

    The picture is not there; its address is the message. It holds a secret, so that no other page can send
    one.
    """

    def __init__(self, server: viser.ViserServer):
        self._server = server
        self._answers: dict[str, Callable[[], None]] = {}
        self._told: dict[str, Callable[[int, int, bool], None]] = {}
        if isinstance(server, LocalServer):
            server.heard = self._heard

    def turned(self, do: Callable[[Tab], None]) -> None:
        """Have every page tell which of its tabs is open, also a page that comes later."""
        addresses = {tab: self.pressed(f"open-{tab}", partial(do, tab)) for tab in Tab}
        run_script(self._server.gui, f"window.tabs = {json.dumps(addresses)};")

    def told(self, client: viser.ClientHandle, do: Callable[[int, int, bool], None]) -> None:
        """Have a client's page tell the width and height of its window [px], and whether its system prefers
        dark colours, now and when they change: the camera's size is that of the scene, without a docked
        panel, in the screen's pixels."""
        self._told[name := f"window-{client.client_id}"] = do
        address = self._address(f"{name}-")
        run_script(client.gui, SIZED.replace("ADDRESS", address))

    def pressed(self, text: str, do: Callable[[], None]) -> str:
        """Where a link leads that does something: a page gets no answer there, and stays as it is."""
        self._answers[text] = do
        return self._address(text)

    def _heard(self, text: str) -> None:
        if text in self._answers:
            self._answers[text]()
        elif window := re.fullmatch(r"(window-\d+)-(\d{1,5})x(\d{1,5})(-dark)?", text):
            name, width, height, dark = window.groups()
            if (do := self._told.get(name)) is not None:
                do(int(width), int(height), bool(dark))

    def _address(self, text: str) -> str:
        return self._server.message_path + text if isinstance(self._server, LocalServer) else ""


class Tabs:
    """The tab group of the panel; a new page opens the `first` one, or else the leftmost.

    viser has no word for opening a tab: a script of the page's presses it (`style.py`).
    """

    def __init__(self, server: viser.ViserServer, *, first: Tab | None = None):
        self._server, self._opened = server, first
        self.group = server.gui.add_tab_group()
        server.on_client_connect(
            lambda client: self.open_on(client, self._opened)
        )  # pages that are there, too

    def open(self, tab: Tab) -> None:
        """Open a tab on every page, and on those that come later."""
        self._opened = tab
        for client in self._server.get_clients().values():
            self.open_on(client, tab)

    def open_on(self, client: viser.ClientHandle, tab: Tab | None) -> None:
        if tab is not None:
            run_script(client.gui, f"window.wanted = {json.dumps(tab)};")
