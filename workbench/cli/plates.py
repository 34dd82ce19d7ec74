"""The commands about fixture plates: `workbench plate score`."""

from dataclasses import replace
from typing import Annotated, Any

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.exit_status import group
from workbench.cli.options import argument, option

plates = group("plate", "Fixture plates: score, design, manufacture.")

PlateArgument = Annotated[str, argument("Plate: a .toml file, or the built-in table2.")]
NoiseOption = Annotated[
    str | None,
    option("--noise", 'Standard deviations of the instrument: "0.1mm,0.02deg"; typical ones if not given.'),
]
ToleranceOption = Annotated[
    str | None,
    option('Manufacturing tolerance (±) of holes and blocks: "0.05mm,0.05deg"; default: the plate file.'),
]
PlayOption = Annotated[
    str | None,
    option(
        'Play of the probe in a seat (±): "0.012mm,0.08deg"; pins: that of the drawn g6 pins; none. '
        "Default: the plate file; optimise assumes pins if it states none."
    ),
]


def plate_made(source: str, **given: Any):
    """A plate with the tolerance and the play that are given, the rest as in its file."""
    plate = wb.load_plate(source)
    changed = {name: text for name, text in given.items() if text is not None}
    return replace(plate, production=replace(plate.production, **changed))


@plates.command()
def score(
    plate: PlateArgument,
    robot: opt.RobotOption,
    sigma: NoiseOption = None,
    tolerance: ToleranceOption = None,
    play: PlayOption = None,
    unknown: opt.UnknownOption = None,
    seed: opt.SeedOption = 0,
) -> None:
    """Score a plate: O per target, all observability indices, predicted errors in its region."""
    from workbench.plate.report.plates import score_json

    base, tool = opt.unknown_frames(unknown)
    with opt.progress_bar("score"):
        fixture = plate_made(plate, tolerance=tolerance, play=play)
        found = wb.score(wb.load_robot(robot), fixture, sigma=sigma, seed=seed, base=base, tool=tool)
    opt.show(found.blocks())
    opt.write_result(score_json(found))
