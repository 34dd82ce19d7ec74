"""Guided measuring in the terminal: target, deviation, standstill, rows stored; and single keys.

Everything fits into 80 columns. Lengths in mm, angles in degrees, axes of the measuring frame.
"""

import os
import select
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from rich.console import Console
from rich.live import Live
from rich.text import Text

from workbench.extras.live.acquisition import ALIGNED, MAX_ANGLE, MAX_DISTANCE, NEAR, Status
from workbench.extras.live.standstill import ArmState

KEYS = "Enter stores · y as seen · f forces · r retakes · n/p next/previous · q ends"


@contextmanager
def live_view(console: Console) -> Iterator[Callable[[Status], None]]:
    """A function that redraws the status in place."""
    with Live(console=console, auto_refresh=False, transient=True) as live:
        yield lambda status: live.update(render(status), refresh=True)


def render(status: Status) -> Text:
    """The whole view of one status."""
    taken, count = sum(status.stored), len(status.stored)
    lines = [
        Text(f"{status.name} of {count}   {taken} stored, {count - taken} to go", style="bold"),
        _state(status),
        _deviation(status),
    ]
    if status.message:
        lines.append(Text(status.message, style="yellow" if "not stored" in status.message else "green"))
    return Text("\n").join([*lines, Text(KEYS, style="dim")])


def _state(status: Status) -> Text:
    """Whether the arm stands still."""
    if status.silence > 0.0:
        return Text(f"the source has been silent for {status.silence:.0f} s", style="bold red")
    if status.arm_state is None:
        return Text("waiting for the first sample", style="yellow")
    is_still = status.arm_state is ArmState.STILL
    return Text(f"the arm {status.arm_state}", style="green" if is_still else "yellow")


def _deviation(status: Status) -> Text:
    """How far the tool is from the target, along the axes and about them."""
    text = Text("measured" if status.is_measured else "by the nominal model").append(", off by ")
    for name, values, unit, scale, near, far in (
        ("x y z", status.position, "mm", 1e3, NEAR, MAX_DISTANCE),
        ("about them", status.rotation, "°", np.rad2deg(1.0), ALIGNED, MAX_ANGLE),
    ):
        if values is not None:
            size = float(np.linalg.norm(values))
            colour = "green" if size < near else "yellow" if size <= far else "red"
            parts = " ".join(f"{scale * v:+z.2f}" for v in values)
            text.append(f"{scale * size:.2f} {unit}", style=f"bold {colour}").append(f" ({name} {parts}) ")
    return text


LOOK = 0.05
"""Interval at which the key reader checks whether to stop [s]."""


@contextmanager
def keyboard() -> Iterator[Iterator[str] | None]:
    """Keys as they are pressed; None without a terminal.

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
    """The controlling terminal, if there is one and this process is in its foreground."""
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
