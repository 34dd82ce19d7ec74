"""What pages tell the server: viser has no message for it, so a page asks for a picture that is not there.

The address of the picture is what is told. It holds a secret, so that no other page can tell anything.
"""

import threading
from collections.abc import Callable

import viser

from workbench.views.page.local_server import LocalServer

STYLE = 'width="1" height="1" style="position:absolute;opacity:0"'


class Told:
    """What the pages of a server tell.

    Args:
        server: Another one than a local server is told nothing.
    """

    def __init__(self, server: viser.ViserServer):
        self._server = server
        self._waiting: dict[str, threading.Event] = {}
        self._answers: dict[str, Callable[[], None]] = {}
        if isinstance(server, LocalServer):
            server.heard = self._heard

    def dark(self, do: Callable[[bool], None]) -> str:
        """HTML that tells whether the page's system prefers dark colours, now and when that changes."""
        self._answers |= {"dark": lambda: do(True), "light": lambda: do(False)}
        dark = f'<source media="(prefers-color-scheme: dark)" srcset="{self._address("dark")}">'
        return f'<picture>{dark}<img src="{self._address("light")}" alt="" {STYLE}></picture>'

    def drawn(self, words: str) -> tuple[str, threading.Event]:
        """HTML that tells once it is on the page, and what is set then."""
        event = self._waiting[words] = threading.Event()
        return f'<img src="{self._address(words)}" alt="" {STYLE}>', event

    def _heard(self, words: str) -> None:
        if (event := self._waiting.pop(words, None)) is not None:
            event.set()
        elif words in self._answers:
            self._answers[words]()

    def _address(self, words: str) -> str:
        return self._server.telling + words if isinstance(self._server, LocalServer) else ""
