"""The commands about fixture plates: `workbench plate score|compare|cluster|export`."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import workbench as wb
from workbench.base.errors import OptionError
from workbench.base.wording import plural
from workbench.cli import options as opt
from workbench.cli.exit_status import group
from workbench.cli.options import argument, option

plates = group("plate", "Fixture plates: score, design, manufacture.")

PlateArgument = Annotated[str, argument("Plate: a .toml file, or the built-in table2.")]
NoiseOption = Annotated[
    str | None, option('Standard deviations of the instrument: "0.1mm,0.02deg"; usual ones if not given.')
]
ToleranceOption = Annotated[
    str | None, option('Made within ±: holes and blocks, "0.05mm,0.05deg"; as the plate says if not given.')
]
PlayOption = Annotated[
    str | None,
    option(
        'Play of the probe in a seat (±): "0.012mm,0.08deg"; pins: that of the drawn g6 pins; none. '
        "As the plate says if not given; optimise assumes pins where it states none."
    ),
]


USUAL = "0.1mm,0.02deg"
"""Instrument assumed for the comparison."""


def sigma_of(noise: str | None) -> tuple[float, float] | None:
    """Standard deviations as given [m], [rad]; None for usual ones."""
    return None if noise is None else opt.noise_of(noise)[:2]


def production_of(plate, tolerance: str | None, play: str | None):
    """Tolerances of a plate: as given, the rest from its file; None if nothing was given."""
    from workbench.plate.parts.stock import Stock

    production = plate.production
    if tolerance is not None:
        position, angle = opt.pair_of(tolerance, "--tolerance")
        production = replace(production, position=position, angle=angle)
    if play is not None:
        given = {"pins": Stock().play, "none": (0.0, 0.0)}
        production = replace(production, play=given[play] if play in given else opt.pair_of(play, "--play"))
    return production


@dataclass(frozen=True)
class ScoreOptions:
    """Options for the assumptions and the output of a plate's score."""

    noise: NoiseOption = None
    tolerance: ToleranceOption = None
    play: PlayOption = None
    unknown: opt.UnknownOption = None
    json: opt.JsonOption = None
    seed: opt.SeedOption = 0

    @contextmanager
    def choices(self, what: str) -> Iterator[dict[str, Any]]:
        """Arguments of a score by name, while its progress is shown."""
        opt.check_writable(self.json)
        base, tool = opt.unknown_frames(self.unknown)
        with opt.progress_bar(what):
            yield {"seed": self.seed, "base": base, "tool": tool}


@plates.command()
@opt.flattened
def score(plate: PlateArgument, robot: opt.RobotOption, how: ScoreOptions) -> None:
    """How well a plate determines the arm: O per target, all indices, predicted errors in its region."""
    from workbench.plate.report.plates import score_json, score_tables

    with how.choices("score") as choices:
        fixture = wb.load_plate(plate)
        fixture = replace(fixture, production=production_of(fixture, how.tolerance, how.play))
        found = wb.score(wb.load_robot(robot), fixture, sigma=sigma_of(how.noise), **choices)
    opt.show(score_tables(found))
    opt.write_result(how.json, score_json(found))


@plates.command()
@opt.flattened
def compare(
    plate: Annotated[list[str], argument("Two or more plates: .toml files, or built-in ones.")],
    robot: opt.RobotOption,
    how: ScoreOptions,
) -> None:
    """Compare plates as if made alike: errors predicted in the first one's region, ranks, indices."""
    from workbench.plate.report.plates import comparison_json, comparison_table
    from workbench.plate.score import alike, score_plates

    if len(plate) < 2:
        raise OptionError("plate compare needs at least two plates, got one")
    with how.choices("compare") as choices:
        arm, own = wb.load_robot(robot), _with_unique_names([wb.load_plate(one) for one in plate], plate)
        is_stated = how.tolerance is not None or how.play is not None
        given = production_of(own[0], how.tolerance, how.play) if is_stated else None
        found, stated = (
            score_plates(arm, plates, sigma=sigma_of(noise), **choices)
            for plates, noise in ((alike(own, given), how.noise or USUAL), (own, how.noise))
        )
    opt.show(comparison_table(found, stated))
    opt.write_result(how.json, comparison_json(found, stated))


def _with_unique_names(plates, given: list[str]) -> list:
    """Plates whose names repeat are called by name and file."""
    from collections import Counter

    counts = Counter(one.name for one in plates)
    return [
        replace(one, name=f"{one.name} ({file})") if counts[one.name] > 1 else one
        for one, file in zip(plates, given, strict=True)
    ]


@plates.command()
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
    from workbench.plate.design import cluster_region
    from workbench.plate.plate_toml import load_plate
    from workbench.plate.report.plates import cluster_json, cluster_tables

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


@plates.command()
def export(
    plate: PlateArgument,
    out: Annotated[Path, option("Folder for the files; made if it is not there.")],
    formats: Annotated[
        str | None, option("What to write, such as stl,csv (another name lists all); all usual ones.")
    ] = None,
    robot: Annotated[str | None, option("Arm for which the sheet states the expected accuracy.")] = None,
    noise: NoiseOption = None,
    tolerance: ToleranceOption = None,
    made: Annotated[str, option("Made how: machined, printed, breadboard or ball-bar.")] = "machined",
    printed: Annotated[bool, option("--printed", "The same as --made printed.")] = False,
) -> None:
    """Export all that is needed to make a plate: drawings, solids, lists, and the expected accuracy."""
    from workbench.plate.optimiser.manufacturing import METHODS
    from workbench.plate.parts import export as plate_production
    from workbench.plate.parts.stock import Stock

    wanted = () if formats is None else plate_production.formats_named(formats)
    opt.check_writable(folder=out)
    given, made = wb.load_plate(plate), "printed" if printed else made
    opt.choice_of(METHODS, made, "--made")
    with opt.progress_bar("plate"):
        fixture, files, missing = plate_production.export_plate(
            replace(given, production=production_of(given, tolerance, None)),
            out,
            formats=wanted,
            robot=None if robot is None else wb.load_robot(robot),
            sigma=sigma_of(noise),
            stock=Stock.named(made),
        )
    shapes = ", ".join(f"{len(shape.numbers)} × {shape.letter}" for shape in fixture.shapes)
    opt.say(f"{fixture.name}: plate and {plural(len(fixture.blocks), 'block')} ({shapes}) in {out}")
    opt.say_notes(fixture.notes)
    opt.say(f"drawn for {fixture.tolerances.note}")
    opt.say(f"files: {', '.join(path.name for path in files)}")
    for kind, why in missing.items():
        opt.say(f"not written: {kind}; {why}")
    if missing and formats is not None:
        opt.fail(f"{', '.join(missing)} could not be written")
