"""Transport of samples: lines of text over TCP sockets."""

import ipaddress
import socket
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import TextIO

from workbench.base.errors import FileError, OptionError
from workbench.extras.live.sample import LONGEST_LINE, Sample, format_sample

TIMEOUT = 5.0
"""Longest wait for a connection [s]; lines may then come at any pace."""

Ready = Callable[[int], None]
"""Told the port as soon as it can be connected to."""


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


@contextmanager
def listen(address: str, *, ready: Ready) -> Iterator[Iterator[str]]:
    """Lines of the first source that connects to 'host:port' of this machine."""
    host, _ = parse_address(address)
    if not _is_loopback(host):
        raise OptionError(
            f"'{host}' is not this machine: listen at localhost, or connect to the source instead"
        )
    with lines_from(accept_one(address, ready=ready)) as lines:
        yield lines


def accept_one(address: str, *, ready: Ready) -> socket.socket:
    """The first connection that comes to 'host:port' (0: any free port); the port is then free again."""
    try:
        with socket.create_server(parse_address(address)) as server:
            ready(server.getsockname()[1])
            return server.accept()[0]
    except OSError as error:
        raise FileError(
            f"can't listen there ({error.strerror or error}): choose another port", path=address
        ) from None


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def send_samples(samples: Iterable[Sample], write: Callable[[str], object], *, speed: float = 1.0) -> None:
    """Write samples as lines, each when its time has come, until the other side goes away.

    Args:
        samples: In the order of their times.
        write: Takes a line with its end.
        speed: How many times faster than the samples' clock; 0: without waiting.
    """
    if not speed >= 0.0:
        raise OptionError(f"--speed must be at least 0 (0: without waiting), got {speed:g}")
    began = time.monotonic()
    with suppress(BrokenPipeError, ConnectionError):
        for sample in samples:
            if speed > 0.0:
                time.sleep(max(began + sample.time / speed - time.monotonic(), 0.0))
            write(format_sample(sample) + "\n")
