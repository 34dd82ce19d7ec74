"""From columns in SI to a `Dataset`: joints, observations, labels, and every decision in its notes.

A row counts when one of its observations is whole: position, with or without orientation, a marker, a
distance with its anchor, a touched point, a socket, an inclinometer. A row with a gap is kept out, with its
reason.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm.joint_units import sliding_numbers
from workbench.arm.robot import Robot
from workbench.base.columns import Per, row_drivers
from workbench.base.errors import DataError, FileError, ShapeError
from workbench.base.remedy import remedy
from workbench.base.units import parse_heading
from workbench.base.wording import listed, plural, span
from workbench.data.dataset import SIGMA, WRENCH, Dataset
from workbench.data.observation import known_columns
from workbench.data.postures import postures
from workbench.data.readers.column_meanings import CHOOSE_ON_PAGE, unread_text
from workbench.data.readers.columns_option import GROUPS, Joints
from workbench.data.readers.fields import Fields
from workbench.data.readers.file_kind import POSE_PAIRS, PROGRAMS
from workbench.data.readers.headings import COUNTERS, column_of, is_observed, normalised
from workbench.data.readers.joint_tables import joined_alone
from workbench.data.readers.orientation import read_orientation, unnamed_angles, written_orientation

_SIGMA, _WRENCH = ([parse_heading(text).name for text in own] for own in (SIGMA, WRENCH))
_OF_TARGET = re.compile(r"(?i)(target|marker|board|tag|object|camera|cam)\w*[_ .](t?[xyz]|q[wxyz]|r[xyz])\b")
"""Headings of a target's pose in a camera."""
_TRUE = {"true", "1", "1.0", "yes", "y", "x", "wahr", "ja", "j"}
_FALSE = {"", "false", "0", "0.0", "no", "n", "falsch", "nein"}
_NAMED = 5
"""Rows of a kind that are named one by one."""
MAX_DIGITS = 10
"""Digits from which on numbers don't count rows."""
MAX_PARTS = 40
"""Different cells of a column that may tell which rows belong together."""
MAX_MARKERS = 20
MIN_SHARE, MIN_SEEN = 0.5, 1.5
"""A reflector is seen at this share of the postures or more, and so many at a posture on the mean."""
MERGED = ("x", "y", "z", "point", "exclude", "reason")
"""Columns that the markers replace; a marker of an excluded row was not seen."""
ORIENTED = {"qw", "rx", "roll", "r11", "zxz_phi"}
"""A first column of each form of orientation."""

Mask = Bool[np.ndarray, " rows"]


