"""The command that finds what the model of an arm lacks."""

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


def diagnose(
    data: DataArgument,
    robot: RobotOption,
    held_out: HeldOutOption = "0.2",
    frames: FramesOption = "auto",
    region: RegionOption = None,
    save: SaveOption = None,
    report: ReportOption = None,
    json: JsonOption = None,
    free: FreeOption = None,
    exclude: ExcludeOption = None,
    noise: NoiseOption = None,
    tool_markers: ToolMarkersOption = None,
    base_markers: BaseMarkersOption = None,
    seed: SeedOption = 0,
    columns: ColumnsOption = None,
    sheet: SheetOption = None,
    layout: LayoutOption = None,
) -> None:
    """Find the effects that the geometry lacks, add them, and report the held-out error before and after."""
    from workbench.arm.library import load_robot
    from workbench.diagnosis.diagnose import diagnose
    from workbench.diagnosis.report.json import diagnosis_json
    from workbench.diagnosis.report.table import diagnosis_tables
    from workbench.plate.parts.as_measured import load_plate
    from workbench.report.json import write_json

    arm = load_robot(robot)
    rows = with_markers(read_rows(data, arm, columns, sheet, layout), tool_markers, base_markers)
    check_robot_file(save, effects=True)
    check_writable(save, json, folder=report)
    with progress_bar("diagnose") as progress:
        run = diagnose(
            arm,
            rows,
            held_out=held_out_of(held_out, arm, columns, sheet, layout),
            frames=frames,
            free=names_of(free),
            exclude=dict.fromkeys(whole_numbers(exclude, "--exclude"), "by hand"),
            region=None if region is None else load_plate(region).region,
            noise=None if noise is None else noise_of(noise),
            seed=seed,
            progress=progress,
        )
    show(diagnosis_tables(run))
    if save is not None:
        say(f"calibrated robot: {save_robot(run.calibrated, save)}")
    if json is not None:
        say(f"result: {write_json(json, diagnosis_json(run))}")
    if report is not None:
        from workbench.diagnosis.report.page import write_diagnosis

        say(f"report: {write_diagnosis(run, report)}")
    check_converged(run.after_fit)
