"""From columns in SI to a `Dataset`: joints, observations, labels, and every decision in its notes.

A row counts when one of its observations is whole: position (with orientation where the file has one), a
marker, a distance with its anchor, a touched point, a socket, an inclinometer. A row with a gap is kept out,
with its reason.
"""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from workbench.base.columns import Per, row_drivers
from workbench.base.errors import DataError, FileError, ShapeError
from workbench.base.remedy import remedy
from workbench.base.types import Matrix4
from workbench.base.units import parse_heading
from workbench.base.wording import plural
from workbench.data.dataset import Dataset
from workbench.data.known_columns import known_columns
from workbench.data.plausibility import repeated_rows
from workbench.data.readers.columns_option import Joints
from workbench.data.readers.fields import Fields, in_base
from workbench.data.readers.file_kind import POSE_PAIRS
from workbench.data.readers.headings import column_of
from workbench.data.readers.long_tables import with_markers
from workbench.data.readers.orientation import read_orientation, written_orientation

_CHECKED = {"distance", "direction", "exclude", "reason"}
"""Columns that are read by a function of their own."""
_XYZ = ("x", "y", "z")
_SIGMA = tuple(f"sigma_{axis}" for axis in ("x", "y", "z", "rx", "ry", "rz"))
_WRENCH = tuple(f"{kind}_{axis}" for kind in ("force", "moment") for axis in "xyz")
_OF_TARGET = re.compile(
    r"(target|marker|board|tag|object|camera|cam)\w*[_ .](t?[xyz]|q[wxyz]|r[xyz])\b", re.I
)
"""Headings of a target's pose in a camera."""
_TRUE = {"true", "1", "1.0", "yes", "y", "x", "wahr", "ja", "j"}
_FALSE = {"", "false", "0", "0.0", "no", "n", "falsch", "nein"}

Mask = Bool[np.ndarray, " rows"]


def assemble(
    fields: Fields,
    *,
    joints: Joints,
    base: Matrix4 | None = None,
    beside: Mapping[str, np.ndarray] | None = None,
) -> Dataset:
    """A `Dataset` of all columns.

    Args:
        fields: Columns in SI.
        joints: Number of joints that the robot has, or their names; None: as many as the file names.
        base: Pose of the robot's base in the measuring frame, for poses that are in the robot's base.
        beside: What was observed otherwise, one number or more a row by its name, NaN where a row has none.
    """
    if beside is None and {"u", "v", "id"} <= set(fields.values):
        raise FileError("is a table of pixels: give --camera and --target as well", path=fields.source)
    q, excluded = joint_columns(fields, joints), _excluded_by_file(fields)
    if beside is None and (wide := with_markers(fields, q, excluded)) is not fields:
        return assemble(wide, joints=joints, base=base)
    _need_whole_joints(fields, q, excluded)
    position = fields.stacked(_XYZ)
    rotation, notes = read_orientation(fields, usable=~excluded)
    position, rotation, moved = _measured(fields, position, rotation, base)
    markers, tilt = _markers(fields), _tilt(fields)
    sigma, rounded = _sigma(fields)
    observed = _observations(fields, position, rotation, markers, tilt, beside or {})
    reasons = _gaps(fields, observed)
    found = np.array([bool(reason) for reason in reasons]) & ~excluded
    dataset = Dataset(
        q=q,
        row=np.arange(fields.rows),
        position=position,
        rotation=rotation,
        written=None if moved else written_orientation(fields),
        markers=markers,
        distance=_distance(fields),
        direction=_signs(fields, q.shape[1]),
        sigma=sigma,
        tilt=tilt,
        wrench=fields.stacked(_WRENCH, missing=0.0),
        exclude=excluded | found if "exclude" in fields.values or found.any() else None,
        reason=_reasons(fields, reasons, found),
        source=fields.source,
        notes=fields.notes
        + notes
        + rounded
        + moved
        + _excluded_notes(fields, excluded, found, reasons)
        + _label_notes(fields),
        joint_units=joint_units(fields),
        unsaid=fields.unsaid,
        **_plain(fields, q.shape[1]),
    )
    return replace(dataset, notes=dataset.notes + _repeats(dataset, fields))


