"""Motors as joints: tables with LeRobot's headings or counts.

    shoulder_pan.pos                  degrees, as LeRobot has them with `use_degrees`
    shoulder_pan[counts], q1[counts]  positions of 4096 a turn; 2048 is 0°

The gripper is left out; the others are the joints by name where they are called as the robot's, else in the
order of their columns. Columns besides are read as in every other table.
"""

import re
from dataclasses import replace
from typing import final

import numpy as np

from workbench.base.units import parse_heading
from workbench.data.readers.columns_option import IGNORED
from workbench.data.readers.fields import Fields, fields_of, to_numbers
from workbench.data.readers.layouts import AbstractTableLayout
from workbench.data.readers.table import Table

GRIPPER = "gripper"
"""The motor that is no joint of the arm."""
COUNTS = {"counts", "count", "ticks", "steps", "raw"}
TURN, ZERO, MAX_TURNS = 4096, 2048, 4.0
COUNTED = f"motor counts: {TURN} to a turn, {ZERO} is 0°"
"""Note by which angles from counts are known."""
NAMED = "joints are "
"""Begin of the note with the motors' names."""
MIN_ROWS = 3


def motor_of(heading: str) -> tuple[str, bool] | None:
    """Name of a motor and whether its column holds counts; None for other columns."""
    name, unit = parse_heading(heading)
    has_counts = (unit or "").lower() in COUNTS
    is_motor = has_counts or (name.endswith(".pos") and unit in (None, "deg", "°"))
    return (name.removesuffix(".pos"), has_counts) if is_motor else None


@final
class Motors(AbstractTableLayout):
    """A table with a column for each motor."""

    name = "motors"

    def matches(self, headings: list[str]) -> bool:
        return len(_joints(headings)) >= MIN_ROWS

    def read(self, table: Table) -> Fields:
        joints = sorted(_joints(list(table.headings)), key=lambda joint: _place(table.names[joint[0]]))
        names, columns = list(table.names), list(table.columns)
        for number, (index, _, is_counts) in enumerate(joints, 1):
            names[index] = f"q{number}[deg]"
            if is_counts:
                counts = to_numbers(table, index)
                if (largest := np.nanmax(np.abs(counts), initial=0.0)) > MAX_TURNS * TURN:
                    how = f"divide them by those of a turn and write 'q{number}[turn]'"
                    raise table.error(f"{largest:.0f} can't be {COUNTED}: {how}", index)
                degrees = (counts - ZERO) * (360.0 / TURN)
                columns[index] = tuple("" if np.isnan(v) else repr(float(v)) for v in degrees)
        for k, heading in enumerate(table.headings):
            if (motor := motor_of(heading)) is not None and motor[0] == GRIPPER:
                names[k] = IGNORED
        units_note = COUNTED if any(joint[2] for joint in joints) else "motors in degrees (use_degrees)"
        notes = (*table.notes, NAMED + ", ".join(name for _, name, _ in joints), units_note)
        return fields_of(replace(table, names=tuple(names), columns=tuple(columns), notes=notes))


def _place(name: str) -> int:
    """Number of the robot's joint by which a column is called; 0 for others, which keep their order."""
    match = re.match(r"q(\d+)", name)
    return int(match[1]) if match else 0


def _joints(headings: list[str]) -> list[tuple[int, str, bool]]:
    """Place, name and unit of each motor's column but the gripper's."""
    found = [(k, *m) for k, heading in enumerate(headings) if (m := motor_of(heading)) is not None]
    return [each for each in found if each[1] != GRIPPER]
