"""The command of a virtual source: drive."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.exit_status import at_once, in_section
from workbench.cli.options import option
from workbench.extras.live.options import waiting


@in_section("Calibrate")
def drive(
    robot: opt.RobotOption,
    plate: Annotated[str, option("Plate: a .toml file, or the built-in table2.")],
    to: Annotated[str, option("- (standard output), or HOST:PORT to listen on.")] = "-",
    instrument: Annotated[
        str, option("Instrument: tracker-6d, laser-tracker …; plate: none, the seat fixes the tool.")
    ] = "tracker-6d",
    branch: Annotated[str, option("designed, mixed, auto (one branch), or a branch by name.")] = "designed",
    rate: Annotated[float, option("Samples per second.")] = 50.0,
    speed: Annotated[float, option("Speed-up over real time; 0: without waiting.")] = 1.0,
    actual: Annotated[Path | None, option("Write the hidden actual arm here (.toml).")] = None,
    of: Annotated[str | None, option("Drive this arm instead of one with hidden errors.")] = None,
    seed: opt.SeedOption = 0,
) -> None:
    """A virtual arm in place of a real driver: JSON lines of an arm moving from target to target."""
    from workbench.extras.live.connection import send_samples
    from workbench.extras.live.driver import drive_plate

    at_once()
    opt.check_writable(actual)
    hidden, samples = drive_plate(
        wb.load_robot(robot),
        wb.load_plate(plate),
        branch=branch,
        instrument=instrument,
        actual=None if of is None else wb.load_robot(of),
        rate=rate,
        seed=seed,
    )
    if actual is not None:
        wb.write_toml(hidden, actual)
    with receiver(to) as write:
        send_samples(samples, write, speed=speed)


@contextmanager
def receiver(to: str) -> Iterator[Callable[[str], object]]:
    """Destination of the lines: standard output, or the first client that connects."""
    import os

    from workbench.extras.live.connection import accept_one

    if to != "-":
        with accept_one(to, ready=waiting) as connection:
            yield lambda line: connection.sendall(line.encode())
        return

    def write(line: str) -> None:
        sys.stdout.write(line)
        sys.stdout.flush()

    yield write
    try:
        sys.stdout.flush()
    except BrokenPipeError:  # the reader has had enough; nothing more may be flushed at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
