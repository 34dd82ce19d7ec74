"""Single keys from the terminal, even where standard input carries something else."""

import os
import select
import threading
from collections.abc import Iterator
from contextlib import contextmanager

LOOK = 0.05
"""How often the reading looks whether it is still wanted [s]."""


@contextmanager
def keyboard() -> Iterator[Iterator[str] | None]:
    """Keys as they are struck; None where there is no terminal to strike them in.

    The terminal gives single keys without echo inside the block, and is as before after it.
    """
    terminal = _open()
    if terminal is None:
        yield None
        return
    import termios
    import tty

    before, stop = termios.tcgetattr(terminal), threading.Event()
    try:
        tty.setcbreak(terminal)
        yield _keys(terminal, stop)
    finally:
        stop.set()
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)


def _open() -> int | None:
    """The controlling terminal, if there is one and we stand in its foreground."""
    try:
        import termios

        terminal = os.open("/dev/tty", os.O_RDONLY)
    except (ImportError, OSError):
        return None
    try:
        termios.tcgetattr(terminal)
        if os.tcgetpgrp(terminal) == os.getpgrp():
            return terminal
    except (OSError, termios.error):
        pass
    os.close(terminal)
    return None


def _keys(terminal: int, stop: threading.Event) -> Iterator[str]:
    """Keys until told to stop; closes the terminal itself, so that nothing else is ever read."""
    try:
        while not stop.is_set():
            if not select.select([terminal], [], [], LOOK)[0]:
                continue
            read = os.read(terminal, 32)
            if not read:
                return
            if not read.startswith(b"\x1b"):  # an arrow or the like
                yield from read.decode(errors="ignore")
    finally:
        os.close(terminal)
