"""Plates side by side on 10 000 virtual arms each, all error sources in.

Table 2 and the optimised plates (any blocks, three shapes) as a workshop makes them, with the play of their
pins; sockets on a breadboard and from a printer, as they come and as measured to 0.05 mm; a ball-bar of 5 µm
about three anchors known to 0.05 mm. Run by hand, for all or for those named:

    python -m tests.benchmarks.five_plates [arms] [places] [name …]
"""

import sys
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from rich.console import Console

from workbench.arm.built_in_arms import load_robot
from workbench.arm.effects import JointHarmonic
from workbench.arm.robot import Robot
from workbench.extras.production.plate_trial import try_plate
from workbench.plate.design import optimise_plate
from workbench.plate.optimiser.manufacturing import METHODS
from workbench.plate.optimiser.optimise import DesignRequest
from workbench.plate.optimiser.target_blocks import Blocks
from workbench.plate.plate import Plate
from workbench.plate.plate_toml import load_plate
from workbench.plate.stock import Stock
from workbench.report.tables import new_table

JOINT = float(np.deg2rad(0.002))
"""Noise of the joint readings [rad]."""
UNDECLARED = (JointHarmonic((1,), (1e-5, 1e-5), 1),)
"""What the arms have and nobody knows: an eccentric encoder of joint 2, 15 µrad."""
MEASURED = (5e-5, 1.0)
"""How well a measured socket is known [m], [rad]."""
SEATS = (1e-4, float(np.deg2rad(0.02)))
BAR = (5e-6, float(np.deg2rad(0.02)))
SOCKETS = (5e-5, float(np.deg2rad(0.02)))
Sigma = tuple[float, float]


def plates(robot: Robot, places: int, wanted: tuple[str, ...]) -> Iterator[tuple[str, Plate, Sigma]]:
    """Name, plate, and how well a target returns and is read, of those whose name begins with one wanted."""
    given = load_plate("table2")
    machined = replace(METHODS["machined"].production, play=Stock().play)
    if "Table 2".startswith(wanted):
        yield "Table 2", given.made(machined), SEATS
    for name, shapes in (("optimised", None), ("three shapes", 3)):
        if name.startswith(wanted):
            request = DesignRequest(production=machined, shapes=shapes, places=places)
            yield name, optimise_plate(robot, given, request=request).plate, SEATS
    for name, sigma in (("breadboard", SOCKETS), ("printed", SOCKETS), ("ball-bar", BAR)):
        if not name.startswith(wanted):
            continue
        method = METHODS[name]
        request = DesignRequest(
            number=14, production=method.production, blocks=method.blocks(Blocks()), places=places
        )
        plate = optimise_plate(robot, given, request=request, reading=method.reading).plate
        yield name, plate, sigma
        if name != "ball-bar":
            known = tuple(replace(t, sigma=MEASURED) for t in plate.targets)
            yield f"{name}, measured", replace(plate, targets=known), sigma


def main(arms: str = "10000", places: str = "1200", *wanted: str) -> None:
    robot, table2 = load_robot("aria"), load_plate("table2")
    table = new_table(f"{arms} arms", "", *("rms [mm]", "95 % [mm]", "predicted [mm]", "yield [%]", "blame"))
    for name, plate, sigma in plates(robot, int(places), wanted or ("",)):
        options = {"joint_sigma": JOINT, "undeclared": UNDECLARED, "towards": table2}
        found = try_plate(robot, plate, arms=int(arms), sigma=sigma, **options)
        worst = np.percentile(found.position[found.reached], 95)
        predicted = np.sqrt((found.predicted[:, 0] ** 2 * found.samples).sum() / found.samples.sum())
        cells = (1e3 * found.position_rms, 1e3 * worst, 1e3 * predicted, 100 * found.share)
        table.add_row(name, *(f"{cell:.3f}" for cell in cells), str(found.blame))
        print(name, *(f"{cell:.3f}" for cell in cells), found.blame, flush=True)
    Console().print(table)


if __name__ == "__main__":
    main(*sys.argv[1:])
