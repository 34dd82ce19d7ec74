"""The command of a virtual source, drive, and the option of serve that connects to a source."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, final

import workbench as wb
from workbench.base.errors import OptionError
from workbench.cli import options as opt
from workbench.cli.exit_status import in_section
from workbench.cli.option_records import AbstractCompanion
from workbench.cli.options import option

if TYPE_CHECKING:
    from workbench.session.view import AbstractView
    from workbench.session.worker import Worker


@final
@dataclass(frozen=True)
class LiveOption(AbstractCompanion):
    """A live source that tells where a real arm stands."""

    source: Annotated[str | None, option("Follow and measure a real arm: HOST:PORT of its live source.")] = (
        None
    )

    @contextmanager
    def opened(self) -> "Iterator[Callable[[Worker], AbstractView | None]]":
        from workbench.extras.live.connection import connect
        from workbench.extras.live.sources import LiveSource, end_former

        if self.source is None:
            yield end_former
            return
        name = self.source
        with connect(name) as lines:
            yield lambda worker: LiveSource(worker, lines, name=name)


@in_section("Calibrate")
def drive(
    robot: opt.RobotOption,
    plate: Annotated[str, option("Plate: a .toml file, or the built-in table2.")],
    to: Annotated[str, option("HOST:PORT to listen at for workbench serve --source.")] = "localhost:5000",
    speed: Annotated[float, option("Speed-up over real time; 0: without waiting.")] = 1.0,
    actual: Annotated[Path | None, option("Write the hidden actual arm here (.toml).")] = None,
    seed: opt.SeedOption = 0,
) -> None:
    """A virtual arm in place of a real driver: JSON lines of an arm moving from target to target."""
    from workbench.extras.live.connection import accept_one, send_samples
    from workbench.extras.live.driver import drive_plate

    if not speed >= 0.0:
        raise OptionError(f"--speed must be at least 0 (0: without waiting), got {speed:g}")
    opt.check_writable(actual)
    hidden, samples = drive_plate(wb.load_robot(robot), wb.load_plate(plate), seed=seed)
    if actual is not None:
        wb.write_toml(hidden, actual)

    with accept_one(to, ready=lambda port: sys.stderr.write(f"waiting at port {port}\n")) as connection:
        send_samples(samples, connection, speed=speed)
    opt.write_result({"schema": "workbench.drive/1", "robot": hidden.name})
