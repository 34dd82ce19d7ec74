"""The command of the experiment with inclinometers: loading."""

from pathlib import Path
from typing import Annotated

import typer

import workbench as wb
from workbench.cli import options as opt


def loading(
    robot: Annotated[str, typer.Argument(help="Robot with masses: a .toml file, or a built-in arm.")],
    joints: Annotated[
        str | None,
        typer.Option(help="Joints to load, 2,3 …; else all, those that no gravity turns by side pulls."),
    ] = None,
    added_mass: Annotated[float, typer.Option(help="Mass that can be hung onto the tool [kg].")] = 0.0,
    pairs: Annotated[int, typer.Option(help="Pairs of postures for every joint and purpose.")] = 4,
    repeats: Annotated[int, typer.Option(help="Readings of every posture.")] = 10,
    force: Annotated[float, typer.Option(help="Greatest side pull at the tool [N].")] = 40.0,
    out: Annotated[
        Path | None, typer.Option(help="Write postures, readings and a picture into this folder.")
    ] = None,
    json: opt.JsonOption = None,
    seed: opt.SeedOption = 0,
) -> None:
    """Postures in which inclinometers show clearance, backlash and stiffness, tried on a virtual arm."""

    from workbench.identification.load_test.experiment import run_load_test
    from workbench.identification.load_test.report import load_test_json, load_test_table

    opt.check_writable(json, folder=out)
    found = run_load_test(
        wb.load_robot(robot),
        joints=None if joints is None else [n - 1 for n in opt.whole_numbers(joints, "--joints")],
        added_mass=added_mass,
        each=pairs,
        repeats=repeats,
        force=force,
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
    from workbench.identification.load_test.report import load_test_figure, postures_csv
    from workbench.report.figures import svg

    return write_folder(
        out,
        {
            "postures.csv": postures_csv(found.plan).encode(),
            "readings.csv": measurements_csv(found.data).encode(),
            "loading.svg": svg(load_test_figure(found), "loading").encode(),
        },
    )
