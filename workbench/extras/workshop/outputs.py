"""What `plate export` writes for a workshop, each by the name that follows `--formats`."""

import csv
import io
from functools import lru_cache

import numpy as np

from workbench.base import se3
from workbench.extras.workshop.drawing import dxf_of, pdf_of, plate_drawing
from workbench.extras.workshop.fixture import fixture_of
from workbench.extras.workshop.solids import step_of, stl_of
from workbench.plate.export import PlateFile
from workbench.plate.plate import Plate

parts_of = lru_cache(maxsize=1)(fixture_of)
"""The parts of a plate, once for all formats."""


def targets_csv(plate: Plate) -> str:
    """Poses of the tool at the targets in the robot's base, to 1 nm and 1e-6°, as `as-measured` reads them.

    R = Rz(yaw) Ry(pitch) Rx(roll).
    """
    head = ["target", "x[mm]", "y[mm]", "z[mm]", "roll[deg]", "pitch[deg]", "yaw[deg]"]
    columns = [1e3 * plate.poses[:, :3, 3], np.rad2deg(se3.matrix_to_rpy(plate.poses[:, :3, :3]))]
    buffer = io.StringIO()
    rows = ([i, *map(repr, row)] for i, row in enumerate(np.hstack(columns).round(6).tolist(), start=1))
    csv.writer(buffer, lineterminator="\n").writerows([head, *rows])
    return buffer.getvalue()


CSV = PlateFile("csv", lambda plate: {"targets.csv": targets_csv(plate).encode()})
DXF = PlateFile(
    "dxf",
    lambda plate: {"plate.dxf": dxf_of(plate_drawing(parts_of(plate)))},
    notes=lambda plate: parts_of(plate).notes,
)
PDF = PlateFile("pdf", lambda plate: {"plate.pdf": pdf_of(plate_drawing(parts_of(plate)))})
STL = PlateFile(
    "stl", lambda plate: {f"{name}.stl": stl_of(part) for name, part in parts_of(plate).made.items()}
)
STEP = PlateFile(
    "step",
    lambda plate: {
        f"{name}.step": step_of(part, f"{plate.name} {name}") for name, part in parts_of(plate).made.items()
    },
)
