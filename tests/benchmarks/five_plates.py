"""Plates side by side on 10 000 virtual arms each, all error sources in.

Table 2 and the optimised plate as a workshop makes them, with the play of their pins; sockets within
±0.25 mm, ±0.3° (a 3D printer), as they come and as measured to 0.05 mm. Run by hand, all or those named:

    python -m tests.benchmarks.five_plates [arms] [places] [name …]
"""

import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

import workbench as wb
from workbench import Robot, load_plate, load_robot, optimise_plate
from workbench.extras.production.plate_trial import rms_of, try_plate
from workbench.plate.plate import Kind, Plate
from workbench.plate.region_poses import plate_region_poses
from workbench.plate.tolerances import Production
from workbench.report.blocks import ResultTable
from workbench.report.result_display import as_text

JOINT = float(np.deg2rad(0.002))
"""Noise of the joint readings [rad]."""
MEASURED = (5e-5, 1.0)
"""How well a measured socket is known [m], [rad]."""
SEATS = (1e-4, float(np.deg2rad(0.02)))
SOCKETS = (5e-5, float(np.deg2rad(0.02)))
PRINTED = Production(tolerance=(2.5e-4, float(np.deg2rad(0.3))))
Sigma = tuple[float, float]


def plates(robot: Robot, places: int, wanted: tuple[str, ...]) -> Iterator[tuple[str, Plate, Sigma]]:
    """Name, plate, and how well a target returns and is read, of those whose name begins with one wanted."""
    given = load_plate("table2")
    machined = given.made_as_drawn.production
    if "Table 2".startswith(wanted):
        yield "Table 2", replace(given, production=machined), SEATS
    if "optimised".startswith(wanted):
        yield "optimised", optimise_plate(robot, given, production=machined, places=places).plate, SEATS
    if "sockets".startswith(wanted):
        how: dict[str, Any] = {"number": 14, "production": PRINTED, "places": places}
        plate = optimise_plate(robot, given, kind=Kind.SOCKET, **how).plate
        yield "sockets", plate, SOCKETS
        known = tuple(replace(t, sigma=MEASURED) for t in plate.targets)
        yield "sockets, measured", replace(plate, targets=known), SOCKETS


def main(arms: str = "10000", places: str = "1200", *wanted: str) -> None:
    robot, table2 = load_robot("aria"), load_plate("table2")
    headings, rows = ("", "rms [mm]", "95 % [mm]", "predicted [mm]", "yield [%]", "blame"), []
    for name, plate, sigma in plates(robot, int(places), wanted or ("",)):
        poses = plate_region_poses(robot, replace(table2, region=plate.region), 500)
        predicted = wb.score(robot, plate, sigma=sigma, evaluation_poses=poses).measured.error.position_rms
        found = try_plate(robot, plate, arms=int(arms), sigma=sigma, joint_sigma=JOINT, towards=table2)
        each = np.sqrt((found.errors[..., :3] ** 2).sum(-1).mean(-1))
        mm = (rms_of(found.errors)["position_rms_mm"], 1e3 * np.percentile(each, 95), 1e3 * predicted)
        cells = (*(f"{value:.3f}" for value in (*mm, 100 * found.share)), found.blame)
        rows.append((name, *cells))
        print(name, *cells, *found.interval, flush=True)
    print(as_text([ResultTable(f"{arms} arms", headings, rows)]))


if __name__ == "__main__":
    main(*sys.argv[1:])