def assemble(fields: Fields, *, joints: Joints, beside: Mapping[str, np.ndarray] | None = None) -> Dataset:
    """A `Dataset` of all columns.

    Args:
        fields: Columns in SI.
        joints: Of the robot, or None: as many as the file names.
        beside: What was observed otherwise, one number or more a row by its name, NaN where a row has none.
    """
    if beside is None and {"u", "v", "id"} <= set(fields.values):
        raise FileError("is a table of pixels: give --camera and --target as well", path=fields.source)
    if fields.told_twice:
        raise DataError(fields.told_twice)
    fields = fields if beside is not None else joined_alone(fields)
    q = joint_columns(fields, joints, some=True)
    excluded = excluded_rows(fields)
    fields = without_zeros(fields, q)
    for way in (with_markers, with_distances) if beside is None else ():
        if (other := way(fields, q, excluded)) is not fields:
            return assemble(other, joints=joints)
    lacking = np.isnan(q) & ~excluded[:, None]
    if 2 * lacking.any(1).sum() > (~excluded).sum():
        row, joint = np.argwhere(lacking)[0].tolist()
        text = "the joint position is missing: fill it in, delete the row, or set its 'exclude' to true"
        raise fields.error(text, row, f"q{joint + 1}")
    _check_range(fields)
    position = fields.stacked(("x", "y", "z"))
    placed = np.ones(fields.rows, bool) if position is None else ~np.isnan(position).all(1)
    rotation, notes = read_orientation(fields, usable=~excluded & placed)
    _counted(fields, seen := fields.numbers(r"m(\d+)[xyz]"), "marker", "m{}x")
    places = [p for k in seen if (p := fields.stacked([f"m{k}{axis}" for axis in "xyz"])) is not None]
    markers, (sigma, rounded) = np.stack(places, axis=1) if places else None, _sigma(fields)
    links = fields.numbers(r"tilt_[xy](\d+)")
    tilt = {k: v for k in links if (v := fields.stacked((f"tilt_x{k}", f"tilt_y{k}"))) is not None}
    observed = {"position": position, "orientation": rotation, **(beside or {})}
    observed |= {f"marker {k}": own for k, own in enumerate(places, 1)}
    observed |= {f"tilt {link}": values for link, values in tilt.items()}
    observed |= {k: v for k, v in fields.values.items() if (own := column_of(k)) is not None and own.observed}
    if all(v is None for v in observed.values()) and {"point"} == {"point", "contact"} & fields.values.keys():
        touched = {**fields.values, "contact": fields.values["point"]}
        fields = replace(fields, values=touched, notes=(*fields.notes, "'point' names what was touched"))
    reasons = _gaps(fields, {k: v.reshape(fields.rows, -1) for k, v in observed.items() if v is not None})
    reasons = np.where(lacking.any(1), [f"lacks q{k + 1}" for k in lacking.argmax(1)], reasons)
    found = (reasons != "") & ~excluded
    counter, row = _own_numbers(fields)
    given = fields.values.get("reason", np.full(fields.rows, ""))
    return Dataset(
        q=q,
        position=position,
        rotation=rotation,
        written=written_orientation(fields) or unnamed_angles(fields),
        markers=markers,
        sigma=sigma,
        tilt=tilt or None,
        wrench=fields.stacked(_WRENCH, missing=0.0),
        exclude=excluded | found if "exclude" in fields.values or found.any() else None,
        reason=np.where(found, reasons, given) if "reason" in fields.values or found.any() else None,
        source=fields.source,
        notes=(*fields.notes, *notes, *rounded, *_row_notes(fields, row, excluded, found, reasons)),
        row=row,
        counter=counter,
        place=np.arange(fields.rows),
        joint_units=tuple(fields.units.get(f"q{i}", "") for i in fields.numbers(r"q(\d+)")),
        missing_units=fields.missing_units,
        unread={k: np.array(v, object) for k, v in fields.unread.items() if 1 < len(set(v)) <= MAX_PARTS},
        **_plain(fields, q.shape[1]),
    )


def excluded_rows(fields: Fields) -> Mask:
    """Rows that the file leaves out in a column `exclude`."""
    cells = [str(word).strip().lower() for word in fields.values.get("exclude", [""] * fields.rows)]
    for row in (k for k, word in enumerate(cells) if word not in _TRUE | _FALSE):
        raise fields.error(f"'{cells[row]}' is neither true nor false", row, "exclude")
    return np.array([word in _TRUE for word in cells], bool)


def without_zeros(fields: Fields, q: Float[np.ndarray, "rows n"]) -> Fields:
    """The columns with zeros as missing where an instrument saw nothing: in a marker of several, or in place
    and orientation if it is none or stays so at other joints. A place alone may be a touched origin."""
    values, notes, markers = dict(fields.values), [*fields.notes], fields.numbers(r"m(\d+)x")
    groups: list[tuple[str, ...]] = [(f"m{k}x", f"m{k}y", f"m{k}z") for k in markers if len(markers) > 1]
    turns = (own for own in GROUPS.values() if own[0] in ORIENTED and {*own} <= values.keys())
    groups += [("x", "y", "z", *own) for own in list(turns)[:1]]
    for keys in (keys for keys in groups if {*keys} <= values.keys()):
        zero = ~np.any([values[key] for key in keys if key != "qw"], axis=0)
        if keys[0] == "x" and not postures(np.nan_to_num(q[zero])).any():
            zero &= values[keys[3]] == 0.0 if keys[3] in ("qw", "r11") else False
        if zero.any():
            values |= {key: np.where(zero, np.nan, values[key]) for key in keys}
            notes.append(f"{', '.join(keys)} = 0 in {plural(int(zero.sum()), 'row')}: not seen there")
    return replace(fields, values=values, notes=(*notes,))


