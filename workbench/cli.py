"""The commands. Each one reads, calls one function of `pipeline`, and shows or writes what came back.

Everything heavy is imported inside the commands, so that `workbench --help` answers at once. A mistake of
the user ends with one sentence on standard error and exit status 1; nothing is then written.
"""

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from workbench.errors import OptionError, WorkbenchError

app = typer.Typer(
    name="workbench",
    help="Kinematic calibration of serial robot arms. Without a command: the app in the browser.",
    no_args_is_help=False,
    pretty_exceptions_enable=False,
    add_completion=False,
    rich_markup_mode=None,
)

RobotOption = Annotated[
    str,
    typer.Option(
        "--robot", help="Robot: a .toml or .urdf file, or a built-in arm such as aria, ur10, panda."
    ),
]
JsonOption = Annotated[Path | None, typer.Option("--json", help="Write the result here, machine-readable.")]
DataArgument = Annotated[Path, typer.Argument(help="Measurements: CSV, TSV, xlsx, parquet or .mat.")]
ColumnsOption = Annotated[
    str | None, typer.Option(help='What the columns are, for files without headings: "q1[deg],…,x[mm],…".')
]
SheetOption = Annotated[str | None, typer.Option(help="Sheet of a workbook.")]
LayoutOption = Annotated[str | None, typer.Option(help="Name of a known special layout of a file.")]
PlateOption = Annotated[str | None, typer.Option(help="Plate: a .toml file, or the built-in table2.")]
SeedOption = Annotated[int, typer.Option(help="Seed of everything random.")]


