"""Joint positions and poses as a pendant shows them: numbers with a last digit, their meaning still open."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from workbench.arm.joint_units import sliding
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.base.units import parse_heading
from workbench.data.dataset import Dataset
from workbench.data.orientations import ORIENTATIONS, WrittenOrientation
from workbench.data.readers.file_kind import FileKind, kind_of, read_bytes
from workbench.data.readers.headings import known_together, meaning, normalised
from workbench.data.readers.table import Grid
from workbench.data.readers.text import read_text
from workbench.data.readers.workbooks import read_excel
from workbench.identification.meaning.conventions import Convention
from workbench.identification.meaning.reading import RowReading

RTDE = tuple(f"actual_tcp_pose_{k}" for k in range(6))
"""Position [m] and rotation vector [rad] in a log of UR's RTDE, whose joints count from 0 [rad]."""
MATRIX = tuple(f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3))
MAX_READINGS = 400
"""Rows of a log that are taken, evenly spread."""
TYPED = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
NUMBER = re.compile(r"[-+\u2212]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?")
SIZES = {"m": 1.0, "mm": 1e-3, "rad": 1.0, "deg": float(np.deg2rad(1.0)), "": 1.0}
UNITS = {"°": "deg", "degree": "deg", "degrees": "deg"}
WHAT = (
    "give a column for each joint (q1 … qN), x, y, z and the three or four numbers of the orientation, one "
    "pose a line"
)


@dataclass(frozen=True, eq=False, kw_only=True)
class Displayed:
    """Poses as shown; of each block of columns its unit, if that stands there, and its last digit.

    Args:
        joints: Joint positions, in the unit shown.
        xyz: Position of the tool.
        turn: Its orientation: three numbers, a quaternion, or a matrix row by row.
        units: Units of joints, position and orientation; empty where nothing says it.
        steps: Value of the last digit of each; 0 where the numbers are exact.
        source: For messages.
        rows: Number of each pose in its file, counted from 0.
    """

    joints: Float[np.ndarray, "rows n"]
    xyz: Float[np.ndarray, "rows 3"]
    turn: Float[np.ndarray, "rows k"]
    units: tuple[str, str, str] = ("", "", "")
    steps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    source: str = "the typed poses"
    rows: Sequence[int] = field(default=())

    def __len__(self) -> int:
        return len(self.joints)

    def usual_units(self, robot: Robot) -> tuple[str, str, str]:
        """Those shown, or else degrees, and the unit of length in which the arm reaches there."""
        far = np.linalg.norm(self.xyz, axis=1).max(initial=1e-9)
        length = min(("m", "mm"), key=lambda unit: abs(np.log(far * SIZES[unit] / robot.reach)))
        usual = ("deg", length, "deg" if self.turn.shape[1] == 3 else "")
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
        return DisplayMeaning(units, convention.name, reading.changes)


