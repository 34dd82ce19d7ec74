"""A plate from the table of a measuring machine: its targets, in the robot's base.

The file is a table like any other (CSV, decimal commas, Excel …): `target` counts from 1, then the place
`x[mm] y[mm] z[mm]`, an orientation in any of the usual forms if there is one, and `sigma_x[mm] …` if the
machine's uncertainty is stated.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from workbench.base import se3
from workbench.base.arguments import LengthAndAngle, Like, checked_arguments
from workbench.base.errors import FileError
from workbench.base.types import frozen
from workbench.base.units import parse_heading
from workbench.data.readers.fields import Fields, fields_of
from workbench.data.readers.orientation import read_orientation
from workbench.data.readers.read import read_table
from workbench.data.readers.table import Table
from workbench.plate.plate import Kind, Plate, Target
from workbench.plate.plate_toml import built_in_plate, built_in_plates, read_plate
from workbench.plate.region import Region

UNCERTAINTY = (5e-6, float(np.deg2rad(0.01)))
"""Default standard deviations of a measuring machine: position along each axis [m], rotation about each [rad]
of a face as wide as a block."""
MIN_EDGE = 0.01
"""Minimum edge of a region around measured targets [m]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MeasuredTargets:
    """Contents of the machine's file.

    Args:
        numbers: Target of each row, counted from 1.
        poses: Their poses; identity rotation if the file gives none [m].
        turned: Whether the file gives orientations.
        sigma: Standard deviation of position [m] and rotation [rad] of each target.
    """

    source: str
    numbers: tuple[int, ...]
    poses: Float[np.ndarray, "targets 4 4"]
    turned: bool
    sigma: Float[np.ndarray, "targets 2"]
    notes: tuple[str, ...]


def load_plate(source: Path | str) -> Plate:
    """A plate for any `--plate`: a TOML file, a built-in one (`table2`), or the table of a measuring machine.

    Raises:
        FileError: neither a file nor a built-in name, or a file that is no plate.
    """
    path, built_in = Path(source), built_in_plates()
    if (own := built_in.get(str(source).lower())) is not None:
        return built_in_plate(own)
    if not path.suffix:
        known = ", ".join(built_in)
        raise FileError(f"is neither a .toml file nor a built-in plate; built-in: {known}", path=str(source))
    is_table = path.suffix.lower() != ".toml"
    return measured_plate(read_measured_targets(path)) if is_table else read_plate(path)


@checked_arguments()
def read_measured_targets(
    path: Path | str, *, uncertainty: Like[LengthAndAngle] = UNCERTAINTY
) -> MeasuredTargets:
    """The table of a measuring machine.

    Args:
        uncertainty: Standard deviations of the machine where the file has none [m], [rad].
    """
    table = read_table(Path(path))
    numbers = _numbers(table)
    fields = fields_of(table).said
    usable = np.ones(fields.rows, bool)
    missing = [axis for axis in "xyz" if axis not in fields.values]
    if missing:
        raise fields.error(f"there is no column {missing[0]}[mm]; give the position of every target", 0)
    places = np.column_stack([fields.values[axis] for axis in "xyz"])
    rotation, remarks = read_orientation(fields, usable=usable)
    for values, what in ((places, "place"), (rotation, "orientation")):
        if values is not None and not np.isfinite(values).all():
            row = int(np.flatnonzero(~np.isfinite(values.reshape(len(places), -1)).all(axis=1))[0])
            raise fields.error(f"target {numbers[row]} has no {what}; fill it in, or remove the row", row)
    upright = np.broadcast_to(np.eye(3), (len(places), 3, 3))
    sigma, assumed = _sigma(fields, uncertainty, (True, rotation is not None))
    silent = () if rotation is not None else (f"{fields.source} gives positions without orientations",)
    decided = tuple(note for note in fields.notes if not note.lower().startswith("'target'"))
    return MeasuredTargets(
        source=fields.source,
        numbers=numbers,
        poses=frozen(se3.pose(upright if rotation is None else rotation, places)),
        turned=rotation is not None,
        sigma=sigma,
        notes=(*silent, *decided, *remarks, *assumed),
    )


def _numbers(table: Table) -> tuple[int, ...]:
    column = next((i for i, h in enumerate(table.headings) if parse_heading(h).name.lower() == "target"), -1)
    if column < 0:
        raise FileError("there is no column 'target'; number the targets from 1", path=table.source)
    numbers: list[int] = []
    for row, cell in enumerate(table.columns[column]):
        if not cell.isdecimal() or int(cell) < 1 or int(cell) in numbers:
            twice = f"target {cell} is given twice" if cell.isdecimal() and int(cell) in numbers else ""
            text = f"'{cell}' is not a target number; number the targets from 1"
            raise table.error(twice or text, column, row)
        numbers.append(int(cell))
    return tuple(numbers)


def _sigma(
    fields: Fields, uncertainty: tuple[float, float], measured: tuple[bool, bool]
) -> tuple[Float[np.ndarray, "rows 2"], tuple[str, ...]]:
    """Root mean square of the axes' standard deviations of every row, and what was assumed of the machine."""
    sigma, assumed = np.tile(uncertainty, (fields.rows, 1)), []
    texts = (f"{1e3 * uncertainty[0]:.3g} mm", f"{np.rad2deg(uncertainty[1]):.3g}°")
    for column, (axes, text) in enumerate(zip(("xyz", ("rx", "ry", "rz")), texts, strict=True)):
        keys = [f"sigma_{axis}" for axis in axes if f"sigma_{axis}" in fields.values]
        given = np.array([fields.values[key] for key in keys]).reshape(-1, fields.rows)
        known = np.isfinite(given).all(axis=0) & bool(keys)
        if known.any():
            sigma[known, column] = np.sqrt(np.mean(given[:, known] ** 2, axis=0))
        assumed += [text] if measured[column] and not known.all() else []
    note = f"{fields.source} does not state the machine's accuracy; assuming {', '.join(assumed)} (one σ)"
    return frozen(sigma), (note,) if assumed else ()


def measured_plate(measured: MeasuredTargets) -> Plate:
    """A plate of nothing but measured targets, in the robot's base; its region is their bounding box."""
    order = np.argsort(measured.numbers)
    kind = Kind.SEAT if measured.turned else Kind.SOCKET
    sigma = [(position, rotation) for position, rotation in measured.sigma.tolist()]
    targets = tuple(Target.at(measured.poses[i], kind=kind, sigma=sigma[i]) for i in order)
    places = measured.poses[:, :3, 3]
    low, high = places.min(axis=0), places.max(axis=0)
    centre = 0.5 * (low + high)
    note = (
        f"{measured.source}: {len(targets)} targets as measured, in the robot's base; as the file has "
        "no region, their bounding box is used"
    )
    return Plate(
        name=f"{Path(measured.source).stem} (as measured)",
        targets=targets,
        region=Region(
            min=np.minimum(low, centre - 0.5 * MIN_EDGE), max=np.maximum(high, centre + 0.5 * MIN_EDGE)
        ),
        xyz=frozen(centre),
        notes=(note, *measured.notes),
    )
