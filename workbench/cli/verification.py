"""The commands that judge calibrated arms: verify on fresh poses, fleet over time and arms."""

from pathlib import Path
from typing import Annotated

import typer

from workbench.base.errors import OptionError
from workbench.base.wording import counted
from workbench.cli.options import (
    DataArgument,
    FileOptions,
    JsonOption,
    ReportOption,
    RobotOption,
    WantedOption,
    check_writable,
    fail,
    flattened,
    progress_bar,
    say,
    show,
    write_result,
)


@flattened
def verify(
    data: DataArgument,
    robot: RobotOption,
    files: FileOptions,
    wanted: WantedOption = None,
    used: Annotated[
        Path | None,
        typer.Option(help="Measurements of the calibration; its poses are left out of the verification."),
    ] = None,
    frames: Annotated[
        str, typer.Option(help="given: fit nothing; fit: fit base and tool, as the instrument was moved.")
    ] = "given",
    same: Annotated[str, typer.Option(help="Rows whose joints differ by less visit one pose.")] = "0.02deg",
    fact: Annotated[
        list[str] | None,
        typer.Option(help='For the certificate, such as "Serial number=A-1047". May be repeated.'),
    ] = None,
    json: JsonOption = None,
    report: Annotated[
        Path | None,
        typer.Option(help="Write the certificate: one .pdf, or a folder with PDF, page and numbers."),
    ] = None,
) -> None:
    """Verify a calibrated robot on fresh poses: errors with intervals, AP and RP, a certificate."""
    from workbench.arm.built_in_arms import load_robot
    from workbench.base.units import Quantity, parse_quantity
    from workbench.identification.verification.certificate import write_certificate
    from workbench.identification.verification.results import verification_json
    from workbench.identification.verification.verify import verify

    if frames not in ("given", "fit"):
        raise OptionError(f"--frames must be given or fit, got '{frames}'")
    arm = load_robot(robot)
    pdf = report is not None and report.suffix.lower() == ".pdf"
    check_writable(json, report if pdf else None, folder=None if pdf else report)
    found = verify(
        arm,
        files.read(data, arm),
        wanted=None if wanted is None else wanted_of(wanted),
        used=None if used is None else files.read_whole(used, arm),
        same=parse_quantity(same, Quantity.ANGLE),
        fit_frames=frames == "fit",
        facts=dict(fact_of(text) for text in fact or []),
    )
    show(found.summary())
    write_result(json, verification_json(found))
    if report is not None:
        inputs = [path for path in (data, used, Path(robot)) if path is not None and path.is_file()]
        say(f"certificate: {write_certificate(found, report, inputs=inputs)}")
    if found.passed is False:
        fail(found.verdict)


def wanted_of(text: str):
    """What is wanted, from a length or a length and an angle."""
    from workbench.base.units import Quantity, parse_quantity
    from workbench.data.accuracy_requirement import Wanted

    position, comma, angle = text.partition(",")
    return Wanted(
        position=parse_quantity(position, Quantity.LENGTH),
        rotation=parse_quantity(angle, Quantity.ANGLE) if comma else None,
    )


def fact_of(text: str) -> tuple[str, str]:
    """A name and what it is."""
    name, equals, words = (part.strip() for part in text.partition("="))
    if not (name and equals and words):
        raise OptionError(f"--fact must be NAME=TEXT such as 'Serial number=A-1047', got '{text}'")
    return name, words


def fleet(
    folder: Annotated[
        Path, typer.Argument(help="ARM/DATE.toml (calibrated) or ARM/DATE.csv (measured) for each arm.")
    ],
    robot: Annotated[
        str | None, typer.Option(help="Nominal robot, with which measurements are identified.")
    ] = None,
    allowed: Annotated[
        str, typer.Option(help="Measure again when a drift will have moved the tool by this.")
    ] = "0.1mm",
    workers: Annotated[
        int | None, typer.Option(help="Processes on this machine; as many as it has cores if not given.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Dask scheduler, such as tcp://host:8786; else this machine's cores.")
    ] = None,
    json: JsonOption = None,
    report: ReportOption = None,
) -> None:
    """Compare calibrations over time: what moved, by how many σ, since when, and which arm is worst."""
    from workbench.arm.built_in_arms import load_robot
    from workbench.base.units import Quantity, parse_quantity
    from workbench.identification.fleet.fleet import compare_fleet
    from workbench.identification.fleet.report import fleet_json, fleet_tables, write_fleet

    check_writable(json, folder=report)
    with progress_bar("fleet") as progress:
        found = compare_fleet(
            folder,
            robot=None if robot is None else load_robot(robot),
            allowed=parse_quantity(allowed, Quantity.LENGTH),
            workers=workers,
            scheduler=scheduler,
            progress=lambda part: progress(part, "reading and identifying"),
        )
    show(fleet_tables(found))
    write_result(json, fleet_json(found))
    if report is not None:
        say(f"report: {write_fleet(found, report)}")
    if found.unread:
        fail(f"{counted(len(found.unread), 'arm')} could not be compared, such as {found.unread[0].arm}")