def main() -> None:
    """Entry point of the `workbench` command; alone it opens the app on ARIA and its ten-target plate."""
    try:
        app(sys.argv[1:] or ["serve"])
    except WorkbenchError as error:
        print(f"workbench: {error}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("workbench: stopped", file=sys.stderr)
        sys.exit(130)
    except BrokenPipeError:
        sys.exit(0)


@app.command()
def serve(
    robot: RobotOption = "aria",
    plate: PlateOption = "table2",
    data: Annotated[Path | None, typer.Option(help="Measurements to load at once.")] = None,
    port: Annotated[int, typer.Option(help="Port; 0 takes a free one.")] = 8080,
    host: Annotated[
        str, typer.Option(help="Address to listen on; others than loopback are open to the network.")
    ] = "127.0.0.1",
    open_browser: Annotated[
        bool, typer.Option("--open/--no-open", help="Open the page in the browser.")
    ] = True,
) -> None:
    """The app in the browser: robot, plate, draggable targets, identification."""
    from workbench.app.server import serve as run

    run(robot, plate or "table2", data=data, host=host, port=port, open_browser=open_browser)


@app.command()
def identify(
    data: DataArgument,
    robot: RobotOption,
    algorithm: Annotated[str, typer.Option(help="ols, opt1, opt2, or all.")] = "all",
    held_out: Annotated[
        str, typer.Option(help="Share of rows to hold out, a file of held-out rows, or session:NAME.")
    ] = "0.2",
    frames: Annotated[
        str, typer.Option(help="shared, per-session, or auto: base and tool over sessions.")
    ] = "auto",
    region: Annotated[
        str | None, typer.Option(help="Keep only rows inside the region of this plate.")
    ] = None,
    save: Annotated[
        Path | None, typer.Option(help="Write the calibrated robot here (.toml or .urdf).")
    ] = None,
    report: Annotated[Path | None, typer.Option(help="Write an HTML report into this folder.")] = None,
    json: JsonOption = None,
    free: Annotated[str | None, typer.Option(help="Constants to identify, comma-separated.")] = None,
    exclude: Annotated[
        str | None, typer.Option(help="Data rows to keep out, comma-separated, from 0.")
    ] = None,
    bounds: Annotated[
        list[str] | None, typer.Option(help="Bound for OPT1, in SI: joint1.theta=-0.1:0.1. May be repeated.")
    ] = None,
    noise: Annotated[
        str | None, typer.Option(help='Standard deviations of the instrument: "0.05mm,0.01deg".')
    ] = None,
    loss: Annotated[str, typer.Option(help="squares, huber, or tukey: how outlying rows count.")] = "squares",
    prior: Annotated[
        Path | None, typer.Option(help="An earlier result (--json) of this robot, as prior knowledge.")
    ] = None,
    renew: Annotated[
        str | None, typer.Option(help="With --prior: joints that were replaced, such as 3 or 3,4.")
    ] = None,
    seed: SeedOption = 0,
    columns: ColumnsOption = None,
    sheet: SheetOption = None,
    layout: LayoutOption = None,
) -> None:
    """Identify the arm's geometry from measurements, and report its error on held-out rows."""
    from workbench import pipeline
    from workbench.design.plate_toml import load_plate
    from workbench.report import json as reports
    from workbench.report import table
    from workbench.robots import load_robot

    arm = load_robot(robot)
    rows = _read(data, arm, columns, sheet, layout)
    _check_writable(save, json, folder=report)
    with _progress("identify") as progress:
        run = pipeline.identify(
            arm,
            rows,
            algorithms=tuple(pipeline.ALGORITHMS) if algorithm == "all" else tuple(algorithm.split(",")),
            held_out=_held_out(held_out, arm, columns, sheet, layout),
            frames=frames,
            free=_names(free),
            exclude=dict.fromkeys(_numbers(exclude, "--exclude"), "by hand"),
            region=None if region is None else load_plate(region).region,
            bounds=_bounds(bounds or []),
            noise=None if noise is None else _noise(noise),
            loss=loss,
            prior=None if prior is None else reports.read_prior(prior, renew=_numbers(renew, "--renew")),
            seed=seed,
            progress=progress,
        )
    table.print_identification(run)
    if save is not None:
        _say(f"calibrated robot ({run.best.fit.title}): {_save_robot(run.best.calibrated, save)}")
    if json is not None:
        _say(f"result: {reports.write_json(reports.identification(run), json)}")
    if report is not None:
        from workbench.report.html import write_report

        _say(f"report: {write_report(run, report)}")
    if not run.best.fit.outcome.ok:
        raise typer.Exit(2)


@app.command()
def evaluate(
    data: DataArgument,
    robot: RobotOption,
    frames: Annotated[str, typer.Option(help="given: fit nothing; fit: fit only base and tool.")] = "given",
    json: JsonOption = None,
    columns: ColumnsOption = None,
    sheet: SheetOption = None,
    layout: LayoutOption = None,
) -> None:
    """Errors of a nominal or calibrated robot on measurements; nothing of the arm is fitted."""
    from workbench import pipeline
    from workbench.report import json as reports
    from workbench.report import table
    from workbench.robots import load_robot

    if frames not in ("given", "fit"):
        raise OptionError(f"--frames can't be '{frames}'; choose given or fit")
    arm = load_robot(robot)
    _check_writable(json)
    found = pipeline.evaluate(arm, _read(data, arm, columns, sheet, layout), fit_frames=frames == "fit")
    table.print_evaluation(found)
    if json is not None:
        _say(f"result: {reports.write_json(reports.evaluation(found), json)}")


@app.command()
def simulate(
    robot: RobotOption,
    out: Annotated[Path, typer.Option(help="Write the measurements here.")],
    plate: PlateOption = None,
    poses: Annotated[int | None, typer.Option(help="Number of poses, instead of a plate.")] = None,
    index: Annotated[
        str, typer.Option(help="With --poses: random, or the index to maximise, O or O1 … O5.")
    ] = "random",
    instrument: Annotated[
        str | None, typer.Option(help="What measures: plate, laser-tracker, tracker-6d …")
    ] = None,
    branch: Annotated[
        str, typer.Option(help="With --plate: designed, mixed, auto (one branch), or a branch by name.")
    ] = "designed",
    effect: Annotated[str | None, typer.Option(help="A hidden effect; none are known yet.")] = None,
    actual: Annotated[Path | None, typer.Option(help="Write the hidden actual arm here (.toml).")] = None,
    of: Annotated[
        str | None, typer.Option(help="Measure this arm instead of one with hidden errors.")
    ] = None,
    seed: SeedOption = 0,
) -> None:
    """A virtual arm with hidden manufacturing errors, measured."""
    from workbench import pipeline
    from workbench.design.plate_toml import load_plate
    from workbench.measure.writer import write_measurements
    from workbench.robots import load_robot
    from workbench.robots.toml import write_toml

    if effect is not None:
        raise OptionError("--effect: there are no hidden effects yet; leave the option out")
    if (plate is None) == (poses is None):
        raise OptionError("give either --plate FILE or --poses NUMBER")
    if poses is not None and poses < 1:
        raise OptionError(f"--poses must be 1 or more, not {poses}")
    _check_writable(out, actual)
    arm = load_robot(robot)
    options = {"actual": None if of is None else load_robot(of), "seed": seed}
    with _progress("simulate") as progress:
        if plate is not None:
            hidden, rows = pipeline.measure_plate(
                arm,
                load_plate(plate),
                branch=branch,
                instrument=instrument or "plate",
                progress=lambda part: progress(part, "choosing branches"),
                **options,
            )
        else:
            hidden, rows = pipeline.measure_poses(
                arm,
                poses,
                index=index,
                instrument=instrument or "tracker-6d",
                progress=lambda part: progress(part, "choosing poses"),
                **options,
            )
    sliding = [i for i, joint in enumerate(arm.moving) if joint.kind == "prismatic"]
    write_measurements(rows, out, prismatic=sliding)
    _say(f"{len(rows)} rows of a virtual {arm.name}: {out}")
    if actual is not None:
        _say(f"hidden actual arm: {write_toml(hidden, actual)}")


@app.command()
def poses(
    robot: RobotOption,
    number: Annotated[int, typer.Option(help="How many poses.")],
    index: Annotated[str, typer.Option(help="Observability index to maximise: O, or O1 … O5.")] = "O1",
    candidates: Annotated[
        Path | None, typer.Option("--from", help="Choose from the rows of this file.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write the joint positions here (.csv).")] = None,
    json: JsonOption = None,
    seed: SeedOption = 0,
) -> None:
    """Informative poses for a calibration: those with the largest observability index."""
    from workbench import pipeline
    from workbench.report import table
    from workbench.robots import load_robot

    arm = load_robot(robot)
    _check_writable(out, json)
    with _progress("poses") as progress:
        found = pipeline.choose_poses(
            arm,
            number,
            index=index,
            seed=seed,
            candidates=candidates,
            progress=lambda part: progress(part, f"raising {index}"),
        )
    table.print_poses(arm, found)
    if out is not None:
        _say(f"poses: {pipeline.write_poses(arm, found, out)}")
    if json is not None:
        from workbench.report import json as reports

        _say(f"result: {reports.write_json(reports.poses(arm, found), json)}")


@app.command()
def export(
    calibrated: Annotated[str, typer.Argument(help="A robot: .toml, .urdf, or a built-in arm.")],
    urdf: Annotated[Path | None, typer.Option(help="Write a URDF here.")] = None,
    toml: Annotated[Path | None, typer.Option(help="Write a robot TOML here.")] = None,
    controller: Annotated[
        Path | None,
        typer.Option(help="Write controller-ready numbers here (.json): joint offsets, tool, base."),
    ] = None,
    nominal: Annotated[str | None, typer.Option(help="With --controller: the nominal robot.")] = None,
    tip: Annotated[str | None, typer.Option(help="Last link of the chain, for a URDF with several.")] = None,
) -> None:
    """Write a robot in another form: URDF, TOML, or the few numbers that a controller takes."""
    from workbench.robots import load_robot

    arm = load_robot(calibrated, tip=tip)
    if urdf is None and toml is None and controller is None:
        raise OptionError("give at least one of --urdf FILE, --toml FILE, --controller FILE")
    if controller is not None and nominal is None:
        raise OptionError("--controller needs --nominal ROBOT, the model that the controller has")
    _check_writable(urdf, toml, controller)
    for path in (urdf, toml):
        if path is not None:
            _say(f"{arm.name}: {_save_robot(arm, path)}")
    if controller is not None:
        from workbench.compensate.controller import controller_numbers
        from workbench.report import json as reports
        from workbench.report import table

        numbers = controller_numbers(load_robot(nominal), arm)
        table.print_controller(numbers)
        _say(f"controller: {reports.write_json(reports.controller(numbers), controller)}")


@app.command()
def capture(
    robot: RobotOption,
    plate: Annotated[str, typer.Option(help="Plate: a .toml file, or the built-in table2.")],
    out: Annotated[Path, typer.Option(help="Write the measurements here (.csv), row by row.")],
    source: Annotated[
        str, typer.Option("--from", help="- (standard input), HOST:PORT, or listen:HOST:PORT.")
    ] = "-",
    still_window: Annotated[str, typer.Option(help="How long the arm must have stood still.")] = "0.5s",
    still_joint: Annotated[
        str, typer.Option(help="How far a joint's readings may range in that time.")
    ] = "0.02deg",
    session: Annotated[str, typer.Option(help="Name of this placement of robot and instrument.")] = "",
    force: Annotated[
        bool, typer.Option("--force", help="Keep what the source asks to keep even while the arm moves.")
    ] = False,
) -> None:
    """Guided measuring: steer the arm to each target of a plate, and a key or the source stores the row.

    The source sends one JSON object a line. Keys: Enter or space stores, f stores although the arm moves,
    r takes the last row again, n and p go to the next and the previous target, q ends.
    """
    from rich.console import Console

    from workbench.design.plate_toml import load_plate
    from workbench.measure.standstill import StandstillDetector
    from workbench.pipeline import acquisition
    from workbench.robots import load_robot
    from workbench.units import Quantity, parse_quantity

    arm, fixture = load_robot(robot), load_plate(plate)
    detector = StandstillDetector(
        window=parse_quantity(still_window, Quantity.TIME),
        joint=parse_quantity(still_joint, Quantity.ANGLE),
        position=acquisition.POSITION_STILL,
        orientation=acquisition.ORIENTATION_STILL,
    )
    _check_writable(out)
    taken = acquisition.plate_acquisition(arm, fixture, session=session, detector=detector, forced=force)
    console = Console(stderr=True)
    with _lines(source) as lines, _guided(console) as (keys, show):
        done = acquisition.capture(
            taken,
            arm,
            lines,
            out,
            keys=keys,
            show=show,
            say=lambda text: console.print(text, markup=False, highlight=False),
            source="stdin" if source == "-" else source,
        )
    _say(f"{len(done.data)} of {len(fixture)} targets, {taken.source}: {out}")
    if not done.complete and not done.by_hand:
        raise typer.Exit(2)


@app.command()
def drive(
    robot: RobotOption,
    plate: Annotated[str, typer.Option(help="Plate: a .toml file, or the built-in table2.")],
    to: Annotated[str, typer.Option(help="- (standard output), or HOST:PORT to wait at.")] = "-",
    instrument: Annotated[
        str,
        typer.Option(
            help="What sees the tool: tracker-6d, laser-tracker …; plate: nothing, the seat holds it."
        ),
    ] = "tracker-6d",
    branch: Annotated[
        str, typer.Option(help="designed, mixed, auto (one branch), or a branch by name.")
    ] = "designed",
    rate: Annotated[float, typer.Option(help="Samples a second.")] = 50.0,
    dwell: Annotated[str, typer.Option(help="How long the arm stands at each target.")] = "1s",
    speed: Annotated[float, typer.Option(help="Times faster than real; 0: without waiting.")] = 1.0,
    actual: Annotated[Path | None, typer.Option(help="Write the hidden actual arm here (.toml).")] = None,
    of: Annotated[str | None, typer.Option(help="Drive this arm instead of one with hidden errors.")] = None,
    seed: SeedOption = 0,
) -> None:
    """A virtual arm in place of a real one's driver: JSON lines of an arm steered from target to target."""
    from workbench.design.plate_toml import load_plate
    from workbench.measure.driver import Pace
    from workbench.measure.send import send_samples
    from workbench.pipeline.virtual import drive_plate
    from workbench.robots import load_robot
    from workbench.robots.toml import write_toml
    from workbench.units import Quantity, parse_quantity

    _check_writable(actual)
    hidden, samples = drive_plate(
        load_robot(robot),
        load_plate(plate),
        branch=branch,
        instrument=instrument,
        actual=None if of is None else load_robot(of),
        pace=Pace(rate=rate, dwell=parse_quantity(dwell, Quantity.TIME)),
        seed=seed,
    )
    if actual is not None:
        write_toml(hidden, actual)
    with _receiver(to) as write:
        send_samples(samples, write, speed=speed)


def _read(path: Path, arm, columns: str | None, sheet: str | None, layout: str | None):
    from workbench.measure.readers import read_measurements

    return read_measurements(path, columns=columns, joints=arm.dof, sheet=sheet, layout=layout)


def _held_out(text: str, arm, columns, sheet, layout):
    """A share, rows of another file, or sessions."""
    if text.startswith("session:"):
        return tuple(text.removeprefix("session:").split(","))
    try:
        return float(text)
    except ValueError:
        return _read(Path(text), arm, columns, sheet, layout)


def _names(text: str | None) -> tuple[str, ...] | None:
    return None if text is None else tuple(name.strip() for name in text.split(",") if name.strip())


def _numbers(text: str | None, option: str) -> list[int]:
    try:
        return [] if text is None else [int(part) for part in text.split(",") if part.strip()]
    except ValueError:
        raise OptionError(f"{option} takes whole numbers with commas between, not '{text}'") from None


def _bounds(texts: list[str]) -> dict[str, tuple[float, float]]:
    bounds = {}
    for text in texts:
        try:
            name, interval = text.split("=")
            low, high = (float(part) for part in interval.split(":"))
        except ValueError:
            raise OptionError(f"--bounds takes NAME=LOW:HIGH in rad or m, not '{text}'") from None
        bounds[name.strip()] = (low, high)
    return bounds


def _noise(text: str):
    """Standard deviations from people's units."""
    from workbench.identify.problem import Noise
    from workbench.units import Quantity, parse_quantity

    parts = [part.strip() for part in text.split(",")]
    if len(parts) not in (1, 2):
        raise OptionError(f'--noise takes "0.05mm,0.01deg" or "0.05mm", not \'{text}\'')
    position = parse_quantity(parts[0], Quantity.LENGTH)
    rotation = parse_quantity(parts[1], Quantity.ANGLE) if len(parts) == 2 else Noise().rotation
    if position <= 0 or rotation <= 0:
        raise OptionError(f"--noise must be greater than zero, not '{text}'")
    return Noise(position, rotation)


def _check_writable(*files: Path | None, folder: Path | None = None) -> None:
    """Refuse an output that can't be written before the work begins."""
    from workbench.files import check_writable

    for path in files:
        if path is not None:
            check_writable(path)
    if folder is not None:
        check_writable(folder, folder=True)


def _save_robot(arm, path: Path) -> Path:
    from workbench.robots.toml import write_toml

    if path.suffix.lower() == ".urdf":
        from workbench.robots.urdf import write_urdf

        return write_urdf(arm, path)
    return write_toml(arm, path)


def _say(text: str) -> None:
    print(text)


@contextmanager
def _progress(what: str) -> Iterator[Callable[[float, str], None]]:
    """A progress bar on standard error, if anybody looks."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(30), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bars:
        task = bars.add_task(what, total=1.0)
        yield lambda part, text: bars.update(task, completed=part, description=text)


@contextmanager
def _lines(source: str) -> Iterator[Iterable[str]]:
    """Lines of a live source: standard input, a place to connect to, or one to wait at."""
    from workbench.measure.stream import connect, listen

    if source == "-":
        if sys.stdin.isatty():
            raise OptionError("nothing is piped in; give --from HOST:PORT, or pipe a source into the command")
        yield sys.stdin
    elif source.startswith("listen:"):
        address = source.removeprefix("listen:")
        with listen(address, ready=lambda port: print(f"waiting at port {port}", file=sys.stderr)) as lines:
            yield lines
    else:
        with connect(source) as lines:
            yield lines


@contextmanager
def _guided(console) -> Iterator[tuple]:
    """Keys and live view where a terminal has both, else neither."""
    from workbench.pipeline.keyboard import keyboard
    from workbench.report.live import live_view

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
def _receiver(to: str) -> Iterator[Callable[[str], object]]:
    """Where lines go: standard output, or the first that connects."""
    import os

    from workbench.measure.send import first_listener, writer_to

    if to != "-":
        with first_listener(
            to, ready=lambda port: print(f"waiting at port {port}", file=sys.stderr)
        ) as write:
            yield write
        return
    yield writer_to(sys.stdout)
    try:
        sys.stdout.flush()
    except BrokenPipeError:  # the reader has had enough; nothing more may be flushed at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
