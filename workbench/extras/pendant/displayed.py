"""Joint positions and poses as a pendant shows them: numbers with a last digit, their meaning still open."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product, takewhile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.joint_units import sliding
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError, FileError, OptionError
from workbench.base.units import Quantity, parse_heading
from workbench.data.dataset import Dataset
from workbench.data.orientations import ORIENTATIONS, WrittenOrientation
from workbench.data.readers.assemble import ORIENTED, assemble
from workbench.data.readers.column_meanings import TableColumn, interpret_columns
from workbench.data.readers.columns_option import IGNORED, NamedUnit
from workbench.data.readers.fields import fields_of, to_numbers
from workbench.data.readers.headings import CONTROLLER
from workbench.data.readers.orientation import FORMS
from workbench.data.readers.read import file_layout, read_grid, read_measurements, read_table
from workbench.data.readers.table import NUMBER, Grid, Table, with_names
from workbench.identification.meaning.as_read import with_units
from workbench.identification.meaning.conventions import Convention
from workbench.identification.meaning.reading import RowReading

MAX_READINGS = 400
"""Rows of a log that are taken, evenly spread; half of them where the arm stood, if it did."""
STOOD = 1e-6
"""Change [rad or m] to the next row below which the arm stood, so that what was read late is true."""
WHOSE = re.compile(r"(pose)_([a-z]+)(_\d)", re.I)
"""A number of a pose that says of what it is, such as `pose_flange_1`."""
SIZES = {"m": 1.0, "mm": 1e-3, "rad": 1.0, "deg": float(np.deg2rad(1.0)), "": 1.0}
LENGTHS, ANGLES = (1.0, SIZES["mm"]), (1.0, SIZES["deg"])
WHAT = "give columns q1 … qN, x, y, z and the three or four numbers of the orientation, one pose a line"


class Shown(NamedTuple):
    """Numbers of some columns as they stand there.

    Args:
        steps: Values of last digits.
        unit: In which they are shown; empty where nothing says it.
        scales: Of each column, into SI; NaN where nothing says its unit.
    """

    numbers: Float[np.ndarray, "rows k"]
    steps: Float[np.ndarray, "rows k"]
    unit: str = ""
    scales: Float[np.ndarray, " k"] | float = np.nan


@dataclass(frozen=True, eq=False, kw_only=True)
class Displayed:
    """Poses as shown, in SI, where nothing says a unit by the usual one.

    Args:
        data: Joint positions and poses of the tool, their orientation in a convention that is open.
        units: In which joints, positions and angles are shown; empty for what are no angles.
        steps: Values of last digits of joints, positions and orientations.
        is_told: Whether the unit of joints stands there.
        named: Convention of the orientation that headings name, as in `data/orientations.py`; empty if none.
        stood: Whether the arm stood there, of a log; empty where that isn't known.
    """

    data: Dataset
    units: tuple[str, str, str]
    steps: Sequence[Float[np.ndarray, "rows _"]]
    is_told: bool
    named: str = ""
    stood: Sequence[bool] = ()

    def meaning(self, reading: RowReading) -> "DisplayMeaning":
        """What the numbers are in a reading of them."""
        joint, length, angle = self.units
        other, convention = {"deg": "rad", "rad": "deg"}, reading.convention or Convention()
        joint = joint if reading.unit == 1.0 else other[joint]
        angle = (angle if convention.factor == 1.0 else other[angle]) if convention.kind else ""
        changes = replace(reading, unit=1.0).changes
        return DisplayMeaning(joint, length, angle or None, convention.name, changes)


class DisplayMeaning(NamedTuple):
    """What is shown: units of joints, positions and angles, None for what are no angles.

    Args:
        changes: What else is read otherwise than the arm's model says, such as the sign of a joint.
    """

    joints: str
    positions: str
    angles: str | None
    orientation: str
    changes: tuple[str, ...] = ()

    @property
    def assumptions(self) -> tuple[str, str, str]:
        """`joints in deg`, `positions in mm`, `rotation vector (UR) in rad`."""
        turned = f" in {self.angles}" if self.angles else ""
        return f"joints in {self.joints}", f"positions in {self.positions}", f"{self.orientation}{turned}"


def read_display(
    source: Path | str | Dataset | Sequence[str], robot: Robot, *, columns: str | None = None
) -> Displayed:
    """Poses of a table with or without headings, or of a log, as measurements are read; or typed ones."""
    if isinstance(source, Dataset):
        return of_dataset(source, robot)
    if not isinstance(source, Path | str):
        return typed(source, robot)
    path = Path(source)
    if file_layout(path) is not None:  # such as a bag, whose numbers are known in full
        return of_dataset(read_measurements(path, columns=columns, joints=robot), robot)
    try:
        table = read_table(path, columns=columns, joints=robot)
    except FileError:
        if not any(map(NUMBER.fullmatch, (grid := read_grid(path)).rows[0])):  # headings
            raise
        table = _without_headings(grid, robot.dof)
    table, is_named = _completed(table, robot.dof)
    data = assemble(replace(fields_of(table), told_twice=""), joints=robot)
    if data.rotation is None or data.written is None:
        raise table.error(f"no orientation was found; {WHAT}")
    known = {c.key: c for c in interpret_columns(table)}
    same = {name := data.written.name, name[::-1].lower()}  # of columns in reverse
    entries = [known[key] for form in FORMS if form.convention in same for key in form.keys]
    turn = entries if len(entries) == 9 else sorted(entries, key=lambda c: c.index)
    joints, xyz = ([known[key] for key in keys] for keys in ([f"q{k + 1}" for k in range(robot.dof)], "xyz"))
    data, stood = _chosen(data, data.included)
    shown = [_block(table, own, data.row, own is joints) for own in (joints, xyz, turn)]
    return displayed(robot, shown, data.source, data.row, name * is_named, stood)


def displayed(
    robot: Robot, shown: Sequence[Shown], source: str, rows: np.ndarray, name: str = "", stood: Sequence = ()
) -> Displayed:
    """In the units shown, or else degrees, rad of joints within a turn, and lengths that the arm reaches."""
    q, xyz, turn = shown
    far, count = np.linalg.norm(xyz.numbers, axis=1).max(initial=1e-9), turn.numbers.shape[1]
    joint = q.unit or ("deg" if np.abs(q.numbers).max(initial=0.0) > 2.0 * np.pi else "rad")
    length = xyz.unit or min(("m", "mm"), key=lambda unit: abs(np.log(far * SIZES[unit] / robot.reach)))
    angle = turn.unit or "deg" * (count == 3)
    sizes: Any = np.where(sliding(robot), SIZES[length], SIZES[joint]), SIZES[length], SIZES[angle]
    scales = [np.where(np.isnan(s.scales), size, s.scales) for s, size in zip(shown, sizes, strict=True)]
    joints, position, written = (s.numbers * scale for s, scale in zip(shown, scales, strict=True))
    turns = next(kind for kind in ORIENTATIONS if kind.numbers == count).matrices(written)
    data = Dataset(joints, position, turns, written=WrittenOrientation("", written), row=rows, source=source)
    return Displayed(
        data=data,
        units=(joint, length, angle),
        steps=[s.steps * scale for s, scale in zip(shown, scales, strict=True)],
        is_told=bool(q.unit),
        named=name * (name != "rotvec"),
        stood=stood,
    )


def _chosen(data: Dataset, mask: Bool[np.ndarray, " rows"]) -> tuple[Dataset, list[bool]]:
    """Rows of a log that are enough, and which of them are the first at which the arm stood."""
    rows = np.flatnonzero(mask)
    numbers = np.column_stack([data.q, np.asarray(data.position)])[rows]
    stays = np.append(np.abs(np.diff(numbers, axis=0)).max(1) < STOOD, False)[: len(rows)]
    stood = stays & ~np.roll(stays, 1)
    parts = [part for part in (rows[stood], rows[~stood]) if len(part)]
    few = [part[:: -(-len(part) * len(parts) // MAX_READINGS)] for part in parts]
    chosen = np.sort(np.concatenate([rows[:0], *few]))
    data = replace(data.take(chosen), row=chosen, counter="")
    return data, np.isin(chosen, rows[stood]).tolist()


def typed(texts: Iterable[str], robot: Robot) -> Displayed:
    """Poses as `q1,…,qn = x,y,z,a,b,c` (angles, or a quaternion) each."""
    joints, rows = robot.dof, list[tuple[list[str], ...]]()
    for text in texts:
        left, _, right = text.replace("\u2212", "-").partition("=")
        own, pose = (re.split(r"[,;\s]+", part.strip()) for part in (left, right))
        is_right = len(own) == joints and len(pose) in (6, 7) and all(map(NUMBER.fullmatch, own + pose))
        if not is_right or (rows and len(pose) != 3 + len(rows[0][2])):
            wanted = f"{joints} joint positions, =, x, y, z and three angles or a quaternion, with commas"
            raise OptionError(f"the pose '{text}' must be {wanted}")
        rows.append((own, pose[:3], pose[3:]))
    if not rows:
        raise OptionError('no poses are typed; give three or more: --pose "q1,…,qn = x,y,z,a,b,c" for each')
    cells = (np.array(part) for part in zip(*rows, strict=True))
    shown = [Shown(own.astype(float), _last_digits(own, own.astype(float))) for own in cells]
    return displayed(robot, shown, "the typed poses", np.arange(len(rows)))


def of_dataset(data: Dataset, robot: Robot) -> Displayed:
    """Poses of a log or bag in SI, with the last digits that their numbers tell."""
    data = with_units(robot, data) if data.missing_units else data
    if data.position is None or data.rotation is None:
        raise DataError(f"{data.source}: the tool's pose is needed, position and orientation")
    robot.check_joints(data.q, data.source)
    seen = data.included & np.isfinite(data.position).all(1) & np.isfinite(data.rotation).all((1, 2))
    data, stood = _chosen(data, seen)
    name, turn = data.written or ("", se3.matrix_to_quaternion(np.asarray(data.rotation)))
    shown = [
        _told(data.q, "rad", [np.where(sliding(robot), *sizes) for sizes in product(LENGTHS, ANGLES)]),
        _told(np.asarray(data.position), "m", LENGTHS),
        _told(turn, "rad" * (turn.shape[1] == 3), ANGLES),
    ]
    return displayed(robot, shown, data.source, data.row, name, stood)


def _without_headings(grid: Grid, joints: int) -> Table:
    """Joints, place and orientation in this order; numbers of the rows may stand before them."""
    width, counts = len(grid.rows[0]), [row[0] for row in grid.rows]
    first = int(counts in ([str(k + start) for k in range(len(counts))] for start in (0, 1)))
    if width - first - joints not in (6, 7):
        raise grid.error(f"{width} columns, but the arm has {joints} joints; {WHAT}")
    turn = "abcd"[: width - first - joints - 3]
    return with_names(grid, (*[IGNORED] * first, *(f"q{k + 1}" for k in range(joints)), *"xyz", *turn))


def _completed(table: Table, joints: int) -> tuple[Table, bool]:
    """The table with names for joints before the place, and an orientation behind it, where it has none; and
    whether headings name the orientation."""
    bare = [n if n[-1:].isdigit() else CONTROLLER.sub("", n) for n in table.names]
    whose = {n: m[2] for n in bare if (m := WHOSE.fullmatch(n))}
    bare = [WHOSE.sub(r"\1\3", n) if len({*whose.values()}) == 1 else n for n in bare]
    columns = interpret_columns(table := replace(table, names=tuple(bare)))
    places = {c.key: c.index for c in columns}
    if not {*"xyz"} <= places.keys():
        raise table.error(f"no position was found; {WHAT}")
    xyz = [places[axis] for axis in "xyz"]
    first, named = min(xyz) - joints, {}
    if "q1" not in places and first >= 0:
        named = {first + k: f"q{k + 1}" for k in range(joints)}
    if not ORIENTED & places.keys():
        behind = takewhile(lambda c: c.key is None and c.heading != IGNORED, columns[max(xyz) + 1 :])
        turn = (c.index for c in behind if any(map(NUMBER.fullmatch, table.columns[c.index])))
        named |= zip(turn, "abcd", strict=False)
    names = list(table.names)
    for k, name in named.items():
        names[k] = NamedUnit(name, parse_heading(names[k]).unit).heading()
    is_named = bool(ORIENTED & places.keys()) and table.heading_line is not None
    return replace(table, names=tuple(names)), is_named


def _block(table: Table, columns: Sequence[TableColumn], rows: np.ndarray, are_joints: bool) -> Shown:
    """Columns of a table, with the unit that headings say first."""
    cells = np.array([table.columns[c.index] for c in columns])[:, rows].T
    numbers = np.stack([to_numbers(table, c.index)[rows] for c in columns], axis=1)
    known = [None if c.missing_unit else c.conversion for c in columns]
    said = next((c for c in known if c and c.quantity is not Quantity.NUMBER), None)
    names = ("mm", "m") if said and said.quantity is Quantity.LENGTH else ("deg", "rad")
    unit = names[not np.isclose(SIZES[names[0]], said.scale)] if said else ""
    scales = np.array([c.scale if c else np.nan for c in known])
    return Shown(numbers, _last_digits(cells, numbers, are_joints), unit, scales)


def _told(values: Float[np.ndarray, "rows k"], unit: str, sizes: Sequence) -> Shown:
    """Numbers in SI, with last digits, in the unit of some sizes in which they have fewest."""
    found = []
    for size in sizes:
        cells = np.array([re.sub("0*e", "e", f"{v:.11e}") for v in (values / size).flat])
        found.append((max(map(len, cells), default=0), size * _last_digits(cells, values / size)))
    return Shown(values, min(found, key=lambda each: each[0])[1], unit, 1.0)


def _last_digits(
    cells: np.ndarray, numbers: Float[np.ndarray, "rows k"], are_commanded: bool = True
) -> Float[np.ndarray, "rows k"]:
    """Value of each number's last digit, where all are printed with as many decimals, or digits in all; of
    computed numbers those that are zero in every cell were not shown."""
    decimals = digits = 0
    for cell in cells.ravel():
        mantissa, _, power = cell.lower().strip().replace(",", ".").partition("e")
        mantissa = mantissa if are_commanded or "." not in mantissa else mantissa.rstrip("0")
        decimals = max(decimals, len(mantissa.partition(".")[2]) - int(power or 0))
        digits = max(digits, len(mantissa.lstrip("+-\u22120.").replace(".", "")))
    with np.errstate(divide="ignore"):
        order = np.floor(np.log10(np.abs(numbers)))
    return np.maximum(10.0**-decimals, 10.0 ** (order - digits + 1))