def with_markers(fields: Fields, q: Float[np.ndarray, "rows n"], excluded: Mask) -> Fields:
    """One row a posture with markers m1, m2 … where a file lists several points of a posture in rows.

    A tool with three reflectors is often listed as three rows of equal joints, or with joints in the first
    alone, told apart by `point`. Sockets have the same column, but each its own postures.
    """
    held = set(fields.values)
    if not set(MERGED[:4]) <= held or held & (ORIENTED | {"m1x"}) or fields.rotation is not None:
        return fields
    xyz, known = np.stack([fields.values[axis] for axis in "xyz"], axis=1), ~np.isnan(q).all(1)
    names = [str(name).strip() for name in fields.values["point"]]
    filled = q[np.maximum.accumulate(np.where(known, np.arange(fields.rows), 0))]
    posture = postures(np.nan_to_num(filled))
    place = [*zip(fields.values.get("session", posture), posture, strict=True)]
    seen, visits = Counter[tuple](), defaultdict[tuple, list[int]](list)
    for row in np.flatnonzero(~excluded).tolist():  # every name once a visit
        visits[*place[row], seen[*place[row], names[row]]].append(row)
        seen[*place[row], names[row]] += 1
    found = [names[row] for visit in visits.values() for row in visit]
    markers, fewest = list(dict.fromkeys(found)), min(Counter(found).values(), default=0)
    is_seen = fewest >= MIN_SHARE * len(visits) and len(found) >= MIN_SEEN * len(visits)
    if not visits or "" in markers or len(markers) > MAX_MARKERS or not is_seen:
        return fields
    places = np.full((len(visits), len(markers), 3), np.nan)
    for points, visit in zip(places, visits.values(), strict=True):
        points[[markers.index(names[row]) for row in visit]] = xyz[visit]
    taken = fields.take(np.array([visit[0] for visit in visits.values()]))
    values = {key: values for key, values in taken.values.items() if key not in MERGED}
    values |= {f"m{m + 1}{a}": places[:, m, i] for m in range(len(markers)) for i, a in enumerate("xyz")}
    where = f"{len(found)} rows at {plural(len(visits), 'posture')}"
    notes = (*taken.notes, f"{listed(markers)} are markers of one tool: {where}")
    return replace(taken, values=values, notes=notes)


def with_distances(fields: Fields, q: Float[np.ndarray, "rows n"], excluded: Mask) -> Fields:
    """One row a distance where a file lists several in a row, `distance1` … of as many anchors, alone."""
    names = [f"distance{k}" for k in fields.numbers(r"distance(\d+)")]
    rest = {key: own for key, own in fields.values.items() if key not in names}
    if not names:
        return fields
    if any(key == "contact" or is_observed(key) for key in rest):
        notes = (*fields.notes, f"{span(names)} are left out beside other observations")
        return replace(fields, values=rest, notes=notes)
    lengths = np.stack([fields.values[name] for name in names], axis=1)
    measured = ~np.isnan(lengths)
    measured[:, 0] |= ~measured.any(1)  # a row without any is named as one with a gap
    rows, anchor = np.nonzero(measured)
    taken = replace(fields, values=rest).take(rows)
    values = {**taken.values, "distance": lengths[rows, anchor], "anchor": np.array(names)[anchor]}
    notes = (*taken.notes, f"{span(names)} are a row each, from anchors that are called so")
    return replace(taken, values=values, notes=notes)


