"""Commands for calibrated arms: verify on fresh poses, rezero after a knock."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.base.errors import OptionError
from workbench.cli import options as opt
from workbench.cli.options import option


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
        Path | None, option("Write the certificate: one .pdf, or a folder with PDF, page and numbers.")
    ] = None,
) -> None:
    """Verify a calibrated robot on fresh poses: errors with intervals, AP and RP, a certificate."""
    from workbench.identification.verification.certificate import write_certificate
    from workbench.identification.verification.results import verification_json

    fit_frames = opt.fits_frames(frames)
    arm = wb.load_robot(robot)
    pdf = report is not None and report.suffix.lower() == ".pdf"
    opt.check_writable(json, report if pdf else None, folder=None if pdf else report)
    found = wb.verify(
        arm,
        files.read(data, arm),
        wanted=None if wanted is None else wanted_of(wanted),
        used=None if used is None else files.read_whole(used, arm),
        same=opt.angle(same),
        fit_frames=fit_frames,
        facts=dict(fact_of(text) for text in fact or []),
    )
    opt.show(found.summary())
    opt.write_result(json, verification_json(found))
    if report is not None:
        inputs = [path for path in (data, used, Path(robot)) if path is not None and path.is_file()]
        opt.say(f"certificate: {write_certificate(found, report, inputs=inputs)}")
    if found.passed is False:
        opt.fail(found.verdict)


def wanted_of(text: str):
    """What is wanted, from a length or a length and an angle."""
    from workbench.data.accuracy_requirement import Wanted

    position, comma, angle = text.partition(",")
    return Wanted(position=opt.length(position), rotation=opt.angle(angle) if comma else None)


def fact_of(text: str) -> tuple[str, str]:
    """A name and what it is."""
    name, equals, words = (part.strip() for part in text.partition("="))
    if not (name and equals and words):
        raise OptionError(f"--fact must be NAME=TEXT such as 'Serial number=A-1047', got '{text}'")
    return name, words


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
        str, option("Without --prior: standard deviations of the calibrated lengths and angles.")
    ] = "0.1mm,0.006deg",
    noise: opt.NoiseOption = None,
    frames: opt.FramesOption = "auto",
    exclude: opt.ExcludeOption = None,
    save: opt.SaveOption = None,
    json: opt.JsonOption = None,
) -> None:
    """After a knock or a motor replacement: which joint's zero has moved, and by how much."""
    from workbench.identification.prior import read_prior
    from workbench.identification.rezero.result import Verdict

    arm = wb.load_robot(robot)
    opt.check_robot_file(save)
    opt.check_writable(save, json)
    rows = files.read(data, arm)
    with opt.progress_bar("rezero") as progress:
        found = wb.rezero(
            arm,
            rows,
            replaced=opt.whole_numbers(replaced, "--replaced"),
            prior=None if prior is None else read_prior(prior),
            tolerance=opt.pair_of(tolerance, "--tolerance"),
            noise=None if noise is None else opt.noise_of(noise),
            frames=frames,
            exclude=dict.fromkeys(opt.whole_numbers(exclude, "--exclude"), "by hand"),
            progress=progress,
        )
    opt.show(found.summary())
    opt.write_result(json, found.json())
    if found.verdict is Verdict.REFUSED:
        opt.fail(
            "the zeros alone don't explain the rows" + ("; nothing is saved" if save is not None else "")
        )
    if save is not None:
        opt.say(f"robot with the zeros found: {opt.save_robot(found.robot, save)}")
