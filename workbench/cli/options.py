"""Options that several commands share, and the parsing of option values."""

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NoReturn

import typer

import workbench as wb
from workbench.base.advice import failures
from workbench.base.errors import OptionError, ShapeError, UnitError, WorkbenchError
from workbench.base.progress import running
from workbench.cli.exit_status import Unusable
from workbench.cli.option_records import AbstractCompanion, AbstractSource
from workbench.cli.option_records import flattened as flattened
from workbench.cli.output_files import check_writable as check_writable
from workbench.cli.output_files import say as say
from workbench.cli.output_files import write_result as write_result

if TYPE_CHECKING:
    from workbench.report.blocks import Block


def option(*names_and_help: str, **more: Any) -> Any:
    """An option with its help text; without a name, that of its parameter."""
    *names, help = names_and_help
    return typer.Option(*names, help=help, **more)


def argument(help: str) -> Any:
    return typer.Argument(help=help)


RobotOption = Annotated[
    str, option("--robot", "Robot: a .toml or .urdf file, or a built-in arm such as aria, ur10, panda.")
]
DataArgument = Annotated[
    Path, argument("Measurements: CSV, TSV, xlsx, parquet, .mat; a folder of numbered files, or of mukca.")
]
ColumnsOption = Annotated[
    str | None,
    option(
        'Columns if headings are missing: "q1[deg],…,x[mm],…", "-" to skip one; '
        'in MATLAB files "q[rad|row]=Q,xyz[mm|row]=P".'
    ),
]
SheetOption = Annotated[str | None, option("Sheet of a workbook; the one with measurements if not given.")]
PlateOption = Annotated[
    str | None, option("Plate: a .toml file, the table of a measuring machine, or the built-in table2.")
]
UnknownOption = Annotated[
    str | None, option("--unknown", "Frames to identify as well: base, tool, base,tool, or none.")
]
FramesOption = Annotated[
    str, option("--frames", "Base and tool of sessions: shared, per-session, or auto (the data decide).")
]
SaveOption = Annotated[Path | None, option("--save", "Write the calibrated robot here (.toml or .urdf).")]
ExcludeOption = Annotated[str | None, option("--exclude", "Rows to exclude, from 0 or by Nr, such as 3,17.")]
NoiseOption = Annotated[
    str | None,
    option("--noise", 'Standard deviations of the instrument: "0.05mm,0.01deg"; default: estimated.'),
]
WantedOption = Annotated[str | None, option('Required error of every pose: "0.3mm", or "0.3mm,0.1deg".')]
TipOption = Annotated[str | None, option("Last link of the chain, for a URDF with several end links.")]
SchedulerOption = Annotated[
    str | None, option("Dask scheduler, such as tcp://host:8786; else this machine's cores.")
]
ReadingOption = Annotated[
    str, option("What the rows mean: auto; found, or a name that is told: accept signs, order …; given.")
]
SeedOption = Annotated[int, option("Seed of the random numbers.")]


def _list_layouts(value: str | None) -> str | None:
    """The name of a layout; `list` prints all and ends the command."""
    if value == "list":
        from workbench.data.readers.layouts import layout_names

        say("\n".join(layout_names()))
        raise typer.Exit
    return value


@dataclass(frozen=True)
class FileOptions:
    """Options for reading a measurement file."""

    columns: ColumnsOption = None
    sheet: SheetOption = None
    layout: Annotated[
        str | None,
        option(
            "Layout of the file, recognised if not given; `--layout list` lists all.",
            callback=_list_layouts,
            is_eager=True,
        ),
    ] = None
    joints: Annotated[
        Path | None,
        option(
            "Joints measured separately: a table (--columns names it too) or log, joined by name, time, row."
        ),
    ] = None
    joined: tuple[AbstractSource, ...] = ()
    joins: ClassVar = "sources"

    @property
    def stated(self) -> dict[str, Any]:
        """How a file is read, as options say."""
        return {name: getattr(self, name) for name in ("columns", "sheet", "layout")}

    def read(self, path: Path, arm):
        """Measurements of a file, with as many joints as the arm has."""
        for source in self.joined:
            if (found := source.read(path, arm, self.joints)) is not None:
                return found
        try:
            return wb.read_measurements(path, joints=arm, joint_table=self.joints, **self.stated)
        except ShapeError as error:
            from workbench.arm.urdf import tip_of

            if (tip := tip_of(arm, error.found)) is None:
                raise
            text = f"{error}, or its chain of {error.found} joints by --tip {tip}"
            raise ShapeError(text, expected=error.expected, found=error.found) from None


@dataclass(frozen=True)
class PageOptions:
    """What is beside the page: options of other packages alone."""

    joined: tuple[AbstractCompanion, ...] = ()
    joins: ClassVar = "companions"


