"""The command that finds joint zeros again: rezero."""

from pathlib import Path
from typing import Annotated

import typer

from workbench.cli.options import (
    DataArgument,
    ExcludeOption,
    FileOptions,
    FramesOption,
    JsonOption,
    NoiseOption,
    RobotOption,
    SaveOption,
    check_robot_file,
    check_writable,
    fail,
    flattened,
    noise_of,
    pair_of,
    save_robot,
    say,
    show,
    whole_numbers,
    write_result,
)


@flattened
def rezero(
    data: DataArgument,
    robot: RobotOption,
    files: FileOptions,
    replaced: Annotated[str | None, typer.Option(help="Joints that were replaced, such as 3.")] = None,
    prior: Annotated[
        Path | None, typer.Option(help="Result of the calibration (--json): how well it knows the arm.")
    ] = None,
    tolerance: Annotated[
        str, typer.Option(help="How well the calibration knows lengths and angles, without --prior.")
    ] = "0.1mm,0.006deg",
    noise: NoiseOption = None,
    frames: FramesOption = "auto",
    exclude: ExcludeOption = None,
    save: SaveOption = None,
    json: JsonOption = None,
) -> None:
    """After a knock or a new motor: which joint's zero moved since the calibration, by how much."""
    from workbench.arm.built_in_arms import load_robot
    from workbench.identification.report.prior import read_prior
    from workbench.identification.rezero.find import rezero
    from workbench.identification.rezero.record import Verdict

    arm = load_robot(robot)
    check_robot_file(save, effects=bool(arm.effects))
    check_writable(save, json)
    found = rezero(
        arm,
        files.read(data, arm),
        replaced=whole_numbers(replaced, "--replaced"),
        prior=None if prior is None else read_prior(prior),
        tolerance=pair_of(tolerance, "--tolerance"),
        noise=None if noise is None else noise_of(noise),
        frames=frames,
        exclude=dict.fromkeys(whole_numbers(exclude, "--exclude"), "by hand"),
    )
    show(found.summary())
    write_result(json, found.json())
    if found.verdict is Verdict.REFUSED:
        fail("the zeros alone don't explain the rows" + ("; nothing is saved" if save is not None else ""))
    if save is not None:
        say(f"robot with the zeros found: {save_robot(found.robot, save)}")
