"""The commands. Each reads its input, calls one function of the package, and shows or writes the result.

Heavy modules are imported inside the commands, so that `workbench --help` responds immediately. How they end:
`exit_status.py`.
"""

import atexit
import contextlib
import gc
import signal
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from workbench.base.errors import FileError
from workbench.base.installed_package import package_version
from workbench.cli import calibration, measurements, plates
from workbench.cli import options as opt
from workbench.cli.exit_status import PROGRAM, Commands, run
from workbench.cli.options import option
from workbench.cli.sessions import open_session

ROBOTS, MEASUREMENTS = (".urdf", ".toml"), (".csv", ".tsv", ".txt", ".xlsx", ".parquet", ".mat")
"""File extensions that the app opens in place of a command."""
SERVED = ("data", "host", "port", "open_browser", "record", "rerun", "session", "json_file")
"""Options that name neither robot nor plate; without any others the user is asked, or the rows tell."""

app = typer.Typer(
    name=PROGRAM,
    help="Kinematic calibration of serial robot arms. Without a command: the app in the browser.",
    no_args_is_help=False,
    pretty_exceptions_enable=False,
    add_completion=False,
    rich_markup_mode=None,
    cls=Commands,
)


COLLECTED_EVERY = 700_000
"""Allocations between two garbage collections: more than imports, compilation and a small diagnosis make,
since commands create little garbage."""
USUALLY = gc.get_threshold()
"""Thresholds of the older generations."""


def main() -> None:
    """Entry point of the `workbench` command; without arguments, or with only a file, it opens the app."""
    gc.set_threshold(COLLECTED_EVERY)
    atexit.register(gc.freeze)  # a last collection would take a tenth of a short command's time
    warnings.showwarning = lambda message, *_, **__: print(f"workbench: {message}", file=sys.stderr)
    sys.exit(run(_carry_out, sys.argv[1:]))


def _carry_out(arguments: Sequence[str]) -> Any:
    return app(opened(list(arguments)), standalone_mode=False)  # typer would else swallow some exceptions


def opened(arguments: list[str]) -> list[str]:
    """Arguments of a command; a file instead of a command is opened in the app: robot or measurements."""
    if not arguments:
        return ["serve"]
    path = Path(arguments[0])
    if str(path).startswith("-") or not (ending := path.suffix.lower()):
        return arguments
    if ending in (*ROBOTS, *MEASUREMENTS):
        return ["serve", "--robot" if ending in ROBOTS else "--data", *arguments]
    known = ", ".join((*ROBOTS, *MEASUREMENTS))  # no command has a dot in its name
    why = f"the app opens files that end in {known}" if path.exists() else "there is no such file"
    raise FileError(why, path=str(path))


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"workbench {package_version()}")
        raise typer.Exit()


@app.callback()
def at_root(
    version: Annotated[
        bool, option("--version", "Show the version and exit.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Options of no command."""


@app.command(rich_help_panel="Start")
@opt.flattened
def serve(
    context: typer.Context,
    page: opt.PageOptions,
    robot: opt.RobotOption = "aria",
    plate: opt.PlateOption = None,
    data: Annotated[Path | None, option("Measurements to load at once.")] = None,
    port: Annotated[int | None, option("Port; 8090 or else any free one if not given.")] = None,
    host: Annotated[
        str, option("Address to listen on; anything but loopback is open to the network.")
    ] = "127.0.0.1",
    open_browser: Annotated[bool, option("--open/--no-open", "Open the page in the browser.")] = True,
    session: Annotated[
        Path | None, option("Continue this recording, or record here; recordings/DATE if not given.")
    ] = None,
    step: Annotated[
        int | None, option("With --session: branch off after this step, into a new recording.")
    ] = None,
    demo: Annotated[bool, option("--demo", "Play a demo of some minutes first.")] = False,
    record: Annotated[bool, option("--record/--no-record", "Record the session.")] = True,
    rerun: Annotated[
        str | None, option("Show the session in this open rerun viewer as well: HOST:PORT.")
    ] = None,
) -> None:
    """The app in the browser: robot, plate, draggable targets, identification."""
    from workbench.views.page.serve import serve as run

    gc.set_threshold(*USUALLY)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # the recording is closed as after Ctrl-C
    given = (context.get_parameter_source(name) for name in context.params if name not in SERVED)
    asks = all(source is None or source.name == "DEFAULT" for source in given)  # typer ships its own click
    opening = open_session(robot, plate, session=session, step=step, record=record, live=rerun)
    told: list[str] = []

    def ready(text: str) -> None:
        opt.say(f"{'note' if told else 'page'}:     {text}")
        told.append(text)

    def begin(*given: Any) -> Any:
        begun = opening["begin"](*given)
        folder = begun.folder and str(begun.folder)
        opt.write_result({"schema": "workbench.serve/1", "address": told[0], "session": folder})
        return begun

    with contextlib.ExitStack() as stack:
        beside = [stack.enter_context(companion.opened()) for companion in page.joined]
        run(
            **opening | {"begin": begin},
            data=data,
            demo=demo,
            beside=beside,
            asks=asks,
            host=host,
            port=port,
            open_browser=open_browser,
            on_ready=ready,
        )


PANELS: dict[str, tuple[Callable[..., None], ...]] = {
    "Start": (measurements.simulate, measurements.preview),
    "Calibrate": (calibration.identify, calibration.diagnose, calibration.evaluate),
    "Files": (calibration.export,),
}
"""Commands of the core by purpose, beside the group of plates."""
for panel, commands in PANELS.items():
    for command in commands:
        app.command(rich_help_panel=panel)(opt.flattened(command))
app.add_typer(plates.plates, rich_help_panel="Plates")
