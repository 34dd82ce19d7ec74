"""Command: plate tradeoff."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.options import option
from workbench.cli.plates import PlateArgument


def tradeoff(
    plate: PlateArgument,
    robot: opt.RobotOption,
    out: Annotated[Path, option("Folder for the plot and a plate (.toml) for each option.")],
    targets: Annotated[str, option("Numbers of targets.")] = "8,12,16",
    made: Annotated[str, option("Manufacturing methods.")] = "machined,printed,breadboard",
    places: Annotated[int, option("Number of random blocks at the start of each search.")] = 500,
    arms: Annotated[int, option("Number of virtual arms to try each plate on; 0: none.")] = 0,
    json: opt.JsonOption = None,
    seed: opt.SeedOption = 0,
) -> None:
    """Predicted error by number of targets, block shapes and manufacturing method."""
    from workbench.base.files import write_folder
    from workbench.extras.production.tradeoff import weigh_choices
    from workbench.plate.plate_toml import plate_text
    from workbench.report.figures import png

    opt.check_writable(json, folder=out)
    with opt.progress_bar("tradeoff"):
        found = weigh_choices(
            wb.load_robot(robot),
            wb.load_plate(plate),
            numbers=opt.whole_numbers(targets, "--targets"),
            manners=tuple(name.strip() for name in made.split(",")),
            places=places,
            arms=arms,
            seed=seed,
        )
    opt.show(found.summary())
    files = {f"{c.name.replace(', ', '-').replace(' ', '-')}.toml": c.design.plate for c in found.choices}
    written = {name: plate_text(each).encode() for name, each in files.items()}
    opt.say(
        f"picture and {len(files)} plates: {write_folder(out, written | {'tradeoff.png': png(found.plot())})}"
    )
    opt.write_result(json, found.json())
