"""Commands for calibrated arms: verify on fresh poses, rezero after a knock, fleet over time."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.base.errors import OptionError
from workbench.base.wording import plural
from workbench.cli import options as opt
from workbench.cli.exit_status import in_section
from workbench.cli.options import argument, option


@in_section("Calibrate")
@opt.flattened
def verify(
    data: opt.DataArgument,
    robot: opt.RobotOption,
    files: opt.FileOptions,
    wanted: opt.WantedOption = None,
    used: Annotated[
        Path | None, option("Measurements of the calibration; its poses are left out of the verification.")
    ] = None,
    frames: Annotated[
        str, option("given: fit nothing; fit: fit base and tool, if the instrument was moved.")
    ] = "given",
    same: Annotated[str, option("Rows whose joints differ by less count as one pose.")] = "0.02deg",
    fact: Annotated[
        list[str] | None, option('For the certificate, such as "Serial number=A-1047". May be repeated.')
    ] = None,
    json: opt.JsonOption = None,
    report: Annotated[
        Path | None, option("Write the certificate: a folder with a page for A4, its picture and numbers.")
    ] = None,
) -> None:
    """Verify a calibrated robot on fresh poses: errors with intervals, AP and RP, a certificate."""
    from workbench.extras.service.verification.certificate import write_certificate
    from workbench.extras.service.verification.report import verification_json

    fit_frames = opt.fits_frames(frames)
    arm = wb.load_robot(robot)
    if report is not None and report.suffix.lower() == ".pdf":
        raise OptionError(f"--report must be a folder, got '{report}'; print its page to have a PDF")
    opt.check_writable(json, folder=report)
    found = wb.verify(
        arm,
        files.read(data, arm),
        wanted=None if wanted is None else opt.wanted_of(wanted),
        used=None if used is None else files.read_whole(used, arm),
        same=opt.angle(same),
        fit_frames=fit_frames,
        facts=dict(_fact_of(text) for text in fact or []),
    )
    opt.show(found.summary())
    opt.write_result(json, verification_json(found))
    if report is not None:
        inputs = [path for path in (data, used, Path(robot)) if path is not None and path.is_file()]
        opt.say(f"certificate: {write_certificate(found, report, inputs=inputs)}")
    if found.passed is False:
        opt.fail(found.verdict)


def _fact_of(text: str) -> tuple[str, str]:
    """A name and what it is."""
    name, equals, value = (part.strip() for part in text.partition("="))
    if not (name and equals and value):
        raise OptionError(f"--fact must be NAME=TEXT such as 'Serial number=A-1047', got '{text}'")
    return name, value


@in_section("Calibrate")
@opt.flattened
def rezero(
    data: opt.DataArgument,
    robot: opt.RobotOption,
    files: opt.FileOptions,
    replaced: Annotated[str | None, option("Joints that were replaced, such as 3.")] = None,
    prior: Annotated[
        Path | None, option("Result of the calibration (--json), as prior knowledge of the arm.")
    ] = None,
    tolerance: Annotated[
        str | None,
        option(
            "Standard deviations of lengths and angles, such as 0.1mm,0.006deg; by default the calibration's "
            "record in the arm's file, 0.5mm,0.03deg without one."
        ),
    ] = None,
    noise: opt.NoiseOption = None,
    frames: opt.FramesOption = "auto",
    exclude: opt.ExcludeOption = None,
    save: opt.SaveOption = None,
    json: opt.JsonOption = None,
) -> None:
    """After a collision or a motor replacement: which joint's zero has moved, and by how much."""
    from workbench.extras.service.rezero.result import RezeroVerdict
    from workbench.identification.prior import read_prior

    arm = wb.load_robot(robot)
    opt.check_robot_file(save)
    opt.check_writable(save, json)
    rows = files.read(data, arm)
    with opt.progress_bar("rezero"):
        found = wb.rezero(
            arm,
            rows,
            replaced=opt.whole_numbers(replaced, "--replaced"),
            prior=None if prior is None else read_prior(prior),
            tolerance=None if tolerance is None else opt.pair_of(tolerance, "--tolerance"),
            noise=None if noise is None else opt.noise_of(noise),
            frames=frames,
            exclude=dict.fromkeys(opt.whole_numbers(exclude, "--exclude"), "by hand"),
        )
    opt.show(found.summary())
    opt.write_result(json, found.json())
    if found.verdict is RezeroVerdict.REFUSED:
        opt.fail(
            "the zeros alone don't explain the rows" + ("; nothing is saved" if save is not None else "")
        )
    if save is not None:
        opt.say(f"robot with the zeros found: {opt.save_robot(found.robot, save)}")


@in_section("Calibrate")
def fleet(
    folder: Annotated[Path, argument("ARM/DATE.toml (calibrated) or ARM/DATE.csv (measured) for each arm.")],
    robot: Annotated[str | None, option("Nominal robot, with which measurements are identified.")] = None,
    allowed: Annotated[str, option("Drift of the tool after which to measure again.")] = "0.1mm",
    workers: Annotated[int | None, option("Processes on this machine; by default one per core.")] = None,
    scheduler: opt.SchedulerOption = None,
    json: opt.JsonOption = None,
    report: opt.ReportOption = None,
) -> None:
    """Compare calibrations over time: what moved, by how many σ, since when, and which arm is worst."""
    from workbench.extras.service.fleet.page import write_fleet
    from workbench.extras.service.fleet.report import fleet_json, fleet_tables

    opt.check_writable(json, folder=report)
    with opt.progress_bar("fleet"):
        found = wb.compare_fleet(
            folder,
            robot=None if robot is None else wb.load_robot(robot),
            allowed=opt.length(allowed),
            workers=workers,
            scheduler=scheduler,
        )
    opt.show(fleet_tables(found))
    opt.write_result(json, fleet_json(found))
    if report is not None:
        opt.say(f"report: {write_fleet(found, report)}")
    if found.unread:
        opt.fail(f"{plural(len(found.unread), 'arm')} could not be compared, such as {found.unread[0].arm}")
