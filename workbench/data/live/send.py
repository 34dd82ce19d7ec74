"""Lines to whoever takes them: a text stream or the first that connects, at the pace of a clock."""

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TextIO

from workbench.base.errors import OptionError
from workbench.data.live.stream import Sample, accept_one
from workbench.data.simulation.driver import format_sample


def send_samples(samples: Iterable[Sample], write: Callable[[str], object], *, speed: float = 1.0) -> int:
    """Write samples as lines, each when its time has come.

    Args:
        samples: In the order of their times.
        write: Takes a line with its end.
        speed: How many times faster than the samples' clock; 0: without waiting.

    Returns:
        How many were taken; fewer than all when the other side went away.

    Raises:
        OptionError: a negative speed.
    """
    if not speed >= 0.0:
        raise OptionError(f"the speed must be 0 (without waiting) or above, not {speed:g}")
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
    """A `write` for a text stream that keeps nothing back."""

    def write(line: str) -> None:
        stream.write(line)
        stream.flush()

    return write


@contextmanager
def first_listener(
    address: str, *, timeout: float | None = None, ready: Callable[[int], None] | None = None
) -> Iterator[Callable[[str], object]]:
    """A `write` for the first that connects to 'host:port'.

    Args:
        address: Where to wait; port 0 picks a free one.
        timeout: Longest wait for anybody [s]; None: for ever.
        ready: Is told the port as soon as others can connect.

    Raises:
        OptionError: it is no address.
        FileError: the port is taken, or nobody came in time.
    """
    with accept_one(address, timeout=timeout, ready=ready, nobody="nobody connected") as connection:
        yield lambda line: connection.sendall(line.encode())
