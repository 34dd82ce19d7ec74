"""The command that finds joint zeros again: rezero."""

from pathlib import Path
from typing import Annotated

import typer

import workbench as wb
from workbench.cli import options as opt


@opt.flattened
def rezero(
    data: opt.DataArgument,
    robot: opt.RobotOption,
    files: opt.FileOptions,
    replaced: Annotated[str | None, typer.Option(help="Joints that were replaced, such as 3.")] = None,
    prior: Annotated[
        Path | None, typer.Option(help="Result of the calibration (--json): how well it knows the arm.")
    ] = None,
    tolerance: Annotated[
        str, typer.Option(help="How well the calibration knows lengths and angles, without --prior.")
    ] = "0.1mm,0.006deg",
    noise: opt.NoiseOption = None,
    frames: opt.FramesOption = "auto",
    exclude: opt.ExcludeOption = None,
    save: opt.SaveOption = None,
    json: opt.JsonOption = None,
) -> None:
    """After a knock or a new motor: which joint's zero moved since the calibration, by how much."""

    from workbench.identification.report.prior import read_prior
    from workbench.identification.rezero.record import Verdict

    arm = wb.load_robot(robot)
    opt.check_robot_file(save, effects=bool(arm.effects))
    opt.check_writable(save, json)
    found = wb.rezero(
        arm,
        files.read(data, arm),
        replaced=opt.whole_numbers(replaced, "--replaced"),
        prior=None if prior is None else read_prior(prior),
        tolerance=opt.pair_of(tolerance, "--tolerance"),
        noise=None if noise is None else opt.noise_of(noise),
        frames=frames,
        exclude=dict.fromkeys(opt.whole_numbers(exclude, "--exclude"), "by hand"),
    )
    opt.show(found.summary())
    opt.write_result(json, found.json())
    if found.verdict is Verdict.REFUSED:
        opt.fail(
            "the zeros alone don't explain the rows" + ("; nothing is saved" if save is not None else "")
        )
    if save is not None:
        opt.say(f"robot with the zeros found: {opt.save_robot(found.robot, save)}")
