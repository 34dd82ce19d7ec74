"""Tabs that the program can open. viser has no word for that: a page whose chosen tab is gone shows the first
one left, so all but the wanted tab are taken away until the page has drawn itself so, and told it.
"""

import itertools
import threading

import viser
from viser import _messages

from workbench.session.state import Tab
from workbench.views.page.told import Told

PATIENCE = 5.0
"""How long a page may take to draw itself; one in the background does not at all [s]."""


class Tabs:
    """The tab group of the panel.

    Args:
        server: Where.
        told: What its pages tell.
        first: The tab that a new page opens; None: the first one.
    """

    def __init__(self, server: viser.ViserServer, told: Told, *, first: Tab | None = None):
        self._server, self._told, self._opened = server, told, first
        self._numbers = itertools.count()
        self._group = server.gui.add_tab_group()
        server.on_client_connect(self._arrived)

    def add(self, tab: Tab) -> viser.GuiTabHandle:
        """One more tab, to be filled within `with`."""
        return self._group.add_tab(tab)

    def open(self, tab: Tab) -> None:
        """Open a tab on every page, and on those that come later."""
        self._opened = tab
        for client in self._server.get_clients().values():
            self._open_on(client, tab)

    def _arrived(self, client: viser.ClientHandle) -> None:
        if self._opened is not None:
            self._open_on(client, self._opened)

    def _open_on(self, client: viser.ClientHandle, tab: Tab) -> None:
        threading.Thread(target=self._opening, args=(client, tab), name="workbench-tab", daemon=True).start()

    def _opening(self, client: viser.ClientHandle, tab: Tab) -> None:
        self._send(client, slice(k := self._group._tab_labels.index(tab), k + 1))
        sign, event = self._told.drawn(f"tab-{next(self._numbers)}")
        shown = client.gui.add_html(sign)
        event.wait(PATIENCE)
        shown.remove()
        if tab is self._opened:  # or else the next one brings the others back
            self._send(client, slice(None))

    def _send(self, client: viser.ClientHandle, which: slice) -> None:
        if client.client_id not in self._server.get_clients():
            return
        names = ("_tab_labels", "_tab_icons_html", "_tab_container_ids")
        some = {name: getattr(self._group, name)[which] for name in names}
        client.gui._websock_interface.queue_message(_messages.GuiUpdateMessage(self._group._impl.uuid, some))
