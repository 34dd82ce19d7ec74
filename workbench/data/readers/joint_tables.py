"""Measurements joined with joints from another table: by name, else by an installed way, else row by row.

A column of names is `point`, `group` or `image`, any that holds the same names in both tables, or one under a
heading of both, such as `Name` or `ID`, that names each row of the joints once and half of the measurements,
where their numbers of rows differ.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from workbench.base.errors import DataError
from workbench.base.wording import listed, plural
from workbench.data.readers.fields import Fields
from workbench.data.readers.headings import is_observed
from workbench.parts import parts

LABELS = ("point", "group", "image")
"""Columns by which rows are joined, the first that both have."""
_FORMS = "(?!)()", r"^(?=.*[^\W\d_])\D*?0*(\d+)\D*$", r"^(.*[^\W\d_].*)[-_. ]\d{1,2}$"
_SAME, _NUMBER, _STEM = map(re.compile, _FORMS)
"""A name itself; its only number, as `Pose_01` and `pose1` are one; `P1` of `P1-2`, a second reading."""


class AbstractJoin(ABC):
    """One way of finding the joints of each measurement, where rows of both tables have no common names."""

    name: str

    @abstractmethod
    def applies(self, measured: Fields, joints: Fields) -> bool:
        """Whether these two tables are joined this way."""

    @abstractmethod
    def join(self, measured: Fields, joints: Fields) -> Fields:
        """The measurements with their joints."""


def join(measured: Fields, joints: Fields) -> Fields:
    """Measurements with joints from another table."""
    mine, theirs = _names(measured), _names(joints)
    label = next((key for key in LABELS if key in measured.values and key in joints.values), "")
    columns = [(label, label)] if label else [*product(mine, theirs)]
    for form, plain in ((_SAME, _SAME), (_NUMBER, _NUMBER), (_STEM, _SAME)):
        for key, other in columns:
            both = (form, mine[key]), (plain, theirs[other])
            names, known = ([pattern.sub(r"\1", name) for name in own] for pattern, own in both)
            own, are_once = {*known}, len({*known}) == len(known) > 1
            shared = sum(name in own for name in names)  # of as many rows they may be counted otherwise
            is_apart = key == other and 2 * shared > len(names) and measured.rows != joints.rows
            if are_once and ({*names} == own or is_apart or (label and shared)):
                if form is _STEM:
                    ends = [re.findall(r"\d*$", name)[0] or "1" for name in mine[key]]
                    measured = replace(measured, values={**measured.values, "point": np.array(ends)})
                return _by_label(measured, joints, key, names, known)
    if label:
        return _by_label(measured, joints, label, mine[label], theirs[label])
    way = next((way for way in parts("joins", AbstractJoin) if way.applies(measured, joints)), None)
    return by_row(measured, joints) if way is None else way.join(measured, joints)


def joined_alone(fields: Fields) -> Fields:
    """Measurements with joints of one table, in an installed way, as of a log."""
    way = next((way for way in parts("joins", AbstractJoin) if way.applies(fields, fields)), None)
    return fields if way is None else way.join(fields, fields)


def _names(fields: Fields) -> dict[str, tuple[str, ...]]:
    """Columns of labels, and those that are left out; of a name like `A::Pose::p1` its last part."""
    labels = {key: v.tolist() for key, v in fields.values.items() if v.dtype.kind == "U"}
    return {k: tuple(n.rpartition("::")[2] for n in own) for k, own in {**labels, **fields.unread}.items()}


def _by_label(
    measured: Fields, joints: Fields, key: str, names: Sequence[str], known: Sequence[str]
) -> Fields:
    """Rows by the names that both tables have in their columns."""
    place = {name: k for k, name in enumerate(known)}
    if again := next((name for k, name in enumerate(known) if place[name] != k), ""):
        text = f"{joints.source} names {key} '{again}' twice: give one row of joints per name"
        raise DataError(text, column=key, found=again)
    rows = np.array([i for i, name in enumerate(names) if name in place], int)
    if not len(rows):
        pairs = (measured, names), (joints, known)
        mine, theirs = (f"{file.source} ({listed(own, longest=3)})" for file, own in pairs)
        raise DataError(f"no {key} of {mine} is in {theirs}")
    notes = [f"joints are taken from {joints.source} by '{key}'"]
    if lost := [name for name in dict.fromkeys(names) if name not in place]:
        notes.append(f"{key} without joints, left out: {listed(lost)}")
    at = np.array([place[names[i]] for i in rows])
    return merged(measured.take(rows), {k: v[at] for k, v in joints.values.items()}, joints, notes)


def by_row(measured: Fields, joints: Fields) -> Fields:
    if measured.rows != joints.rows:
        counts = f"{measured.source} has {plural(measured.rows, 'row')}, {joints.source} {joints.rows}"
        how = "name the rows in both (column 'point'), give both a column time[s], or one row of joints per"
        raise DataError(f"{counts}: {how} measurement", found=(measured.rows, joints.rows))
    note = f"joints are taken from {joints.source} row by row: both have {joints.rows} rows"
    return merged(measured, joints.values, joints, (note,))


def merged(measured: Fields, more: Mapping[str, np.ndarray], joints: Fields, notes: Sequence[str]) -> Fields:
    """Measurements with the columns of the joints' table that they lack, but for poses there, which are the
    controller's own."""
    beside = {k: v for k, v in more.items() if not is_observed(k)}
    return replace(
        measured,
        values={**beside, **measured.values},
        headings={**joints.headings, **measured.headings},
        units={**joints.units, **measured.units},
        missing_units=measured.missing_units or joints.missing_units,
        notes=(*measured.notes, *(n for n in joints.notes if n not in measured.notes), *notes),
    )
