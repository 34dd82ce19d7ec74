"""The commands about fixture plates: `workbench plate score|compare|cluster …`."""

from pathlib import Path
from typing import Annotated

import typer

from workbench.base.errors import OptionError
from workbench.cli.options import (
    JsonOption,
    RobotOption,
    SeedOption,
    UnknownOption,
    check_writable,
    noise_of,
    progress_bar,
    region_of,
    say,
    show,
    unknown_frames,
)

plates = typer.Typer(
    name="plate", help="Fixture plates: their score, their design, their making.", no_args_is_help=True
)

PlateArgument = Annotated[str, typer.Argument(help="Plate: a .toml file, or the built-in table2.")]
NoiseOption = Annotated[str, typer.Option(help='Standard deviations of the instrument: "0.1mm,0.02deg".')]


@plates.command()
def score(
    plate: PlateArgument,
    robot: RobotOption,
    noise: NoiseOption = "0.1mm,0.02deg",
    unknown: UnknownOption = None,
    json: JsonOption = None,
    seed: SeedOption = 0,
) -> None:
    """What a plate tells about the arm: O per target, all indices, predicted errors in its region."""
    from workbench.arm.built_in_arms import load_robot
    from workbench.plate.operations import score_plate
    from workbench.plate.parts.as_measured import load_plate
    from workbench.plate.report.plates import score_json, score_tables

    check_writable(json)
    base, tool = unknown_frames(unknown)
    with progress_bar("score") as progress:
        found = score_plate(
            load_robot(robot),
            load_plate(plate),
            sigma=tuple(noise_of(noise)),
            seed=seed,
            progress=lambda part: progress(part, "choosing branches"),
            base=base,
            tool=tool,
        )
    show(score_tables(found))
    if json is not None:
        from workbench.report.json import write_json

        say(f"result: {write_json(json, score_json(found))}")


@plates.command()
def compare(
    plate: Annotated[list[str], typer.Argument(help="Two or more plates: .toml files, or built-in ones.")],
    robot: RobotOption,
    noise: NoiseOption = "0.1mm,0.02deg",
    unknown: UnknownOption = None,
    json: JsonOption = None,
    seed: SeedOption = 0,
) -> None:
    """Plates side by side: errors predicted in the first one's region, ranks and indices."""
    from workbench.arm.built_in_arms import load_robot
    from workbench.plate.operations import score_plates
    from workbench.plate.parts.as_measured import load_plate
    from workbench.plate.report.plates import comparison_json, comparison_table

    if len(plate) < 2:
        raise OptionError("plate compare needs at least two plates, got one")
    check_writable(json)
    base, tool = unknown_frames(unknown)
    with progress_bar("compare") as progress:
        found = score_plates(
            load_robot(robot),
            [load_plate(one) for one in plate],
            sigma=tuple(noise_of(noise)),
            seed=seed,
            progress=lambda part: progress(part, "choosing branches"),
            base=base,
            tool=tool,
        )
    show(comparison_table(found))
    if json is not None:
        from workbench.report.json import write_json

        say(f"result: {write_json(json, comparison_json(found))}")


@plates.command()
def cluster(
    robot: RobotOption,
    region: Annotated[
        str, typer.Option(help='A plate whose region is meant, or "x,y,z:x,y,z", its corners in m.')
    ] = "table2",
    plate: Annotated[
        str | None, typer.Option(help="A plate whose region is meant, and near whose orientations to stay.")
    ] = None,
    side: Annotated[
        str | None, typer.Option(help="Side of the cubes; as the plate says if not given.")
    ] = None,
    number: Annotated[int, typer.Option(help="How many poses.")] = 10,
    index: Annotated[
        str, typer.Option(help="Chooses between sets of equal O: I (predicted error), O1 … O5, A, D.")
    ] = "I",
    cone: Annotated[str, typer.Option(help="With --plate: how far from its orientations.")] = "60deg",
    out: Annotated[Path | None, typer.Option(help="Write the poses as a plate here (.toml).")] = None,
    json: JsonOption = None,
    seed: SeedOption = 0,
) -> None:
    """Workspace clustering: poses with equal O in different cubes of a region, the best such set."""
    from workbench.arm.built_in_arms import load_robot
    from workbench.base.units import Quantity, parse_quantity
    from workbench.plate.operations import cluster_region
    from workbench.plate.plate_toml import load_plate, write_plate
    from workbench.plate.report.plates import cluster_json, cluster_tables

    check_writable(out, json)
    arm = load_robot(robot)
    fixture = None if plate is None else load_plate(plate)
    with progress_bar("cluster") as progress:
        found = cluster_region(
            arm,
            region_of(region) if fixture is None else fixture.region,
            number=number,
            side=None if side is None else parse_quantity(side, Quantity.LENGTH),
            index=index,
            towards=None if fixture is None or not len(fixture) else fixture.poses[:, :3, :3],
            cone=parse_quantity(cone, Quantity.ANGLE),
            seed=seed,
            progress=lambda part: progress(part, "looking for equal O"),
        )
    show(cluster_tables(found))
    if out is not None:
        say(f"plate: {write_plate(found.plate(), out)}")
    if json is not None:
        from workbench.report.json import write_json

        say(f"result: {write_json(json, cluster_json(found))}")
