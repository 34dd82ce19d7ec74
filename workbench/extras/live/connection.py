"""Transport of samples: text streams and TCP sockets."""

import ipaddress
import socket
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import TextIO, final

from workbench.base.errors import FileError, OptionError
from workbench.extras.live.sample import LONGEST_LINE, Sample, format_sample


def parse_address(text: str) -> tuple[str, int]:
    """Host and port of 'host:port', ':port' or 'port'."""
    host, _, port = text.strip().rpartition(":")
    if not port.isdecimal() or not 0 <= int(port) <= 65535:
        raise OptionError(f"address must be host:port, such as localhost:5000, got '{text}'")
    return host.strip("[]") or "127.0.0.1", int(port)


@final
class SocketLines:
    """Lines of text from a socket; `close`, from any thread, ends the iteration."""

    def __init__(self, connection: socket.socket, *, name: str):
        self.name = name
        self._connection = connection
        self._file: TextIO = connection.makefile("r", encoding="utf-8", errors="replace", newline="\n")

    def __iter__(self) -> Iterator[str]:
        while True:
            try:
                line = self._file.readline(LONGEST_LINE + 2)
            except (OSError, ValueError):  # closed by us, or cut off by the other side
                return
            if not line:
                return
            yield line

    def __enter__(self) -> "SocketLines":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the connection; may be called twice."""
        with suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)
        self._connection.close()
        with suppress(OSError, ValueError):
            self._file.close()


def connect(address: str, *, timeout: float = 5.0) -> SocketLines:
    """Lines of a source that listens at 'host:port'.

    Args:
        address: Where the source listens.
        timeout: Longest wait for the connection [s]; lines may then come at any pace.
    """
    host, port = parse_address(address)
    try:
        connection = socket.create_connection((host, port), timeout=timeout)
    except OSError as error:
        raise FileError(
            f"nothing answers there ({error.strerror or error}): start the source first", path=address
        ) from None
    connection.settimeout(None)
    return SocketLines(connection, name=address)


def listen(
    address: str, *, timeout: float | None = None, ready: Callable[[int], None] | None = None
) -> SocketLines:
    """Lines of the first source that connects to 'host:port' of this machine.

    Args:
        address: Loopback address; port 0 picks a free one.
        timeout: Longest wait for a source [s]; None: for ever.
        ready: Is told the port as soon as sources can connect.
    """
    host, _ = parse_address(address)
    if not _is_loopback(host):
        raise OptionError(
            f"'{host}' is not this machine: listen at localhost, or connect to the source instead"
        )
    connection = accept_one(address, timeout=timeout, ready=ready, nobody="no source connected")
    return SocketLines(connection, name=address)


def accept_one(
    address: str, *, timeout: float | None, ready: Callable[[int], None] | None, nobody: str
) -> socket.socket:
    """The first connection that comes to an address; the port is then free again.

    Args:
        address: HOST:PORT; port 0 for any free one.
        timeout: How long to wait [s]; None: for ever.
        ready: Told the port as soon as it can be connected to.
        nobody: Words for nobody coming in time.
    """
    host, port = parse_address(address)
    try:
        with socket.create_server((host, port)) as server:
            server.settimeout(timeout)
            if ready is not None:
                ready(server.getsockname()[1])
            connection, _ = server.accept()
    except TimeoutError:
        raise FileError(f"{nobody} within {timeout:g} s", path=address) from None
    except OSError as error:
        raise FileError(
            f"can't listen there ({error.strerror or error}): choose another port", path=address
        ) from None
    connection.settimeout(None)
    return connection


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def send_samples(samples: Iterable[Sample], write: Callable[[str], object], *, speed: float = 1.0) -> int:
    """Write samples as lines, each when its time has come.

    Args:
        samples: In the order of their times.
        write: Takes a line with its end.
        speed: How many times faster than the samples' clock; 0: without waiting.

    Returns:
        How many were written; fewer than all when the other side went away.
    """
    if not speed >= 0.0:
        raise OptionError(f"--speed must be at least 0 (0: without waiting), got {speed:g}")
    began, count = time.monotonic(), 0
    for sample in samples:
        if speed > 0.0:
            time.sleep(max(began + sample.time / speed - time.monotonic(), 0.0))
        try:
            write(format_sample(sample) + "\n")
        except (BrokenPipeError, ConnectionError):
            break
        count += 1
    return count


def writer_to(stream: TextIO) -> Callable[[str], object]:
    """A `write` for a text stream that flushes every line."""

    def write(line: str) -> None:
        stream.write(line)
        stream.flush()

    return write


@contextmanager
def first_listener(
    address: str, *, timeout: float | None = None, ready: Callable[[int], None] | None = None
) -> Iterator[Callable[[str], object]]:
    """A `write` for the first client that connects to 'host:port'; arguments and errors as `accept_one`."""
    with accept_one(address, timeout=timeout, ready=ready, nobody="nobody connected") as connection:
        yield lambda line: connection.sendall(line.encode())
