"""The commands about fixture plates: `workbench plate score|compare …`."""

from typing import Annotated

import typer

from workbench.cli.options import (
    JsonOption,
    RobotOption,
    SeedOption,
    check_writable,
    noise_of,
    progress_bar,
    say,
    show,
)
from workbench.errors import OptionError

plates = typer.Typer(
    name="plate", help="Fixture plates: their score, their design, their making.", no_args_is_help=True
)

PlateArgument = Annotated[str, typer.Argument(help="Plate: a .toml file, or the built-in table2.")]
NoiseOption = Annotated[str, typer.Option(help='Standard deviations of the instrument: "0.1mm,0.02deg".')]
FreeFramesOption = Annotated[
    str | None,
    typer.Option("--unknown", help="Frames that are identified too: base, tool, base,tool, or none."),
]


def unknown_frames(text: str | None) -> dict[str, bool | None]:
    """Which frames are identified, from words such as `base,tool`; as the robot's file says if not given."""
    if text is None:
        return {"base": None, "tool": None}
    words = set() if text == "none" else {word.strip() for word in text.split(",")}
    if strange := words - {"base", "tool"}:
        raise OptionError(f"--unknown takes base, tool, both with a comma, or none, not '{min(strange)}'")
    return {"base": "base" in words, "tool": "tool" in words}


@plates.command()
def score(
    plate: PlateArgument,
    robot: RobotOption,
    noise: NoiseOption = "0.1mm,0.02deg",
    unknown: FreeFramesOption = None,
    json: JsonOption = None,
    seed: SeedOption = 0,
) -> None:
    """What a plate tells about the arm: O per target, all indices, predicted errors in its region."""
    from workbench import pipeline
    from workbench.report.plates import score_json, score_tables

    check_writable(json)
    found = _scored(pipeline, plate, robot, noise, unknown, seed)
    show(score_tables(found))
    if json is not None:
        from workbench.report.json import write_json

        say(f"result: {write_json(json, score_json(found))}")


@plates.command()
def compare(
    plate: Annotated[list[str], typer.Argument(help="Two or more plates: .toml files, or built-in ones.")],
    robot: RobotOption,
    noise: NoiseOption = "0.1mm,0.02deg",
    unknown: FreeFramesOption = None,
    json: JsonOption = None,
    seed: SeedOption = 0,
) -> None:
    """Plates side by side: predicted errors, ranks and indices."""
    from workbench import pipeline
    from workbench.report.plates import comparison_json, comparison_table

    if len(plate) < 2:
        raise OptionError("plate compare needs two plates or more")
    check_writable(json)
    found = [_scored(pipeline, one, robot, noise, unknown, seed) for one in plate]
    show(comparison_table(found))
    if json is not None:
        from workbench.report.json import write_json

        say(f"result: {write_json(json, comparison_json(found))}")


def _scored(pipeline, plate: str, robot: str, noise: str, unknown: str | None, seed: int):
    from workbench.design.plate_toml import load_plate
    from workbench.robots import load_robot

    with progress_bar("score") as progress:
        return pipeline.score_plate(
            load_robot(robot),
            load_plate(plate),
            sigma=tuple(noise_of(noise)),
            seed=seed,
            progress=lambda part: progress(part, f"{plate}: choosing branches"),
            **unknown_frames(unknown),
        )