class DisplayMeaning(NamedTuple):
    """What is shown.

    Args:
        units: Of joints, positions and angles; no unit for what are no angles.
        orientation: Kind of the orientation.
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

    @property
    def text(self) -> str:
        return ", ".join((*self.assumptions, *self.changes))


def read_display(path: Path | str, robot: Robot) -> Displayed:
    """Poses of a table with or without headings."""
    path = Path(path)
    content = read_bytes(path)
    is_workbook = kind_of(content, path) is FileKind.EXCEL
    grid = read_excel(content, path, sheet=None) if is_workbook else read_text(content, path)
    head, body = _parts(grid)
    columns = _columns(head, body, robot.dof, path)
    blank = [k for k, row in enumerate(body) if not all(row[c].strip() for part in columns for c in part)]
    kept = [k for k in range(len(body)) if k not in blank]
    kept = kept[:: -(-len(kept) // MAX_READINGS) or 1]
    if not kept:
        raise DataError(f"{path}: no pose is filled in; {WHAT}")
    cells = [[[body[k][c] for c in part] for k in kept] for part in columns]
    units = tuple(_unit(head, part, path) for part in columns)
    if set(RTDE) <= set(_names(head)):
        units = ("rad", "m", "rad")
    return _displayed(cells, units=units, source=str(path), rows=kept)


def typed(texts: Iterable[str], joints: int) -> Displayed:
    """Poses as `q1,…,qn = x,y,z,a,b,c` (angles, or a quaternion) each."""
    rows: list[tuple[list[str], list[str], list[str]]] = []
    for text in texts:
        left, _, right = text.replace("\u2212", "-").partition("=")
        q, pose = (re.split(r"[,;\s]+", part.strip()) for part in (left, right))
        is_right = len(q) == joints and len(pose) in (6, 7) and all(map(TYPED.fullmatch, q + pose))
        if not is_right or (rows and len(pose) != 3 + len(rows[0][2])):
            raise OptionError(
                f"the pose '{text}' must be {joints} joint positions, =, x, y, z and three angles or a "
                "quaternion, with commas"
            )
        rows.append((q, pose[:3], pose[3:]))
    if not rows:
        raise OptionError("no poses are typed; give them as q1,…,qn = x,y,z,a,b,c")
    return _displayed([list(part) for part in zip(*rows, strict=True)], rows=range(len(rows)))


def of_dataset(data: Dataset) -> Displayed:
    """Poses of a log or bag, whose poses are known in full."""
    if data.position is None or data.rotation is None:
        raise DataError(f"{data.source}: the tool's pose is needed, position and orientation")
    seen = data.said.included & np.isfinite(data.position).all(1) & np.isfinite(data.rotation).all((1, 2))
    return Displayed(
        joints=data.q[seen],
        xyz=data.position[seen],
        turn=se3.matrix_to_quaternion(data.rotation[seen]),
        units=("rad", "m", ""),
        source=data.source,
        rows=data.row[seen].tolist(),
    )


def _parts(grid: Grid) -> tuple[list[str], list[list[str]]]:
    """Headings (none where there is no such line) and rows of numbers."""
    rows = [row for row in grid.rows if any(cell.strip() for cell in row)]
    begins = next((k for k, row in enumerate(rows) if _is_data(row)), len(rows))
    width = max(map(len, rows[max(begins - 1, 0) :]))
    body = [[*row, *[""] * (width - len(row))] for row in rows[begins:]]
    if not body:
        raise grid.error(f"no row of numbers was found; {WHAT}")
    return (rows[begins - 1] if begins else []), body


def _is_data(row: list[str]) -> bool:
    filled = [cell for cell in row if cell.strip()]
    return 2 * sum(NUMBER.fullmatch(cell.strip()) is not None for cell in filled) > len(filled)


def _columns(head: list[str], body: list[list[str]], joints: int, path: Path) -> list[list[int]]:
    """Columns of joints, position and orientation, by their headings or else in this order."""
    width, names = len(body[0]), _names(head)
    together = known_together({normalised(name): () for name in names})
    known = [together.get(normalised(name)) or meaning(name) for name in names]
    keys = {key: k for k, key in reversed([*enumerate(known)]) if key is not None}
    own = {int(key[1:]): k for key, k in keys.items() if re.fullmatch(r"q\d+", key)}
    first = min(own, default=1)  # logs of controllers count from 0
    if own and sorted(own) != list(range(first, first + joints)):
        raise DataError(
            f"{path}: joints {', '.join(map(str, sorted(own)))} in the file, but the arm has {joints}; "
            "choose the robot that was read"
        )
    q = [own[k] for k in sorted(own)]
    if own and set(RTDE) <= set(names):
        pose = [names.index(name) for name in RTDE]
        return [q, pose[:3], pose[3:]]
    if not {"x", "y", "z"} <= set(keys):
        if not joints + 6 <= width <= joints + 7:
            raise DataError(f"{path}: {width} columns, but the arm has {joints} joints; {WHAT}")
        columns = list(range(width))
        return [columns[:joints], columns[joints : joints + 3], columns[joints + 3 :]]
    xyz = [keys[axis] for axis in "xyz"]
    q = q or list(range(xyz[0] - joints, xyz[0]))
    if min(q) < 0:
        raise DataError(f"{path}: no columns of joints; {WHAT}")
    if set(MATRIX) <= set(keys):
        return [q, xyz, [keys[key] for key in MATRIX]]
    rest = [k for k in range(max(xyz) + 1, len(names)) if k not in q and names[k]]
    turn = [k for k in rest[:4] if k < rest[0] + 4 and not names[k].startswith(("time", "note", "comment"))]
    if len(turn) < 3:
        raise DataError(f"{path}: no orientation follows x, y, z; {WHAT}")
    return [q, xyz, turn if len(turn) == 4 and _is_quaternion(body, turn) else turn[:3]]


def _names(head: list[str]) -> list[str]:
    return [parse_heading(cell).name.strip().lower() for cell in head]


def _is_quaternion(body: list[list[str]], columns: list[int]) -> bool:
    """Whether four columns have unit length wherever they are filled in."""
    rows = [[row[c].strip().replace(",", ".") for c in columns] for row in body]
    filled = [row for row in rows if all(map(NUMBER.fullmatch, row))]
    norms = np.linalg.norm(np.array(filled, float).reshape(-1, 4), axis=1)
    return len(filled) > 0 and bool(np.all(np.abs(norms - 1.0) < 0.02))


def _unit(head: list[str], columns: list[int], path: Path) -> str:
    """The unit that the headings of some columns have; empty if none."""
    found = {parse_heading(head[c]).unit or "" for c in columns if c < len(head)}
    units = {UNITS.get(unit, unit) for unit in found} - {"", "-", "1"}
    if len(units) > 1 or not units <= {"deg", "rad", "mm", "m"}:
        raise DataError(f"{path}: the unit '{sorted(units)[0]}' is unknown; give deg, rad, mm or m")
    return next(iter(units), "")


def _displayed(cells, *, source: str = "the typed poses", **more) -> Displayed:
    joints, xyz, turn = (
        np.array([[_number(c, source, k) for c in row] for k, row in enumerate(part)]) for part in cells
    )
    joint, length, angle = map(_last_digit, cells)
    return Displayed(joints=joints, xyz=xyz, turn=turn, steps=(joint, length, angle), source=source, **more)


def _number(cell: str, source: str, row: int) -> float:
    text = cell.strip().replace("\u2212", "-").replace(",", ".")
    if not NUMBER.fullmatch(text):
        raise DataError(
            f"{source}: '{cell}' in pose {row + 1} is not a number; correct it or delete the line"
        )
    return float(text)


def _last_digit(part: list[list[str]]) -> float:
    """Value of the last digit that is shown; 0 where there are more than anybody displays."""
    texts = [cell.strip().replace(",", ".") for row in part for cell in row]
    if any("e" in text.lower() for text in texts):
        return 0.0
    decimals = max(len(text.partition(".")[2]) for text in texts)
    return 0.0 if decimals > 8 else 10.0**-decimals