def joint_columns(fields: Fields, joints: Joints, *, some: bool = False) -> Float[np.ndarray, "rows n"]:
    """Joint positions [rad or m] from q1 … qN; with `some` also if there are more, as measured rows tell
    which of them move joints."""
    numbers = fields.numbers(r"q(\d+)")
    names = joints.joint_names if isinstance(joints, Robot) else joints
    wanted = names if isinstance(names, int | None) else len(names)
    if not numbers:
        paired = "r11" in fields.values or any(map(_OF_TARGET.match, fields.unread))
        given = remedy(", or give a table of joints (--joints)", page="")
        more = f"; {POSE_PAIRS}" if paired else unread_text(fields.unread, "q1", lacks=wanted or 0)
        raise DataError(f"{fields.source}: there are no joint columns: add q1[rad], q2[rad], …{given}{more}")
    _counted(fields, numbers, "joint", "q{}")
    if wanted is not None and (len(numbers) < wanted or (len(numbers) > wanted and not some)):
        there = f"the file has {plural(len(numbers), 'joint column')} (q1 … q{numbers[-1]})"
        lacks, read = max(wanted - len(numbers), 0), [fields.headings[f"q{k}"] for k in numbers]
        slides = sliding_numbers(joints) if isinstance(joints, Robot) else ()
        more = unread_text(fields.unread, f"q{numbers[-1] + 1}", lacks, read, slides)
        still = "; if a joint stood still, add its angle as a column"
        how = f"choose the robot that has them{(more or still) * (lacks > 0)}"
        text = f"{fields.source}: {there}, the robot {plural(wanted, 'joint')}: {how}"
        raise ShapeError(text, expected=wanted, found=len(numbers))
    return np.stack([fields.values[f"q{i}"] for i in numbers], axis=1)


def _counted(fields: Fields, numbers: list[int], what: str, name: str) -> None:
    """Refuse columns that are not counted 1, 2, 3 …"""
    if (lacking := next((k for k, number in enumerate(numbers, 1) if number != k), None)) is not None:
        named = remedy(f"call it {name.format(lacking)}", page=CHOOSE_ON_PAGE)
        text = f"has no column of {what} {lacking}, but of {what} {numbers[-1]}: add it, or {named}"
        raise FileError(text, path=fields.source)


def _check_range(fields: Fields) -> None:
    """Refuse distances and deviations below 0, and directions that are none."""
    for key, values in fields.values.items():
        if re.fullmatch(r"direction\d+", key):
            wrong, text = ~np.isin(values, (-1, 0, 1)) & ~np.isnan(values), "-1, 0 or 1"
        elif key == "distance" or key in _SIGMA:
            wrong, text = values < 0.0, "at least 0"
        else:
            continue
        for row in np.flatnonzero(wrong)[:1].tolist():
            raise fields.error(f"it must be {text}, got {values[row]:g}", row, key)


def _sigma(fields: Fields) -> tuple[np.ndarray | None, tuple[str, ...]]:
    """Standard deviations; a 0 is one that was rounded, and taken as half of the smallest stated one."""
    stated = fields.stacked(_SIGMA, missing=np.nan)
    if stated is None:
        return None, ()
    sigma, notes = stated.copy(), []
    for kind, own in (("position", sigma[:, :3]), ("orientation", sigma[:, 3:])):
        if count := int((own == 0.0).any(1).sum()):
            known = own[own > 0.0]
            own[own == 0.0] = 0.5 * known.min() if len(known) else np.nan
            taken = "half of the smallest stated one" if len(known) else "not stated"
            notes.append(f"{count} rows state a {kind} sigma of 0, which was rounded; it is taken as {taken}")
    return sigma, tuple(notes)


def _plain(fields: Fields, joints: int) -> dict[str, Any]:
    """Labels and numbers, which are taken as they are; those of other packages together."""
    plain, more = dict[str, Any](), dict[str, Any]()
    for column in (c for c in known_columns().values() if c.kept and c.name not in ("exclude", "reason")):
        values = fields.values.get(column.name)
        if column.per is Per.JOINT:
            wrong = [i for i in fields.numbers(rf"{column.name}(\d+)") if not 1 <= i <= joints]
            if wrong:
                raise FileError(f"joints are 1–{joints}, got {column.name}{wrong[-1]}", path=fields.source)
            unknown = 0.0 if column.name == "direction" else np.nan  # of joints that have no column
            values = fields.stacked(column.names(joints), missing=unknown)
        if values is not None:
            (plain if column.name in Dataset.__dataclass_fields__ else more)[column.name] = values
    if "distance" in plain:
        plain.setdefault("anchor", np.full(fields.rows, "anchor"))
    return {**plain, "more": more}


