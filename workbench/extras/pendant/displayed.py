"""Joint positions and poses as a pendant shows them: numbers with a last digit, their meaning still open."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import compress, product, takewhile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.joint_units import sliding
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError, FileError, OptionError
from workbench.base.units import Quantity, parse_heading
from workbench.data.dataset import Dataset
from workbench.data.orientations import ORIENTATIONS, WrittenOrientation
from workbench.data.readers.assemble import ORIENTED, assemble
from workbench.data.readers.column_meanings import TableColumn, interpret_columns
from workbench.data.readers.columns_option import IGNORED
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
TYPED = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
SIZES = {"m": 1.0, "mm": 1e-3, "rad": 1.0, "deg": float(np.deg2rad(1.0)), "": 1.0}
LENGTHS, ANGLES = (1.0, SIZES["mm"]), (1.0, SIZES["deg"])
WHAT = "give columns q1 … qN, x, y, z and the three or four numbers of the orientation, one pose a line"
Steps = float | Float[np.ndarray, "rows _"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Displayed:
    """Poses as shown; of each block of columns its unit, if that stands there, and its last digits.

    Args:
        joints: Joint positions, in the unit shown.
        xyz: Position of the tool.
        turn: Its orientation: three numbers, a quaternion, or a matrix row by row.
        units: Units of joints, position and orientation; empty where nothing says it.
        steps: Values of last digits; 0 where the numbers are exact.
        source: For messages.
        rows: Number of each pose in its file, counted from 0.
        named: Convention of the orientation that headings name, as in `data/orientations.py`; empty if none.
        stood: Whether the arm stood there, of a log; empty where that isn't known.
    """

    joints: Float[np.ndarray, "rows n"]
    xyz: Float[np.ndarray, "rows 3"]
    turn: Float[np.ndarray, "rows k"]
    units: tuple[str, str, str] = ("", "", "")
    steps: tuple[Steps, Steps, Steps] = (0.0, 0.0, 0.0)
    source: str = "the typed poses"
    rows: Sequence[int] = field(default=())
    named: str = ""
    stood: Sequence[bool] = field(default=())

    def __len__(self) -> int:
        return len(self.joints)

    def usual_units(self, robot: Robot) -> tuple[str, str, str]:
        """Those shown, or else degrees, rad of joints within a turn, and lengths that the arm reaches."""
        far = np.linalg.norm(self.xyz, axis=1).max(initial=1e-9)
        length = min(("m", "mm"), key=lambda unit: abs(np.log(far * SIZES[unit] / robot.reach)))
        joint = "deg" if np.abs(self.joints).max(initial=0.0) > 2.0 * np.pi else "rad"
        usual = (joint, length, "deg" if self.turn.shape[1] == 3 else "")
        joint, length, angle = (shown or unit for shown, unit in zip(self.units, usual, strict=True))
        return joint, length, angle

    def dataset(self, robot: Robot) -> Dataset:
        """The numbers in usual units, with their orientation as it is written."""
        joint, length, angle = (SIZES[unit] for unit in self.usual_units(robot))
        written = WrittenOrientation("", angle * self.turn)
        first = next(kind for kind in ORIENTATIONS if kind.numbers == self.turn.shape[1])
        return Dataset(
            q=self.joints * np.where(sliding(robot), length, joint),
            position=length * self.xyz,
            rotation=first.matrices(written.numbers),
            written=written,
            row=np.arange(len(self)) if not self.rows else np.array(self.rows),
            source=self.source,
        )

    def meaning(self, robot: Robot, reading: RowReading) -> "DisplayMeaning":
        """What the numbers are in a reading of their dataset."""
        joint, length, angle = self.usual_units(robot)
        other, convention = {"deg": "rad", "rad": "deg"}, reading.convention or Convention()
        joint = joint if reading.unit == 1.0 else other[joint]
        angle = angle if convention.factor == 1.0 else other[angle]
        kind = convention.kind
        units = (joint, length, angle if kind is not None and kind.numbers == 3 else "")
        return DisplayMeaning(units, convention.name, replace(reading, unit=1.0).changes)


class DisplayMeaning(NamedTuple):
    """What is shown.

    Args:
        units: Of joints, positions and angles; no unit for what are no angles.
        changes: What else is read otherwise than the arm's model says, such as the sign of a joint.
    """

    units: tuple[str, str, str]
    orientation: str
    changes: tuple[str, ...] = ()

    @property
    def assumptions(self) -> tuple[str, str, str]:
        """`joints in deg`, `positions in mm`, `rotation vector (UR) in rad`."""
        joints, lengths, angles = self.units
        turned = f" in {angles}" if angles else ""
        return f"joints in {joints}", f"positions in {lengths}", f"{self.orientation}{turned}"


def read_display(path: Path | str, robot: Robot, *, columns: str | None = None) -> Displayed:
    """Poses of a table with or without headings, or of a log, as measurements are read."""
    path, names = Path(path), robot.joint_names
    if file_layout(path) is not None:  # such as a bag, whose numbers are known in full
        return of_dataset(read_measurements(path, columns=columns, joints=names), robot)
    try:
        table = read_table(path, columns=columns, joints=names)
    except FileError:
        if not any(map(NUMBER.fullmatch, (grid := read_grid(path)).rows[0])):  # headings
            raise
        table = _without_headings(grid, robot.dof)
    kept = [any(cells) for cells in zip(*table.columns, strict=True)]  # not poses that were not filled in
    cells_of = tuple(tuple(compress(cells, kept)) for cells in table.columns)
    table = replace(table, columns=cells_of, lines=tuple(compress(table.lines, kept)))
    table, is_named = _completed(table, robot.dof)
    data = assemble(replace(fields_of(table), told_twice=""), joints=names)
    if data.rotation is None or data.written is None:
        raise table.error(f"no orientation was found; {WHAT}")
    known = {c.key: c for c in interpret_columns(table)}
    joints = [known[f"q{k + 1}"] for k in range(robot.dof)]
    same = {name := data.written.name, name[::-1].lower()}  # of columns in reverse
    entries = [known[key] for form in FORMS if form.convention in same for key in form.keys]
    turn = entries if len(entries) == 9 else sorted(entries, key=lambda c: c.index)
    seen, stood = _chosen(data, np.flatnonzero(data.included))
    xyz, length, second = _block(table, [known[axis] for axis in "xyz"], seen)
    q, joint, first = _block(table, joints, seen, length)
    turned, angle, third = _block(table, turn, seen)
    return Displayed(
        joints=q,
        xyz=xyz,
        turn=turned,
        units=(joint, length, angle),
        steps=(first, second, third),
        source=str(path),
        rows=seen.tolist(),
        named=name * (is_named and name != "rotvec"),
        stood=stood,
    )


def _chosen(data: Dataset, rows: Int[np.ndarray, " rows"]) -> tuple[Int[np.ndarray, " k"], list[bool]]:
    """Rows of a log that are enough, and which of them are the first at which the arm stood."""
    numbers = np.column_stack([data.q, np.asarray(data.position)])[rows]
    stays = np.append(np.abs(np.diff(numbers, axis=0)).max(1) < STOOD, False)[: len(rows)]
    stood = stays & ~np.roll(stays, 1)
    parts = [part for part in (rows[stood], rows[~stood]) if len(part)]
    few = [part[:: -(-len(part) * len(parts) // MAX_READINGS)] for part in parts]
    chosen = np.sort(np.concatenate([rows[:0], *few]))
    return chosen, np.isin(chosen, rows[stood]).tolist()


def typed(texts: Iterable[str], joints: int) -> Displayed:
    """Poses as `q1,…,qn = x,y,z,a,b,c` (angles, or a quaternion) each."""
    rows: list[tuple[list[str], list[str], list[str]]] = []
    for text in texts:
        left, _, right = text.replace("\u2212", "-").partition("=")
        own, pose = (re.split(r"[,;\s]+", part.strip()) for part in (left, right))
        is_right = len(own) == joints and len(pose) in (6, 7) and all(map(TYPED.fullmatch, own + pose))
        if not is_right or (rows and len(pose) != 3 + len(rows[0][2])):
            wanted = f"{joints} joint positions, =, x, y, z and three angles or a quaternion, with commas"
            raise OptionError(f"the pose '{text}' must be {wanted}")
        rows.append((own, pose[:3], pose[3:]))
    if not rows:
        raise OptionError('no poses are typed; give three or more: --pose "q1,…,qn = x,y,z,a,b,c" for each')
    cells = [np.array(part) for part in zip(*rows, strict=True)]
    q, xyz, turn = (part.astype(float) for part in cells)
    first, second, third = map(_last_digits, cells, (q, xyz, turn))
    return Displayed(joints=q, xyz=xyz, turn=turn, steps=(first, second, third), rows=range(len(rows)))


def of_dataset(data: Dataset, robot: Robot) -> Displayed:
    """Poses of a log or bag in SI, with the last digits that their numbers tell."""
    data = with_units(robot, data) if data.missing_units else data
    if data.position is None or data.rotation is None:
        raise DataError(f"{data.source}: the tool's pose is needed, position and orientation")
    robot.check_joints(data.q, data.source)
    seen = data.included & np.isfinite(data.position).all(1) & np.isfinite(data.rotation).all((1, 2))
    seen, stood = _chosen(data, np.flatnonzero(seen))
    q, xyz, turn = data.q[seen], data.position[seen], se3.matrix_to_quaternion(data.rotation[seen])
    written = data.written and data.written.take(seen)
    turn, name = (turn, "") if written is None else (written.numbers, written.name)
    own = [np.where(sliding(robot), *sizes) for sizes in product(LENGTHS, ANGLES)]
    return Displayed(
        joints=q,
        xyz=xyz,
        turn=turn,
        units=("rad", "m", "rad" if turn.shape[1] == 3 else ""),
        steps=(_told(q, own), _told(xyz, LENGTHS), _told(turn, ANGLES)),
        source=data.source,
        rows=data.row[seen].tolist(),
        named=name * (name != "rotvec"),
        stood=stood,
    )


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
        unit = parse_heading(names[k]).unit
        names[k] = f"{name}[{unit}]" if unit else name
    is_named = bool(ORIENTED & places.keys()) and table.heading_line is not None
    return replace(table, names=tuple(names)), is_named


def _block(
    table: Table, columns: Sequence[TableColumn], rows: np.ndarray, length: str = ""
) -> tuple[np.ndarray, str, np.ndarray]:
    """Numbers of some columns, their unit where headings say it, and the values of last digits.

    Args:
        length: Unit of lengths among angles; empty where there are none.
    """
    cells = np.array([table.columns[c.index] for c in columns])[:, rows].T
    numbers = np.stack([to_numbers(table, c.index)[rows] for c in columns], axis=1)
    steps, unit = _last_digits(cells, numbers), ""
    for k, c in enumerate(columns):
        if c.conversion is None or not c.unit or c.missing_unit is not None or c.unit == "1":
            continue
        of_length = c.conversion.quantity is Quantity.LENGTH
        own, other = ("mm", "m") if of_length else ("deg", "rad")
        unit = unit or (own if np.isclose(SIZES[own], c.conversion.scale) else other)
        factor = c.conversion.scale / SIZES[length if of_length and length else unit]
        numbers[:, k], steps[:, k] = numbers[:, k] * factor, steps[:, k] * factor
    return numbers, unit, steps


def _told(values: Float[np.ndarray, "rows k"], sizes: Sequence) -> Float[np.ndarray, "rows k"]:
    """Last digits of numbers in SI, in the unit of some sizes in which they have fewest."""
    found = []
    for size in sizes:
        cells = np.array([re.sub("0*e", "e", f"{v:.11e}") for v in (values / size).flat])
        found.append((max(map(len, cells), default=0), size * _last_digits(cells, values / size)))
    return min(found, key=lambda each: each[0])[1]


def _last_digits(cells: np.ndarray, numbers: Float[np.ndarray, "rows k"]) -> Float[np.ndarray, "rows k"]:
    """Value of each number's last digit, where all are printed with as many decimals, or digits in all."""
    decimals = digits = 0
    for cell in cells.ravel():
        mantissa, _, power = cell.lower().strip().replace(",", ".").partition("e")
        decimals = max(decimals, len(mantissa.partition(".")[2]) - int(power or 0))
        digits = max(digits, len(mantissa.lstrip("+-\u22120.").replace(".", "")))
    with np.errstate(divide="ignore"):
        order = np.floor(np.log10(np.abs(numbers)))
    return np.maximum(10.0**-decimals, 10.0 ** (order - digits + 1))
