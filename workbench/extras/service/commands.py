"""Commands: fleet."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.base.wording import plural
from workbench.cli import options as opt
from workbench.cli.exit_status import in_section
from workbench.cli.options import argument, option


@in_section("Calibrate")
def fleet(
    folder: Annotated[Path, argument("ARM/DATE.toml (calibrated) or ARM/DATE.csv (measured) for each arm.")],
    robot: Annotated[str | None, option("Nominal robot, with which measurements are identified.")] = None,
    allowed: Annotated[str, option("Drift of the tool after which to measure again.")] = "0.1mm",
    workers: Annotated[
        int | None, option("Processes on this machine; as many as it has cores if not given.")
    ] = None,
    scheduler: opt.SchedulerOption = None,
    json: opt.JsonOption = None,
    report: opt.ReportOption = None,
) -> None:
    """Compare calibrations over time: what moved, by how many σ, since when, and which arm is worst."""
    from workbench.extras.service.fleet.report import fleet_json, fleet_tables, write_fleet

    opt.check_writable(json, folder=report)
    with opt.progress_bar("fleet") as progress:
        found = wb.compare_fleet(
            folder,
            robot=None if robot is None else wb.load_robot(robot),
            allowed=opt.length(allowed),
            workers=workers,
            scheduler=scheduler,
            progress=lambda part: progress(part, "reading and identifying"),
        )
    opt.show(fleet_tables(found))
    opt.write_result(json, fleet_json(found))
    if report is not None:
        opt.say(f"report: {write_fleet(found, report)}")
    if found.unread:
        opt.fail(f"{plural(len(found.unread), 'arm')} could not be compared, such as {found.unread[0].arm}")