@dataclass(frozen=True)
class FitOptions:
    """Which rows are fitted, which constants are free, and how rows are weighted."""

    held_out: Annotated[str, option("Rows to hold out: a share (0.2 or 20%), a file, or session:NAME.")] = (
        "0.2"
    )
    frames: FramesOption = "auto"
    region: Annotated[str | None, option("Keep only rows inside the region of this plate.")] = None
    free: Annotated[
        str | None, option("Constants to identify: joint1.theta,joint2.a …; default: the robot's.")
    ] = None
    exclude: ExcludeOption = None
    noise: NoiseOption = None
    levelled: Annotated[
        bool, option("--levelled", "The measuring frame's z axis is vertical: a levelled instrument.")
    ] = False
    reading: ReadingOption = "auto"
    seed: SeedOption = 0
    force: Annotated[
        bool, option("--force", "Continue although the rows fit another arm; save implausible results.")
    ] = False

    def choices(self, arm, files: FileOptions):
        """These choices in SI."""
        from workbench.base.files import exists
        from workbench.identification.fit_choices import FitChoices

        own = dict(vars(self))
        if exists(self.held_out):  # --joints are of the other file
            own["held_out"] = replace(files, joints=None).read(Path(self.held_out), arm)
        if own.pop("force"):
            own["reading"] = "given"
        return FitChoices(**own)


@dataclass(frozen=True)
class OutputOptions:
    """Where a fit's results are written."""

    save: SaveOption = None
    report: Annotated[Path | None, option("--report", "Write an HTML report into this folder.")] = None

    def check(self) -> None:
        """Refuse unwritable outputs before the work begins."""
        check_writable(robot=self.save, folder=self.report)


def quantity(text: str, option: str, kind: str = "LENGTH") -> float:
    """A number in SI from text such as 0.1mm, for an option that no verb reads."""
    from workbench.base.units import Quantity, parse_quantity

    try:
        return parse_quantity(text, Quantity[kind])
    except UnitError as error:
        raise OptionError(str(error), option=option, found=text) from None


def wanted_of(text: str) -> "wb.Wanted":
    """Required error: a length, or a length and an angle."""
    position, *angle = text.split(",", 1)
    rotation = quantity(angle[0], "wanted", "ANGLE") if angle else None
    return wb.Wanted(position=quantity(position, "wanted"), rotation=rotation)


def fits_frames(text: str) -> bool:
    """Whether base and tool are fitted, from `given` or `fit`."""
    return choice_of({"given": False, "fit": True}, text, "--frames")


def choice_of(kinds, text: str, option: str):
    """The entry of an enum or a table with this name."""
    if text not in list(kinds):
        raise OptionError(f"{option} must be one of {', '.join(kinds)}, got '{text}'")
    return kinds[text] if isinstance(kinds, Mapping) else kinds(text)


def unknown_frames(text: str | None) -> tuple[bool | None, bool | None]:
    """Whether base and tool are identified, from `base,tool`, one of them, or none; None if not given."""
    if text is None:
        return None, None
    parts = set() if text == "none" else {word.strip() for word in text.split(",")}
    if strange := parts - {"base", "tool"}:
        raise OptionError(f"--unknown must be base, tool, base,tool or none, got '{min(strange)}'")
    return "base" in parts, "tool" in parts


def load_nominal(name: str | None, arm):
    """The controller's model of a calibrated arm: of a URDF with several chains the one with its joints."""
    from workbench.arm.urdf import tip_of

    if name is None:
        return None
    found = wb.load_robot(name)
    tip = None if found.dof == arm.dof else tip_of(found, arm.dof)
    return found if tip is None else wb.load_robot(name, tip=tip)


def save_robot(arm, path: Path, *, force: bool = False) -> Path:
    """Write a robot in the form given by the file's extension; fail where its calibration says not to."""
    from workbench.arm.built_in_arms import refusal

    if not force and (reason := refusal(arm, path.suffix)):
        fail(f"{reason}; {path} is not written")
    if path.suffix.lower() == ".urdf" and arm.sessions:
        say(f"note: a URDF has one base; {path} does not contain those of {len(arm.sessions)} sessions")
    return arm.save(path, force=force)


def describe(what: str, do: Callable[[], object]) -> None:
    """Show or write what describes a result that is saved already; a mistake in it costs one warning."""
    with failures() as failed:
        try:
            do()
        except (WorkbenchError, OSError):
            raise
        except Exception as error:
            failed.append(f"the {what} could not be made ({type(error).__name__}: {error})")
    say_notes(failed)


def fail(sentence: str) -> NoReturn:
    """End with exit status 2 and the reason on standard error: there is a result that should not be used as
    is."""
    raise Unusable(sentence)


def say_notes(notes: Iterable[str]) -> None:
    """Print the notes of the result, one per line."""
    for note in notes:
        say(f"note: {note}")


def show(blocks: "Iterable[Block]") -> None:
    """Print a result."""
    from rich.console import Console

    from workbench.report.result_display import as_rich

    Console().print(as_rich(blocks))


def give(found, doubt: str = "", save: Path | None = None, *, saved: str = "") -> None:
    """Print a result, and write it where `--json` says, if it does; a doubt ends it, with no file saved, else
    its robot is saved, or what it saves itself, called `saved`."""
    show(found.blocks())
    write_result(found.json)
    if doubt:
        fail(doubt if save is None else f"{doubt}; {save} is not written")
    if save is not None:
        say(f"{saved}: {found.save(save) if hasattr(found, 'save') else save_robot(found.robot, save)}")


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[float, str], None]]:
    """A progress bar on standard error, if that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda part, text: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(30), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task(what, total=1.0)

        def report(part: float, text: str) -> None:
            bars.update(task, completed=part, description=text)

        with running(report):
            yield report
