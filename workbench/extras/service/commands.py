"""Commands for calibrated arms: verify on fresh poses, rezero after a collision."""

from typing import Annotated

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.exit_status import in_section
from workbench.cli.options import option


@in_section("Calibrate")
def verify(
    data: opt.DataArgument,
    robot: opt.RobotOption,
    files: opt.FileOptions,
    wanted: opt.WantedOption = None,
    frames: Annotated[str, option("given; fit: base and tool first, if the instrument moved.")] = "given",
    reading: opt.ReadingOption = "auto",
) -> None:
    """Verify a calibrated robot on fresh poses: errors with intervals, AP and RP, pass or fail."""
    arm, fits = wb.load_robot(robot), opt.fits_frames(frames)
    found = wb.verify(arm, files.read(data, arm), wanted=wanted, fit_frames=fits, reading=reading)
    opt.give(found, found.verdict if found.passed is False or found.evaluation.foreign else "")


@in_section("Calibrate")
def rezero(
    data: opt.DataArgument,
    robot: opt.RobotOption,
    files: opt.FileOptions,
    noise: opt.NoiseOption = None,
    frames: opt.FramesOption = "auto",
    exclude: opt.ExcludeOption = None,
    save: opt.SaveOption = None,
) -> None:
    """After a collision or with a new motor: which joint's zero moved, from poses or touches of seats."""
    arm = wb.load_robot(robot)
    opt.check_writable(robot=save)
    rows = files.read(data, arm)
    with opt.progress_bar("rezero"):
        found = wb.rezero(arm, rows, noise=noise, frames=frames, exclude=exclude)
    opt.give(found, found.sentence if found.doubts else "", save, saved="robot with the zeros found")
