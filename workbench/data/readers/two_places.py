"""Places that a table holds twice, as measured and as the controller has them: which count must be said.

Where headings tell neither, both sets follow one motion: one is the other moved, turned and scaled.
"""

import re
from collections import defaultdict
from collections.abc import Mapping

import numpy as np

from workbench.base.hand_eye import nearest_rotation
from workbench.base.remedy import remedy
from workbench.base.units import parse_heading
from workbench.data.readers.columns_option import IGNORED, NamedUnit
from workbench.data.readers.headings import (
    CONTROLLER,
    is_commanded,
    is_marked,
    is_of_measurement,
    normalised,
    number_in,
)
from workbench.data.readers.table import Table

MIN_ROWS, ALIKE = 6, 0.02
"""Fewest rows that are compared, and the share of their spread by which places of one motion may differ."""
_DEVIATION = re.compile(r"(d|delta|dev|deviation|diff|err|error)_?x|x_?(delta|dev|deviation|diff|err|error)")


def told_twice(table: Table, places: Mapping[str, int], unread: Mapping[int, str]) -> str:
    """What to say where columns left out may be the measured places as well as those taken; empty if not.

    Args:
        places: Columns of x, y and z.
        unread: Headings of the columns left out, by their number.
    """
    taken = [table.headings[k] for k in places.values()]
    said = all(table.names[k] != table.headings[k] for k in places.values())
    if len(places) < 3 or said or any(map(is_of_measurement, taken)):
        return ""
    own, unit = _numbers(table, [places[axis] for axis in "xyz"]), parse_heading(taken[0]).unit
    may_be_nominal = not any(map(is_marked, taken)) and not any(map(is_commanded, unread.values()))
    for other in _triples(table, unread):
        theirs, names = _numbers(table, other), [table.headings[k] for k in other]
        rows = np.isfinite(own).all(1) & np.isfinite(theirs).all(1)
        bare = [parse_heading(name).name for name in names]
        new = ",".join(f"{NamedUnit(a, unit).heading()}={b}" for a, b in zip("xyz", bare, strict=True))
        how, are = f"columns='{','.join(f'{b}=-' for b in bare)}'", "and deviations"
        if may_be_nominal and (theirs[rows] < 0.0).any() and _DEVIATION.fullmatch(normalised(bare[0])):
            how = f"in a file without the deviations, or {how} if {', '.join(taken)} were"
        elif rows.sum() >= MIN_ROWS and _follow_each_other(own[rows], theirs[rows]):
            how, are = f"columns='{new}' or {how}", "of one motion"
        else:
            continue
        how = remedy(f"{how} (--columns)", page="in the Measure tab, under 'Columns of the file'")
        both = f"{', '.join(taken)} and {', '.join(names)} are places {are}"
        return f"{table.source}: {both}: say which were measured, {how}"
    return ""


def _triples(table: Table, unread: Mapping[int, str]) -> list[list[int]]:
    """Columns whose headings differ in x, y, z alone, none of a controller."""
    stems = defaultdict[tuple[str, str], dict[str, int]](dict)
    for index, heading in unread.items():
        name = normalised(parse_heading(heading).name)
        if not (
            is_commanded(heading)
            or CONTROLLER.search(name)
            or parse_heading(table.names[index]).name == IGNORED
        ):
            for found in re.finditer("[xyz]", name):
                stems[name[: found.start()], name[found.end() :]].setdefault(found[0], index)
    return [[own[axis] for axis in "xyz"] for own in stems.values() if len(own) == 3]


def _numbers(table: Table, columns: list[int]) -> np.ndarray:
    return np.array([[number_in(cell) for cell in table.columns[k]] for k in columns]).T


def _follow_each_other(one: np.ndarray, other: np.ndarray) -> bool:
    one, other = ((p - p.mean(0)) / max(float(np.linalg.norm(p - p.mean(0))), 1e-300) for p in (one, other))
    turn = nearest_rotation(one.T @ other)
    return bool(np.linalg.norm(one @ turn - other) < ALIKE)