def _measured(fields: Fields, position, rotation, base: Matrix4 | None):
    """Position and rotation in the measuring frame, and what was said about it."""
    if not in_base(fields):
        return position, rotation, ()
    if base is None:
        raise FileError(
            "its poses are in the robot's base frame (column 'pose_frame'): give the pose of the base in the "
            "measuring frame, read_measurements(…, base=robot.base.pose)",
            path=fields.source,
        )
    position = None if position is None else position @ base[:3, :3].T + base[:3, 3]
    rotation = None if rotation is None else base[:3, :3] @ rotation
    return (
        position,
        rotation,
        ("poses are in the robot's base frame (column 'pose_frame'), moved by the base",),
    )


def joint_columns(fields: Fields, joints: Joints) -> Float[np.ndarray, "rows n"]:
    """Joint positions [rad or m] from q1 … qN."""
    numbers = fields.numbers(r"q(\d+)")
    wanted = joints if isinstance(joints, int | None) else len(joints)
    if not numbers:
        paired = any(_OF_TARGET.match(heading) for heading in fields.unread)
        raise DataError(
            f"{fields.source}: there are no joint columns: add q1[rad], q2[rad], …"
            + remedy(", or give a table of joints (--joints)", page="")
            + f"; {POSE_PAIRS}" * paired
        )
    lacking = next((i for i, number in enumerate(numbers, start=1) if number != i), None)
    if lacking is not None:
        last = fields.headings.get(f"q{numbers[-1]}", f"q{numbers[-1]}")
        raise FileError(
            f"column '{last}' is joint {numbers[-1]}, but joint {lacking} has no column: name the joints "
            "q1, q2, … or as the robot's file does",
            path=fields.source,
        )
    if wanted is not None and len(numbers) != wanted:
        raise ShapeError(
            f"{fields.source}: the file has {plural(len(numbers), 'joint column')} (q1 … q{numbers[-1]}), "
            f"the robot {plural(wanted, 'joint')}: choose the robot that was measured",
            expected=wanted,
            found=len(numbers),
        )
    return np.stack([fields.values[f"q{i}"] for i in numbers], axis=1)


def joint_units(fields: Fields) -> tuple[str, ...]:
    """Unit of each joint's column, as the file has it; empty where it has none."""
    names = [f"q{i}" for i in fields.numbers(r"q(\d+)")]
    return tuple(fields.units.get(n) or parse_heading(fields.headings.get(n, "")).unit or "" for n in names)


def _observations(fields: Fields, position, rotation, markers, tilt, beside) -> dict[str, np.ndarray]:
    """Observations by name, as `_gaps` takes them."""
    observed: dict[str, np.ndarray] = dict(beside)
    if position is not None:
        observed["position"] = position
    if rotation is not None:
        observed["orientation"] = rotation
    if markers is not None:
        observed |= {f"marker {i + 1}": markers[:, i] for i in range(markers.shape[1])}
    if "distance" in fields.values:
        observed["distance"] = fields.values["distance"][:, None]
    observed |= {f"tilt {link}": values for link, values in (tilt or {}).items()}
    observed |= {n: v.reshape(fields.rows, -1) for n, v in fields.values.items() if _is_observed(n)}
    if not observed and "contact" not in fields.values and "point" not in fields.values:
        raise DataError(
            f"{fields.source}: nothing was observed: "
            "add x[m], y[m], z[m], or distance, contact, markers or tilt"
        )
    return observed


def _markers(fields: Fields) -> np.ndarray | None:
    """Markers m1 … mK, (rows, K, 3)."""
    numbers = fields.numbers(r"m(\d+)[xyz]")
    if numbers != list(range(1, len(numbers) + 1)):
        raise FileError("markers must be counted m1, m2, … without a gap", path=fields.source)
    places = [fields.stacked([f"m{i}{axis}" for axis in "xyz"]) for i in numbers]
    return np.stack([p for p in places if p is not None], axis=1) if places else None


def _tilt(fields: Fields) -> dict[int, np.ndarray] | None:
    readings = {
        link: fields.stacked((f"tilt_x{link}", f"tilt_y{link}")) for link in fields.numbers(r"tilt_[xy](\d+)")
    }
    return {link: values for link, values in readings.items() if values is not None} or None


