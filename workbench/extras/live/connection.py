"""Lines of text from a live source, over a TCP socket."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TextIO

from workbench.base.errors import FileError, OptionError
from workbench.extras.live.sample import LONGEST_LINE

TIMEOUT = 5.0
"""Longest wait for a connection [s]; lines may then come at any pace."""


def parse_address(text: str) -> tuple[str, int]:
    """Host and port of 'host:port', ':port' or 'port'."""
    host, _, port = text.strip().rpartition(":")
    if not port.isdecimal() or not 0 <= int(port) <= 65535:
        raise OptionError(f"address must be host:port, such as localhost:5000, got '{text}'")
    return host.strip("[]") or "127.0.0.1", int(port)


@contextmanager
def lines_from(connection: socket.socket) -> Iterator[Iterator[str]]:
    """Lines of text from a socket; the end of the block ends the iteration, in whichever thread."""
    connection.settimeout(None)
    file = connection.makefile("r", encoding="utf-8", errors="replace", newline="\n")
    try:
        yield _lines(file)
    finally:
        with suppress(OSError):
            connection.shutdown(socket.SHUT_RDWR)
        connection.close()
        with suppress(OSError, ValueError):
            file.close()


def _lines(file: TextIO) -> Iterator[str]:
    with suppress(OSError, ValueError):  # closed by us, or cut off by the other side
        while line := file.readline(LONGEST_LINE + 2):
            yield line


@contextmanager
def connect(address: str) -> Iterator[Iterator[str]]:
    """Lines of a source that listens at 'host:port'."""
    try:
        connection = socket.create_connection(parse_address(address), timeout=TIMEOUT)
    except OSError as error:
        raise FileError(
            f"nothing answers there ({error.strerror or error}): start the source first", path=address
        ) from None
    with lines_from(connection) as lines:
        yield lines
