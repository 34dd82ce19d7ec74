"""A live source: one JSON object a line becomes a `Sample`; lines come from a text stream or a local socket.

    {"time": 12.3, "q": [0.1, …], "xyz": [0.4, 0.1, 0.3], "quat": [1, 0, 0, 0], "capture": true}

All in SI; the quaternion is (w, x, y, z). `xyz` and `quat` may be left out or null.
"""

import ipaddress
import json
import socket
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import TextIO, final

import numpy as np
from jaxtyping import Float

from workbench.base import se3
from workbench.base.errors import (
    FileError,
    OptionError,
    ShapeError,
    WorkbenchError,
)
from workbench.base.types import frozen

NORM_TOLERANCE = 0.01
"""A quaternion whose norm differs from 1 by more than this is refused."""
LONGEST_LINE = 65536
"""A line of more characters is no sample."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Sample:
    """What a live source says at one time.

    Args:
        time: Time [s], by the source's clock.
        q: Joint positions [rad or m].
        position: Measured position of the tool point [m], measuring frame; None when not seen.
        rotation: Measured orientation; None when not seen.
        capture: Whether the source asks to keep this sample.
    """

    time: float
    q: Float[np.ndarray, " n"]
    position: Float[np.ndarray, "3"] | None = None
    rotation: Float[np.ndarray, "3 3"] | None = None
    capture: bool = False


def parse_sample(text: str, *, line: int, joints: int | None = None, source: str = "stream") -> Sample:
    """One line of a live source.

    Args:
        text: A JSON object.
        line: Its number, for messages.
        joints: Number of joints of the robot; None: any.
        source: Name of the source, for messages.

    Raises:
        FileError: It is no such object, or a value is no finite number.
        ShapeError: It has another number of joints.
    """
    if len(text) > LONGEST_LINE:
        raise FileError(f"the line has more than {LONGEST_LINE} characters", path=source, line=line)
    try:
        record = json.loads(text)
    except (ValueError, RecursionError):
        raise FileError(
            f'\'{text.strip()[:40]}\' is not a JSON object like {{"time": 0.1, "q": [0.0]}}',
            path=source,
            line=line,
        ) from None
    if not isinstance(record, dict):
        raise FileError("the line is JSON but no object {…}", path=source, line=line)
    q = _vector(record, "q", None, source, line)
    if q is None:
        raise FileError('the joint positions are missing: send "q": […] in rad', path=source, line=line)
    if joints is not None and len(q) != joints:
        raise ShapeError(
            f"{source}, line {line}: the sample has {len(q)} joints, the robot {joints}",
            expected=joints,
            found=len(q),
        )
    return Sample(
        time=_time(record, source, line),
        q=q,
        position=_vector(record, "xyz", 3, source, line),
        rotation=_rotation(record, source, line),
        capture=_flag(record, source, line),
    )


def _vector(record: dict, key: str, length: int | None, source: str, line: int) -> np.ndarray | None:
    """A list of finite numbers, or None when it is absent."""
    value = record.get(key)
    if value is None:
        return None
    plain = isinstance(value, list) and value and all(_is_number(v) for v in value)
    if not plain or (length is not None and len(value) != length):
        wanted = "a list of numbers" if length is None else f"a list of {length} numbers"
        raise FileError(f"it is not {wanted}", path=source, line=line, column=key)
    vector = np.array(value, dtype=float)
    if not np.isfinite(vector).all():
        raise FileError("a value is not finite", path=source, line=line, column=key)
    return frozen(vector)


def _is_number(value) -> bool:
    return isinstance(value, float | int) and not isinstance(value, bool) and abs(value) < 1e300


def _time(record: dict, source: str, line: int) -> float:
    value = record.get("time")
    if isinstance(value, float | int) and _is_number(value) and np.isfinite(value):
        return float(value)
    raise FileError("it is not a number of seconds", path=source, line=line, column="time")


def _rotation(record: dict, source: str, line: int) -> np.ndarray | None:
    quaternion = _vector(record, "quat", 4, source, line)
    if quaternion is None:
        return None
    norm = float(np.linalg.norm(quaternion))
    if abs(norm - 1.0) > NORM_TOLERANCE:
        raise FileError(
            f"the norm of [w, x, y, z] is {norm:.4g}, not 1", path=source, line=line, column="quat"
        )
    return frozen(se3.quaternion_to_matrix(quaternion))


def _flag(record: dict, source: str, line: int) -> bool:
    value = record.get("capture", False)
    if value is not None and not isinstance(value, bool):
        raise FileError("it is neither true nor false", path=source, line=line, column="capture")
    return bool(value)


def samples(
    lines: Iterable[str],
    *,
    joints: int | None = None,
    source: str = "stdin",
    on_error: Callable[[WorkbenchError], None] | None = None,
) -> Iterator[Sample]:
    """Samples of a source, as they come; blank lines are passed over.

    Args:
        lines: Lines of text: an open file, standard input, or `SocketLines`.
        joints: Number of joints of the robot; None: any.
        source: Name of the source, for messages.
        on_error: Is told of a bad line, which is then passed over; None: a bad line raises.

    Raises:
        FileError: A line is no sample.
        ShapeError: A sample has another number of joints.
    """
    for number, text in enumerate(lines, start=1):
        if not text.strip():
            continue
        try:
            sample = parse_sample(text, line=number, joints=joints, source=source)
        except WorkbenchError as error:
            if on_error is None:
                raise
            on_error(error)
            continue
        yield sample


def parse_address(text: str) -> tuple[str, int]:
    """Host and port of 'host:port', ':port' or 'port'.

    Raises:
        OptionError: It is no address.
    """
    host, _, port = text.strip().rpartition(":")
    if not port.isdecimal() or not 0 <= int(port) <= 65535:
        raise OptionError(f"'{text}' is no address: write host:port, e.g. localhost:5000")
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

    Raises:
        OptionError: It is no address.
        FileError: Nothing answers there.
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

    Raises:
        OptionError: It is no loopback address: measurements are not taken from the network unasked.
        FileError: The port is taken, or no source came in time.
    """
    host, _ = parse_address(address)
    if not _is_loopback(host):
        raise OptionError(
            f"'{host}' is not this machine: listen at localhost, or connect to the source instead"
        )
    connection = accept_one(address, timeout=timeout, ready=ready, nobody="no source came")
    return SocketLines(connection, name=address)


def accept_one(
    address: str,
    *,
    timeout: float | None,
    ready: Callable[[int], None] | None,
    nobody: str,
) -> socket.socket:
    """The first connection that comes to an address; the port is then free again.

    Args:
        address: HOST:PORT; port 0 for any free one.
        timeout: How long to wait [s]; None: for ever.
        ready: Told the port as soon as it can be connected to.
        nobody: Words for nobody coming in time.

    Raises:
        OptionError: it is no address.
        FileError: the port is taken, or nobody came in time.
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