def _distance(fields: Fields) -> np.ndarray | None:
    values = fields.values.get("distance")
    if values is not None and (values < 0).any():
        raise fields.error("a distance must be at least 0", int(np.argmax(values < 0)), "distance")
    return values


def _per_joint(fields: Fields, stem: str, joints: int) -> np.ndarray | None:
    """One value a joint; NaN for joints that have no column."""
    wrong = [i for i in fields.numbers(rf"{stem}(\d+)") if not 1 <= i <= joints]
    if wrong:
        raise FileError(f"joints are 1–{joints}, got {stem}{wrong[-1]}", path=fields.source)
    return fields.stacked([f"{stem}{i}" for i in range(1, joints + 1)], missing=np.nan)


def _signs(fields: Fields, joints: int) -> np.ndarray | None:
    values = _per_joint(fields, "direction", joints)
    if values is not None and len(wrong := np.argwhere(~np.isin(values, (-1, 0, 1)) & ~np.isnan(values))):
        row, joint = wrong[0]
        message = f"a direction must be -1, 0 or 1, got {values[row, joint]:g}"
        raise fields.error(message, int(row), f"direction{joint + 1}")
    return values


def _sigma(fields: Fields) -> tuple[np.ndarray | None, tuple[str, ...]]:
    """Standard deviations; a 0 is one that was rounded, and taken as half of the smallest stated one."""
    sigma = fields.stacked(_SIGMA, missing=np.nan)
    if sigma is None:
        return None, ()
    if len(wrong := np.argwhere(sigma < 0.0)):
        row, axis = wrong[0]
        raise fields.error("a standard deviation must not be negative", int(row), _SIGMA[axis])
    rounded, sigma, notes = sigma == 0.0, sigma.copy(), []
    for kind, axes in (("position", slice(0, 3)), ("orientation", slice(3, 6))):
        stated = sigma[:, axes]
        if (count := int(rounded[:, axes].any(1).sum())) == 0:
            continue
        known = stated[stated > 0.0]
        stated[stated == 0.0] = 0.5 * known.min() if len(known) else np.nan
        taken = "half of the smallest stated one" if len(known) else "not stated"
        notes.append(f"{count} rows state a {kind} sigma of 0, which was rounded; it is taken as {taken}")
    return sigma, tuple(notes)


def _is_observed(key: str) -> bool:
    """Whether a column of another package is what was observed."""
    column = column_of(key)
    return column is not None and column.observed and column.name not in _CHECKED


def _plain(fields: Fields, joints: int) -> dict[str, Any]:
    """Labels and numbers, which are taken as they are; those of other packages together."""
    found = {
        column.name: _per_joint(fields, column.name, joints)
        if column.per is Per.JOINT
        else fields.values.get(column.name)
        for column in known_columns().values()
        if column.kept and column.name not in _CHECKED
    }
    plain = {name: values for name, values in found.items() if values is not None}
    if "distance" in fields.values and "anchor" not in plain:
        plain["anchor"] = np.full(fields.rows, "anchor")
    own = plain.keys() & Dataset.__dataclass_fields__.keys()
    more = {name: values for name, values in plain.items() if name not in own}
    return {name: plain[name] for name in own} | {"more": more}


def _excluded_by_file(fields: Fields) -> Mask:
    """Mask that the file itself keeps out."""
    if "exclude" not in fields.values:
        return np.zeros(fields.rows, bool)
    cells = [str(word).strip().lower() for word in fields.values["exclude"]]
    for row, word in enumerate(cells):
        if word not in _TRUE | _FALSE:
            raise fields.error(f"'{word}' is neither true nor false", row, "exclude")
    return np.array([word in _TRUE for word in cells], bool)


