"""Guided measuring in the terminal: target, deviation, standstill, rows stored; and single keys.

Everything fits into 80 columns. Lengths in mm, angles in degrees, axes of the measuring frame.
"""

import os
import select
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from workbench.base import se3
from workbench.base.types import Matrix4, Vector3
from workbench.extras.live.acquisition import ALIGNED, MAX_ANGLE, MAX_DISTANCE, NEAR, ArmState, Status

KEYS = "Enter stores · y as seen · f forces · r retakes · n/p next/previous · q ends"
NO_VALUE, DEGREES = "–", 180.0 / np.pi
MARKS = 50
"""Targets that the line of marks shows."""


@contextmanager
def live_view(console: Console) -> Iterator[Callable[[Status], None]]:
    """A function that redraws the status in place."""
    with Live(console=console, auto_refresh=False, transient=True) as live:
        yield lambda status: live.update(render(status), refresh=True)


def render(status: Status) -> RenderableType:
    """The whole view of one status."""
    lines: list[RenderableType] = [_heading(status), _table(status), _state(status), _marks(status)]
    if status.message:
        lines.append(Text(status.message, style="yellow" if "not stored" in status.message else "green"))
    lines.append(Text(KEYS, style="dim"))
    return Group(*lines)


def _heading(status: Status) -> Text:
    taken = sum(status.stored)
    text = Text(f"{status.name} of {len(status.stored)}", style="bold")
    return text.append(f"   {taken} stored, {len(status.stored) - taken} to go", style="")


def _table(status: Status) -> Table:
    """Target pose, present pose and their difference."""
    table = Table(box=None, padding=(0, 1), pad_edge=False)
    table.add_column("", width=9)
    for name in ("x", "y", "z", "mm"):
        table.add_column(name, justify="right", width=9)
    for name in ("roll/x", "pitch/y", "yaw/z"):
        table.add_column(name, justify="right", width=7)
    table.add_row("target", *_pose(status.target))
    turned = not status.measured or status.rotation is not None or status.target is None
    table.add_row("measured" if status.measured else "by model", *_pose(status.pose, turned=turned))
    off = "–" if status.position is None else _size(status.position, 1e3, NEAR, MAX_DISTANCE)
    table.add_row("off", *_parts(status.position, 1e3), off, *_parts(status.rotation, DEGREES))
    return table


def _pose(pose: Matrix4 | None, *, turned: bool = True) -> list[str]:
    if pose is None:
        return [NO_VALUE] * 7
    turn = [f"{DEGREES * v:z.2f}" for v in se3.matrix_to_rpy(pose[:3, :3])] if turned else [NO_VALUE] * 3
    return [*(f"{1e3 * v:z.2f}" for v in pose[:3, 3]), "", *turn]


def _parts(values: Vector3 | None, scale: float) -> list[str]:
    """The three components, with their signs."""
    return [NO_VALUE] * 3 if values is None else [f"{scale * v:+z.2f}" for v in values]


def _size(values: Vector3, scale: float, near: float, far: float) -> Text:
    """The length, green where it is small, red where the tool is not at the target."""
    size = float(np.linalg.norm(values))
    colour = "green" if size < near else "yellow" if size <= far else "red"
    return Text(f"{scale * size:.2f}", style=f"bold {colour}")


def _state(status: Status) -> Text:
    """Whether the arm stands still, and the remaining angle."""
    if status.silence > 0.0:
        return Text(f"the source has been silent for {status.silence:.0f} s", style="bold red")
    if status.arm_state is None:
        return Text("waiting for the first sample", style="yellow")
    text = Text(
        f"the arm {status.arm_state}", style="green" if status.arm_state is ArmState.STILL else "yellow"
    )
    if status.rotation is not None:
        text.append("   angle off ", style="").append(
            _size(status.rotation, DEGREES, ALIGNED, MAX_ANGLE)
        ).append("°")
    return text


def _marks(status: Status) -> Text:
    """One mark a target: stored, current, to come; a window of them where they are many."""
    first = max(0, min(status.current - MARKS // 2, len(status.stored) - MARKS))
    text = Text("")
    for i in range(first, min(first + MARKS, len(status.stored))):
        mark = "▶" if i == status.current else ("●" if status.stored[i] else "·")
        text.append(mark, style="bold" if i == status.current else ("green" if status.stored[i] else "dim"))
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
