"""Trajectories and lists of poses: the same columns as measurements, with joints or poses or both."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.base.columns import row_drivers
from workbench.base.errors import DataError
from workbench.base.types import frozen
from workbench.base.wording import listed
from workbench.data.readers.assemble import joint_columns
from workbench.data.readers.column_meanings import unread_text
from workbench.data.readers.columns_option import GROUPS, Columns, Joints
from workbench.data.readers.headings import meaning_of
from workbench.data.readers.orientation import read_orientation
from workbench.data.readers.read import read_fields


@dataclass(frozen=True, eq=False, kw_only=True)
class Trajectory:
    """Samples of a motion, or a list of poses.

    Args:
        time: Time [s]; None, like the next three, when the file has none.
        q: Joint positions [rad or m].
        position: Positions of the tool [m].
        rotation: Orientations of the tool.
        drivers: What else may drive effects, one number a row by the column's name, such as `payload` [kg].
        notes: Each decision that the reader took.
        units: Unit of each column of the file in its order, where the file has one.
    """

    time: Float[np.ndarray, " rows"] | None = None
    q: Float[np.ndarray, "rows n"] | None = None
    position: Float[np.ndarray, "rows 3"] | None = None
    rotation: Float[np.ndarray, "rows 3 3"] | None = None
    source: str = "the array"
    notes: tuple[str, ...] = ()
    drivers: Mapping[str, Float[np.ndarray, " rows"]] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)


def read_trajectory(
    path: Any, *, columns: Columns = None, joints: Joints = None, sheet: str | None = None
) -> Trajectory:
    """Joints and poses of a file, without gaps; options as `read_measurements`.

    Raises:
        WorkbenchError: As `read_measurements`; a blank cell is an error here.
        DataError: There are neither joints nor positions, or time does not increase.
    """
    fields = read_fields(path, columns=columns, sheet=sheet, layout="plain", joints=joints).said
    filled = {k: v for k, v in fields.values.items() if v.dtype.kind != "f" or not np.isnan(v).all()}
    if blank := [fields.headings.get(k, k) for k in fields.values if k not in filled]:
        said = f"columns of blank cells: {listed(blank)}"
        fields = replace(fields, values=filled, notes=(*fields.notes, said))
    for key, values in filled.items():
        if values.dtype.kind == "f" and (blank := np.isnan(values)).any():
            text = "the cell is blank: fill it in, as a trajectory must not have gaps"
            raise fields.error(text, int(np.argmax(blank)), key)
    position = fields.stacked(("x", "y", "z"))
    q = joint_columns(fields, joints) if fields.numbers(r"q(\d+)") else None
    if q is None and position is None:
        needed = f"joints (q1[rad] …) or positions (x[m], y[m], z[m]){unread_text(fields.unread, 'q1')}"
        raise DataError(f"{fields.source}: a trajectory needs {needed}")
    turn = fields.stacked(GROUPS["rotvec"]) if q is None and columns is None else None
    is_long = turn is not None and (np.linalg.norm(turn, axis=1) > 1.001 * np.pi).any()
    if is_long or (turn is not None and fields.units.get("rx") == "deg"):
        text = "rx, ry, rz in degrees or of more than 180° may be Euler angles or a rotation vector"
        how = "or say columns='rx[deg]=rx,ry[deg]=ry,rz[deg]=rz' (--columns) if they are one"
        raise DataError(f"{fields.source}: {text}: call angles about fixed axes roll, pitch, yaw, {how}")
    rotation, notes = read_orientation(fields, usable=np.ones(fields.rows, bool))
    time = fields.values.get("time")
    if time is None and (bare := [name for name in fields.unread if meaning_of(name) == "time"]):
        raise DataError(f"{fields.source}: the time has no unit: write '{bare[0]}[s]'", column=bare[0])
    if time is not None and (late := np.diff(time) <= 0).any():
        row = int(np.argmax(late)) + 1
        text = f"{fields.source}, line {fields.lines[row]}: time does not increase: sort the rows by time"
        raise DataError(text, row=row, column="time")
    found = {"time": time, "q": q, "position": position, "rotation": rotation}
    return Trajectory(
        **{name: frozen(values) for name, values in found.items() if values is not None},
        source=fields.source,
        notes=fields.notes + notes,
        drivers={n: frozen(fields.values[n]) for n in row_drivers() if n in fields.values and n != "time"},
        units=fields.units,
    )