def _gaps(fields: Fields, numbers: dict[str, np.ndarray]) -> list[str]:
    """Why each row can't be used: '' for rows that can.

    Args:
        fields: Columns in SI.
        numbers: Observations that hold numbers, each (rows, …), NaN where missing: 'position',
            'orientation', 'marker 1', 'distance', 'tilt 2', …
    """
    blank = {name: np.isnan(v.reshape(fields.rows, -1)) for name, v in numbers.items()}
    empty = {name: b.all(1) for name, b in blank.items()}
    whole = {name: ~b.any(1) for name, b in blank.items()}
    if "distance" in whole and "anchor" in fields.values:
        whole["distance"] &= fields.values["anchor"] != ""
    none = np.zeros(fields.rows, bool)
    partial = {name: ~whole[name] & ~empty[name] for name in blank}
    pose = [name for name in ("position", "orientation") if name in blank]
    other = np.any([none, *(whole[name] for name in blank if name not in pose)], axis=0)
    for key in ("contact", "point"):
        if key in fields.values:
            other |= fields.values[key] != ""
    gone = np.any([none, *(empty[name] for name in pose)], axis=0) & ~other
    unseen = ~other if not pose else none
    reasons = [""] * fields.rows
    for row in np.flatnonzero(np.any([gone, unseen, *partial.values()], axis=0)).tolist():
        lost = [name for name in pose if empty[name][row]]
        if parts := [name for name in blank if partial[name][row]]:
            reasons[row] = f"lacks {', '.join(_blank_cells(name, numbers[name][row]) for name in parts)}"
        else:
            reasons[row] = f"lacks its {' and '.join(lost)}" if lost else "has no observation"
    return reasons


def _blank_cells(name: str, values: np.ndarray) -> str:
    """What is blank in a row's observation."""
    if name == "position":
        return ", ".join(key for key, value in zip(_XYZ, values, strict=True) if np.isnan(value))
    return "anchor" if name == "distance" else f"a part of its {name}"


def _need_whole_joints(fields: Fields, q: np.ndarray, excluded: Mask) -> None:
    """Raise when a row that is not kept out lacks a joint position."""
    rows, joints = np.nonzero(np.isnan(q) & ~excluded[:, None])
    if len(rows):
        raise fields.error(
            "the joint position is missing: fill it in, delete the row, or set its 'exclude' to true",
            int(rows[0]),
            f"q{joints[0] + 1}",
        )


def _reasons(fields: Fields, reasons: list[str], found: np.ndarray) -> np.ndarray | None:
    """The file's reasons, and ours for the rows that we keep out."""
    if "reason" not in fields.values and not found.any():
        return None
    given = fields.values.get("reason", np.full(fields.rows, ""))
    return np.array(
        [why if f else str(g) for g, why, f in zip(given, reasons, found, strict=True)], dtype=str
    )


def _excluded_notes(fields: Fields, excluded, found, reasons: list[str]) -> tuple[str, ...]:
    notes = [f"{plural(int(excluded.sum()), 'row')} excluded by the file"] if excluded.any() else []
    rows = np.flatnonzero(found)
    notes += [f"data row {row} (line {fields.lines[row]}) {reasons[row]} and is excluded" for row in rows[:5]]
    if len(rows) > 5:
        notes.append(f"{len(rows) - 5} more rows with gaps are excluded")
    if found.any() and (found | excluded).all():
        raise DataError(
            f"{fields.source}: no row can be used: data row {rows[0]} {reasons[rows[0]]}, and so on"
        )
    return tuple(notes)


def _label_notes(fields: Fields) -> tuple[str, ...]:
    notes = []
    for key in ("session", "group"):
        if key in fields.values:
            number = len(set(fields.values[key].tolist()))
            notes.append(f"{plural(number, key)}")
            if (fields.values[key] == "").any():
                notes.append(f"rows without a {key} name are taken as one {key}")
    if "distance" in fields.values and "anchor" not in fields.values:
        notes.append("there is no 'anchor' column: all distances are taken from one anchor")
    for key in row_drivers():
        if key in fields.values and (missing := int(np.isnan(fields.values[key]).sum())):
            notes.append(f"{plural(missing, 'row')} without {key}")
    return tuple(notes)


def _repeats(dataset: Dataset, fields: Fields) -> tuple[str, ...]:
    """Notes on rows that stand twice."""
    pairs = repeated_rows(dataset)
    notes = [
        f"data row {again} (line {fields.lines[again]}) repeats data row {first} (line {fields.lines[first]})"
        for first, again in pairs[:5]
    ]
    return (*notes, *((f"{len(pairs) - 5} more rows repeat others",) if len(pairs) > 5 else ()))
