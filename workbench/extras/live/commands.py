"""Commands: capture, drive."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.exit_status import at_once, in_section
from workbench.cli.options import option
from workbench.extras.live.options import lines_of, waiting


@in_section("Calibrate")
def capture(
    robot: opt.RobotOption,
    plate: Annotated[str, option("Plate: a .toml file, or the built-in table2.")],
    out: Annotated[Path, option("Write the measurements here (.csv), row by row.")],
    source: Annotated[str, option("--from", "- (standard input), HOST:PORT, or listen:HOST:PORT.")] = "-",
    session: Annotated[str, option("Name of this placement of robot and instrument.")] = "",
) -> None:
    """Guided measurement: move the arm to each target of a plate and store a row by a key or from the source.

    The source sends one JSON object per line. A tool more than 30 mm or 5° from its target is not stored.
    Keys: Enter or space stores, y stores for the target that the tool is at, f stores although the arm moves
    or is elsewhere, r retakes the shown target's row or else the last one, n and p go to the next and the
    previous target, q ends.
    """
    from rich.console import Console

    from workbench.extras.live import guided_measurement
    from workbench.extras.live.acquisition import Acquisition, plate_targets

    arm, fixture = wb.load_robot(robot), wb.load_plate(plate)
    opt.check_writable(out)
    taken = Acquisition(plate_targets(arm, fixture), robot=arm, session=session)
    console = Console(stderr=True)
    with lines_of(source) as lines, guided(console) as (keys, draw):
        done = guided_measurement.capture(
            taken,
            arm,
            lines,
            out,
            keys=keys,
            show=draw,
            say=lambda text: console.print(text, markup=False, highlight=False),
            source="stdin" if source == "-" else source,
        )
    opt.say(f"{len(done.data)} of {len(fixture)} targets, {taken.source}: {out}")
    if not done.is_complete and not done.is_by_hand:
        opt.fail(f"the source ended before all targets were measured: {len(done.data)} of {len(fixture)}")


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
    from workbench.extras.live.driver import DrivePace, drive_plate

    at_once()
    opt.check_writable(actual)
    hidden, samples = drive_plate(
        wb.load_robot(robot),
        wb.load_plate(plate),
        branch=branch,
        instrument=instrument,
        actual=None if of is None else wb.load_robot(of),
        pace=DrivePace(rate=rate),
        seed=seed,
    )
    if actual is not None:
        wb.write_toml(hidden, actual)
    with receiver(to) as write:
        send_samples(samples, write, speed=speed)


@contextmanager
def guided(console) -> Iterator[tuple]:
    """Keys and live view if the terminal supports both, otherwise neither."""
    from workbench.extras.live.display import keyboard, live_view

    if not console.is_terminal:
        yield None, None
        return
    with keyboard() as keys:
        if keys is None:
            yield None, None
            return
        with live_view(console) as show:
            yield keys, show


@contextmanager
def receiver(to: str) -> Iterator[Callable[[str], object]]:
    """Destination of the lines: standard output, or the first client that connects."""
    import os

    from workbench.extras.live.connection import first_listener

    if to != "-":
        with first_listener(to, ready=waiting) as send:
            yield send
        return

    def write(line: str) -> None:
        sys.stdout.write(line)
        sys.stdout.flush()

    yield write
    try:
        sys.stdout.flush()
    except BrokenPipeError:  # the reader has had enough; nothing more may be flushed at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
