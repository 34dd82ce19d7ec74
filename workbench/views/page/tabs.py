"""Tabs that the program can open. viser has no word for that: a page whose chosen tab is gone shows the first
one left, so all but the wanted tab are taken away for a moment.
"""

import threading

import viser
from viser import _messages

from workbench.session.state import Tab

MOMENT, ARRIVAL = 0.15, 1.0
"""How long the other tabs are gone, and how long a new page is given to draw itself [s]."""


class Tabs:
    """The tab group of the panel.

    Args:
        server: Where.
        first: The tab that a new page opens; None: the first one.
    """

    def __init__(self, server: viser.ViserServer, *, first: Tab | None = None):
        self._server, self._opened = server, first
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
            threading.Timer(ARRIVAL, self._open_on, (client, self._opened)).start()

    def _open_on(self, client: viser.ClientHandle, tab: Tab) -> None:
        labels = self._group._tab_labels
        self._send(client, slice(k := labels.index(tab), k + 1))
        later = threading.Timer(MOMENT, self._send, (client, slice(None)))
        later.daemon = True
        later.start()

    def _send(self, client: viser.ClientHandle, which: slice) -> None:
        names = ("_tab_labels", "_tab_icons_html", "_tab_container_ids")
        some = {name: getattr(self._group, name)[which] for name in names}
        client.gui._websock_interface.queue_message(_messages.GuiUpdateMessage(self._group._impl.uuid, some))