def _gaps(fields: Fields, numbers: Mapping[str, Float[np.ndarray, "rows _"]]) -> np.ndarray:
    """Why each row can't be used: "" for rows that can.

    A row needs one observation whole, of which an orientation is none; what it has in part keeps it out.

    Args:
        fields: Columns in SI.
        numbers: Observations that hold numbers, NaN where missing: 'position', 'marker 1', 'tilt 2', …
    """
    labels = [fields.values[key] != "" for key in ("contact", "point") if key in fields.values]
    if not numbers and not labels:
        wanted = "x[m], y[m], z[m], or distance, contact, markers or tilt_x2 …"
        text = f"nothing was observed: add {wanted}{unread_text(fields.unread, 'x')}"
        program = f"; this is {PROGRAMS}" * (PROGRAMS in fields.notes)
        raise DataError(f"{fields.source}: {text}{program}")
    whole = {name: ~np.isnan(values).any(1) for name, values in numbers.items()}
    if "distance" in whole and "anchor" in fields.values:
        whole["distance"] &= fields.values["anchor"] != ""
    in_part = {name: ~own & ~np.isnan(numbers[name]).all(1) for name, own in whole.items()}
    alone = [own for name, own in whole.items() if name != "orientation" or "position" not in whole]
    missing = "lacks its position" if "position" in whole else "has no observation"
    reasons = np.where(np.any([*labels, *alone], axis=0), "", missing).astype(object)
    for row in np.flatnonzero(np.any([*in_part.values()], axis=0)).tolist():
        part = [name for name, own in in_part.items() if own[row]]
        axes = [key for key, value in zip("xyz", numbers[part[0]][row], strict=False) if np.isnan(value)]
        names = {"position": ", ".join(axes), "distance": "anchor"}
        reasons[row] = f"lacks {', '.join(names.get(name, f'a part of its {name}') for name in part)}"
    return reasons.astype(str)


def _own_numbers(fields: Fields) -> tuple[str, Int[np.ndarray, " rows"]]:
    """The file's own numbers of its rows, ascending, with their heading; those from 0 if it has none, or one
    that only counts the rows, too."""
    for heading, cells in fields.unread.items():
        if normalised(heading) in COUNTERS and all(c.isdecimal() and len(c) < MAX_DIGITS for c in cells):
            own = np.array(cells, np.int64)
            if (np.diff(own) > 0).all() and (own[0] > 1 or own[-1] - own[0] >= len(own)):
                return heading, own
    return "", np.arange(fields.rows)


def _row_notes(fields: Fields, row: np.ndarray, excluded: Mask, found: Mask, why: np.ndarray) -> list[str]:
    """What is said of excluded rows and of labels."""
    rows = np.flatnonzero(found)
    if len(rows) and (found | excluded).all():
        text = f"no row can be used: data row {row[rows[0]]} {why[rows[0]]}, and so on"
        empty = [fields.headings.get(k, k) for k, own in fields.values.items() if (own != own).all()]
        text += f"; no cell of {listed(empty)} holds a value" * bool(empty)
        text += " (of a formula, only once a spreadsheet has saved it)" * fields.source.endswith(".xlsx")
        raise DataError(f"{fields.source}: {text}")
    notes = [f"{plural(int(excluded.sum()), 'row')} excluded by the file"] if excluded.any() else []
    named = rows[:_NAMED].tolist()
    notes += [f"data row {row[k]} (line {fields.lines[k]}) {why[k]} and is excluded" for k in named]
    notes += [f"{len(rows) - _NAMED} more rows with gaps are excluded"] * (len(rows) > _NAMED)
    for key in ("session", "group"):
        if key in fields.values and (fields.values[key] == "").any():
            notes.append(f"rows without a {key} name are taken as one {key}")
    if "distance" in fields.values and "anchor" not in fields.values:
        notes.append("there is no 'anchor' column: all distances are taken from one anchor")
    for key in row_drivers():
        if key in fields.values and (missing := int(np.isnan(fields.values[key]).sum())):
            notes.append(f"{plural(missing, 'row')} without {key}")
    return notes
