"""Command: plate cluster."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.options import option


def cluster(
    robot: opt.RobotOption,
    region: Annotated[
        str, option('A plate whose region to use, or "x,y,z:x,y,z", its corners in m.')
    ] = "table2",
    plate: Annotated[
        str | None, option("A plate whose region to use and whose orientations to stay close to.")
    ] = None,
    side: Annotated[str | None, option("Side of the cubes; as the plate says if not given.")] = None,
    number: Annotated[int, option("Number of poses.")] = 10,
    index: Annotated[
        str, option("Criterion for choosing between sets of equal O: I (predicted error), O1 … O5, A, D.")
    ] = "I",
    cone: Annotated[str, option("With --plate: maximum angle from its orientations.")] = "60deg",
    out: Annotated[Path | None, option("Write the poses as a plate here (.toml).")] = None,
    json: opt.JsonOption = None,
    seed: opt.SeedOption = 0,
) -> None:
    """Workspace clustering: poses with equal O in different cubes of a region, the best such set."""
    from workbench.extras.poses.clustering.design import cluster_region
    from workbench.extras.poses.clustering.report import cluster_json, cluster_tables
    from workbench.plate.plate_toml import load_plate

    opt.check_writable(out, json)
    arm = wb.load_robot(robot)
    fixture = None if plate is None else load_plate(plate)
    with opt.progress_bar("cluster"):
        found = cluster_region(
            arm,
            opt.region_of(region) if fixture is None else fixture.region,
            number=number,
            side=None if side is None else opt.length(side),
            index=index,
            towards=None if fixture is None or not len(fixture) else fixture.poses[:, :3, :3],
            cone=opt.angle(cone),
            solid=fixture,
            seed=seed,
        )
    opt.show(cluster_tables(found))
    made = found.plate(fixture)
    opt.say_notes(made.notes)
    if out is not None:
        opt.say(f"plate: {wb.write_plate(made, out)}")
    opt.write_result(json, cluster_json(found))
