"""The commands about fixture plates: `workbench plate score|compare`."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Annotated, Any

import workbench as wb
from workbench.base.errors import OptionError
from workbench.cli import options as opt
from workbench.cli.exit_status import group
from workbench.cli.options import argument, option

plates = group("plate", "Fixture plates: score, design, manufacture.")

PlateArgument = Annotated[str, argument("Plate: a .toml file, or the built-in table2.")]
NoiseOption = Annotated[
    str | None, option('Standard deviations of the instrument: "0.1mm,0.02deg"; typical ones if not given.')
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


USUAL_NOISE = "0.1mm,0.02deg"
"""Instrument assumed for the comparison."""


def sigma_of(noise: str | None) -> tuple[float, float] | None:
    """Given standard deviations [m], [rad]; None for typical ones."""
    return None if noise is None else opt.noise_of(noise)[:2]


def production_of(plate, tolerance: str | None, play: str | None):
    """Tolerances of a plate: as given, the rest from its file; None if nothing was given."""
    from workbench.plate.tolerances import PIN_PLAY

    production = plate.production
    if tolerance is not None:
        position, angle = opt.pair_of(tolerance, "--tolerance")
        production = replace(production, position=position, angle=angle)
    if play is not None:
        given = {"pins": PIN_PLAY, "none": (0.0, 0.0)}
        production = replace(production, play=given[play] if play in given else opt.pair_of(play, "--play"))
    return production


@dataclass(frozen=True)
class ScoreOptions:
    """Options for the assumptions and the output of a plate's score."""

    noise: NoiseOption = None
    tolerance: ToleranceOption = None
    play: PlayOption = None
    unknown: opt.UnknownOption = None
    seed: opt.SeedOption = 0

    @contextmanager
    def choices(self, what: str) -> Iterator[dict[str, Any]]:
        """Arguments of a score by name, while its progress is shown."""
        base, tool = opt.unknown_frames(self.unknown)
        with opt.progress_bar(what):
            yield {"seed": self.seed, "base": base, "tool": tool}


@plates.command()
@opt.flattened
def score(plate: PlateArgument, robot: opt.RobotOption, how: ScoreOptions) -> None:
    """Score a plate: O per target, all observability indices, predicted errors in its region."""
    from workbench.plate.report.plates import score_json

    with how.choices("score") as choices:
        fixture = wb.load_plate(plate)
        fixture = replace(fixture, production=production_of(fixture, how.tolerance, how.play))
        found = wb.score(wb.load_robot(robot), fixture, sigma=sigma_of(how.noise), **choices)
    opt.show(found.blocks())
    opt.write_result(score_json(found))


@plates.command()
@opt.flattened
def compare(
    plate: Annotated[list[str], argument("Two or more plates: .toml files, or built-in ones.")],
    robot: opt.RobotOption,
    how: ScoreOptions,
) -> None:
    """Compare plates under equal assumptions: predicted errors in the first one's region, ranks, indices."""
    from workbench.plate.report.plates import comparison_blocks, comparison_json
    from workbench.plate.score import alike, score_plates

    if len(plate) < 2:
        raise OptionError("plate compare needs at least two plates, got one")
    with how.choices("compare") as choices:
        arm, own = wb.load_robot(robot), _with_unique_names([wb.load_plate(one) for one in plate], plate)
        is_stated = how.tolerance is not None or how.play is not None
        given = production_of(own[0], how.tolerance, how.play) if is_stated else None
        found, stated = (
            score_plates(arm, plates, sigma=sigma_of(noise), **choices)
            for plates, noise in ((alike(own, given), how.noise or USUAL_NOISE), (own, how.noise))
        )
    opt.show(comparison_blocks(found, stated))
    opt.write_result(comparison_json(found, stated))


def _with_unique_names(plates, given: list[str]) -> list:
    """Plates with repeated names are labelled with their files."""
    from collections import Counter

    counts = Counter(one.name for one in plates)
    return [
        replace(one, name=f"{one.name} ({file})") if counts[one.name] > 1 else one
        for one, file in zip(plates, given, strict=True)
    ]
