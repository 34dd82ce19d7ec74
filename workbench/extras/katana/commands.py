"""Command: loading."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.exit_status import in_section
from workbench.cli.options import argument, option


@in_section("Calibrate")
def loading(
    robot: Annotated[str, argument("Robot with masses: a .toml file, or a built-in arm.")],
    joints: Annotated[
        str | None, option("Joints to load, such as 2,3; default: all, by side pulls if gravity can't.")
    ] = None,
    added_mass: Annotated[float, option("Mass that can be attached to the tool [kg].")] = 0.0,
    pairs: Annotated[int, option("Pairs of postures for each joint and purpose.")] = 4,
    repeats: Annotated[int, option("Readings per posture.")] = 10,
    force: Annotated[float, option("Maximum side pull at the tool [N].")] = 40.0,
    centre_tolerance: Annotated[
        str, option("Standard deviation of the links' centres of mass along each axis.")
    ] = "2mm",
    out: Annotated[Path | None, option("Write postures, readings and a picture into this folder.")] = None,
    json: opt.JsonOption = None,
    seed: opt.SeedOption = 0,
) -> None:
    """Postures in which inclinometers reveal clearance, backlash and stiffness, tried on a virtual arm."""
    from workbench.extras.katana.load_test.experiment import run_load_test
    from workbench.extras.katana.load_test.report import load_test_json, load_test_table

    opt.check_writable(json, folder=out)
    found = run_load_test(
        wb.load_robot(robot),
        joints=None if joints is None else [n - 1 for n in opt.whole_numbers(joints, "--joints")],
        added_mass=added_mass,
        each=pairs,
        repeats=repeats,
        force=force,
        centre_tolerance=opt.length(centre_tolerance),
        seed=seed,
    )
    opt.show(load_test_table(found))
    if out is not None:
        opt.say(f"postures, readings, picture: {_write(found, out)}")
    opt.write_result(json, load_test_json(found))


def _write(found, out: Path) -> Path:
    """The folder of an experiment."""
    from workbench.base.files import write_folder
    from workbench.data.writer import measurements_csv
    from workbench.extras.katana.load_test.report import load_test_figure, postures_csv
    from workbench.report.figures import svg

    return write_folder(
        out,
        {
            "postures.csv": postures_csv(found.plan).encode(),
            "readings.csv": measurements_csv(found.data).encode(),
            "loading.svg": svg(load_test_figure(found), "loading").encode(),
        },
    )
