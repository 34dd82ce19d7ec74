"""Joint positions and poses as a pendant shows them: numbers with a last digit, their meaning still open."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float

from workbench.arm.joint_units import sliding
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.base.units import parse_heading
from workbench.data.dataset import Dataset
from workbench.data.readers.file_kind import FileKind, kind_of, read_bytes
from workbench.data.readers.table import Grid
from workbench.data.readers.text import read_text
from workbench.data.readers.workbooks import read_excel
from workbench.extras.pendant.own_robot.displayed_poses import typed_cells

JOINT = re.compile(r"(?:q|j|a|ax|axis|jt|joint|theta|actual_q)[ _]*(\d+)(?: pos(?:ition)?)?", re.IGNORECASE)
RTDE = tuple(f"actual_tcp_pose_{k}" for k in range(6))
"""Position [m] and rotation vector [rad] in a log of UR's RTDE, whose joints count from 0 [rad]."""
MATRIX = tuple(f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3))
MAX_READINGS = 400
"""Rows of a log that are taken, evenly spread."""
NUMBER = re.compile(r"[-+\u2212]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?")
COMMANDED = 0.5
"""Joint positions that are all whole multiples of this many degrees were commanded, not rounded."""
UNITS = {"°": "deg", "degree": "deg", "degrees": "deg"}
WHAT = (
    "give a column for each joint (q1 … qN), x, y, z and the three or four numbers of the orientation, one "
    "pose a line"
)


@dataclass(frozen=True, eq=False, kw_only=True)
class PendantReadings:
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
    source: str = "readings"
    rows: Sequence[int] = field(default=())

    def __len__(self) -> int:
        return len(self.joints)


def read_readings(path: Path | str, robot: Robot) -> PendantReadings:
    """PendantReadings of a table with or without headings."""
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
    return _readings(cells, units, robot, str(path), kept)


def typed_readings(texts: Iterable[str], robot: Robot) -> PendantReadings:
    """PendantReadings as `q1,…,qn = x,y,z,a,b,c` each."""
    cells = [list(part) for part in zip(*typed_cells(texts, robot.dof), strict=True)]
    if not cells or not cells[0]:
        raise OptionError("no poses are typed; give them as q1,…,qn = x,y,z,a,b,c")
    return _readings(cells, ("", "", ""), robot, "the typed poses", range(len(cells[0])))


def readings_of(data: Dataset) -> PendantReadings:
    """PendantReadings of a log or bag, whose poses are known in full."""
    if data.position is None or data.rotation is None:
        raise DataError(f"{data.source}: the tool's pose is needed, position and orientation")
    seen = data.included & np.isfinite(data.position).all(1) & np.isfinite(data.rotation).all((1, 2))
    return PendantReadings(
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


def _columns(
    head: list[str], body: list[list[str]], joints: int, path: Path
) -> tuple[list[int], list[int], list[int]]:
    """Columns of joints, position and orientation, by their headings or else in this order."""
    width = len(body[0])
    names = _names(head)
    numbered = {int(m[1]): k for k, name in enumerate(names) if (m := JOINT.fullmatch(name))}
    if 0 in numbered:
        numbered = {number + 1: k for number, k in numbered.items()}
    pose = [names.index(name) for name in RTDE] if set(RTDE) <= set(names) else []
    if not pose and not {"x", "y", "z"} <= set(names):
        if not joints + 6 <= width <= joints + 7:
            raise DataError(f"{path}: {width} columns, but the arm has {joints} joints; {WHAT}")
        return _span(0, joints), _span(joints, 3), _span(joints + 3, width - joints - 3)
    if numbered and sorted(numbered) != list(range(1, joints + 1)):
        raise DataError(
            f"{path}: joints {', '.join(map(str, sorted(numbered)))} in the file, but the arm has {joints}; "
            "choose the robot that was read"
        )
    own = [numbered[k] for k in sorted(numbered)]
    if pose and own:
        return own, pose[:3], pose[3:]
    own = own or _span(names.index("x") - joints, joints)
    if min(own) < 0:
        raise DataError(f"{path}: no columns of joints; {WHAT}")
    xyz = [names.index(axis) for axis in "xyz"]
    if set(MATRIX) <= set(names):
        return own, xyz, [names.index(name) for name in MATRIX]
    rest = [k for k in range(max(xyz) + 1, len(names)) if k not in own and names[k]]
    turn = [k for k in rest[:4] if k < rest[0] + 4 and not names[k].startswith(("time", "note", "comment"))]
    if len(turn) < 3:
        raise DataError(f"{path}: no orientation follows x, y, z; {WHAT}")
    return own, xyz, turn if len(turn) == 4 and _is_quaternion(body, turn) else turn[:3]


def _names(head: list[str]) -> list[str]:
    return [parse_heading(cell).name.strip().lower() for cell in head]


def _is_quaternion(body: list[list[str]], columns: list[int]) -> bool:
    """Whether four columns have unit length wherever they are filled in."""
    rows = [[row[c].strip().replace(",", ".") for c in columns] for row in body]
    filled = [row for row in rows if all(map(NUMBER.fullmatch, row))]
    norms = np.linalg.norm(np.array(filled, float).reshape(-1, 4), axis=1)
    return len(filled) > 0 and bool(np.all(np.abs(norms - 1.0) < 0.02))


def _span(start: int, count: int) -> list[int]:
    return list(range(start, start + count))


def _unit(head: list[str], columns: list[int], path: Path) -> str:
    """The unit that the headings of some columns have; empty if none."""
    found = {parse_heading(head[c]).unit or "" for c in columns if c < len(head)}
    units = {UNITS.get(unit, unit) for unit in found} - {"", "-", "1"}
    if len(units) > 1 or not units <= {"deg", "rad", "mm", "m"}:
        raise DataError(f"{path}: the unit '{sorted(units)[0]}' is unknown; give deg, rad, mm or m")
    return next(iter(units), "")


def _readings(cells, units, robot: Robot, source: str, rows: Sequence[int]) -> PendantReadings:
    values = [
        np.array([[_number(c, source, k) for c in row] for k, row in enumerate(part)]) for part in cells
    ]
    steps = [_last_digit(part) for part in cells]
    turning = values[0][:, ~sliding(robot)]
    if units[0] != "rad" and np.allclose(turning, COMMANDED * np.round(turning / COMMANDED), atol=1e-9):
        steps[0] = 0.0
    joints, xyz, turn = values
    last = (steps[0], steps[1], steps[2])
    return PendantReadings(
        joints=joints, xyz=xyz, turn=turn, units=units, steps=last, source=source, rows=list(rows)
    )


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
