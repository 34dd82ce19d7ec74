"""The commands that turn measurements into a calibrated robot: identify, evaluate, export."""

from pathlib import Path
from typing import Annotated

import typer

from workbench.base.errors import OptionError
from workbench.cli.options import (
    BaseMarkersOption,
    ColumnsOption,
    DataArgument,
    ExcludeOption,
    FramesOption,
    FreeOption,
    HeldOutOption,
    JsonOption,
    LayoutOption,
    NoiseOption,
    RegionOption,
    ReportOption,
    RobotOption,
    SaveOption,
    SeedOption,
    SheetOption,
    ToolMarkersOption,
    bounds_of,
    check_converged,
    check_robot_file,
    check_writable,
    held_out_of,
    names_of,
    noise_of,
    progress_bar,
    read_rows,
    save_robot,
    say,
    show,
    whole_numbers,
    with_markers,
)


def identify(
    data: DataArgument,
    robot: RobotOption,
    algorithm: Annotated[
        str, typer.Option(help="ols, opt1, opt2, influence, several with commas between, or all.")
    ] = "ols,opt1,opt2",
    held_out: HeldOutOption = "0.2",
    frames: FramesOption = "auto",
    region: RegionOption = None,
    save: SaveOption = None,
    report: ReportOption = None,
    json: JsonOption = None,
    level: Annotated[
        int, typer.Option(help="1: joint offsets alone; 2: the whole geometry.", min=1, max=2)
    ] = 2,
    free: FreeOption = None,
    exclude: ExcludeOption = None,
    bounds: Annotated[
        list[str] | None, typer.Option(help="Bound for OPT1, in SI: joint1.theta=-0.1:0.1. May be repeated.")
    ] = None,
    noise: NoiseOption = None,
    loss: Annotated[str, typer.Option(help="squares, huber, or tukey: how outlying rows count.")] = "squares",
    prior: Annotated[
        Path | None, typer.Option(help="An earlier result (--json) of this robot, as prior knowledge.")
    ] = None,
    renew: Annotated[
        str | None, typer.Option(help="With --prior: joints that were replaced, such as 3 or 3,4.")
    ] = None,
    tool_markers: ToolMarkersOption = None,
    base_markers: BaseMarkersOption = None,
    seed: SeedOption = 0,
    columns: ColumnsOption = None,
    sheet: SheetOption = None,
    layout: LayoutOption = None,
) -> None:
    """Identify the arm's geometry from measurements, and report its error on held-out rows."""
    from workbench.arm.library import load_robot
    from workbench.identification.algorithms import ALGORITHMS
    from workbench.identification.identify import identify
    from workbench.identification.report import json as reports
    from workbench.identification.report import table
    from workbench.identification.report.prior import read_prior
    from workbench.plate.parts.as_measured import load_plate
    from workbench.report.json import write_json

    if level == 1 and free is not None:
        raise OptionError("--level 1 frees the joint offsets alone; leave either it or --free out")
    arm = load_robot(robot)
    rows = with_markers(read_rows(data, arm, columns, sheet, layout), tool_markers, base_markers)
    check_robot_file(save)
    check_writable(save, json, folder=report)
    with progress_bar("identify") as progress:
        run = identify(
            arm,
            rows,
            algorithms=tuple(ALGORITHMS) if algorithm == "all" else tuple(algorithm.split(",")),
            held_out=held_out_of(held_out, arm, columns, sheet, layout),
            frames=frames,
            free=arm.joint_offsets if level == 1 else names_of(free),
            exclude=dict.fromkeys(whole_numbers(exclude, "--exclude"), "by hand"),
            region=None if region is None else load_plate(region).region,
            bounds=bounds_of(bounds or []),
            noise=None if noise is None else noise_of(noise),
            loss=loss,
            prior=None if prior is None else read_prior(prior, renew=whole_numbers(renew, "--renew")),
            seed=seed,
            progress=progress,
        )
    show(table.identification_tables(run))
    if save is not None:
        say(f"calibrated robot ({run.best.fit.title}): {save_robot(run.best.calibrated, save)}")
    if json is not None:
        say(f"result: {write_json(json, reports.identification_json(run))}")
    if report is not None:
        from workbench.identification.report.page import write_report

        say(f"report: {write_report(run, report)}")
    check_converged(run.best.fit)


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
    from workbench.arm.library import load_robot
    from workbench.identification.evaluate import evaluate
    from workbench.identification.report import json as reports
    from workbench.identification.report import table
    from workbench.report.json import write_json

    if frames not in ("given", "fit"):
        raise OptionError(f"--frames can't be '{frames}'; choose given or fit")
    arm = load_robot(robot)
    check_writable(json)
    found = evaluate(arm, read_rows(data, arm, columns, sheet, layout), fit_frames=frames == "fit")
    show(table.evaluation_tables(found))
    if json is not None:
        say(f"result: {write_json(json, reports.evaluation_json(found))}")


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
    from workbench.arm.library import load_robot

    arm = load_robot(calibrated, tip=tip)
    if urdf is None and toml is None and controller is None:
        raise OptionError("give at least one of --urdf FILE, --toml FILE, --controller FILE")
    if controller is not None and nominal is None:
        raise OptionError("--controller needs --nominal ROBOT, the model that the controller has")
    check_writable(urdf, toml, controller)
    for path in (urdf, toml):
        if path is not None:
            say(f"{arm.name}: {save_robot(arm, path)}")
    if controller is not None and nominal is not None:
        from workbench.identification.report.use import use_of
        from workbench.report.json import write_json

        use = use_of(arm, load_robot(nominal))
        show(use.summary())
        say(f"controller: {write_json(controller, {'robot': arm.name, 'controller': use.json()})}")
