"""From columns in SI to a `Dataset`: joints, observations, labels, and every decision said."""

import re
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from workbench.base.errors import DataError, FileError, ShapeError
from workbench.data.dataset import Dataset
from workbench.data.plausible import repeated_rows
from workbench.data.readers.fields import Fields
from workbench.data.readers.observed import (
    excluded_by_file,
    gaps,
    need_whole_joints,
    refuse_incomplete,
)
from workbench.data.readers.orientation import read_orientation
from workbench.data.readers.wording import counted

_LABELS = ("anchor", "contact", "point", "session", "group")
_NUMBERS = ("time", "temperature", "payload")
_XYZ = ("x", "y", "z")


def assemble(fields: Fields, *, joints: int | None) -> Dataset:
    """A `Dataset` of all columns.

    Args:
        fields: Columns in SI.
        joints: Number of joints that the robot has; None: as many as the file names.

    Raises:
        ShapeError: The file has another number of joints.
        DataError: There are no joints, or nothing was observed.
        FileError: A value can't be what its column says.
    """
    q = joint_columns(fields, joints)
    excluded = excluded_by_file(fields)
    need_whole_joints(fields, q, excluded)
    refuse_incomplete(fields, _XYZ)
    position = _stacked(fields, _XYZ)
    rotation, notes = read_orientation(fields, usable=~excluded)
    markers, tilt = _markers(fields), _tilt(fields)
    observed = _observations(fields, position, rotation, markers, tilt)
    reasons = gaps(fields, observed)
    found = np.array([bool(reason) for reason in reasons]) & ~excluded
    dataset = Dataset(
        q=q,
        row=np.arange(fields.rows),
        position=position,
        rotation=rotation,
        markers=markers,
        distance=_distance(fields),
        torque=_per_joint(fields, "torque", q.shape[1]),
        direction=_signs(fields, q.shape[1]),
        sigma=_sigma(fields),
        tilt=tilt,
        wrench=_wrench(fields),
        exclude=excluded | found if "exclude" in fields.values or found.any() else None,
        reason=_reasons(fields, reasons, found),
        source=fields.source,
        notes=fields.notes + notes + _excluded_notes(fields, excluded, found, reasons) + _label_notes(fields),
        **_plain(fields),
    )
    return replace(dataset, notes=dataset.notes + _repeats(dataset, fields))


def joint_columns(fields: Fields, joints: int | None) -> Float[np.ndarray, "rows n"]:
    """Joint positions [rad or m] from q1 … qN.

    Raises:
        DataError: There are none.
        FileError: One is missing in between.
        ShapeError: The robot has another number of joints.
    """
    numbers = sorted(int(key[1:]) for key in fields.values if re.fullmatch(r"q\d+", key))
    if not numbers:
        raise DataError(f"{fields.source}: there are no joint columns: add q1[rad], q2[rad], …")
    lacking = sorted(set(range(1, numbers[-1] + 1)) - set(numbers))
    if lacking:
        raise FileError(
            f"joint columns go to q{numbers[-1]} but q{lacking[0]} is missing", path=fields.source
        )
    if joints is not None and len(numbers) != joints:
        raise ShapeError(
            f"{fields.source}: the file has {counted(len(numbers), 'joint column')} (q1 … q{numbers[-1]}), "
            f"the robot {counted(joints, 'joint')}: choose the robot that was measured",
            expected=joints,
            found=len(numbers),
        )
    return np.stack([fields.values[f"q{i}"] for i in numbers], axis=1)


def _observations(fields: Fields, position, rotation, markers, tilt) -> dict[str, np.ndarray]:
    """Observations by name, as `gaps` wants them.

    Raises:
        DataError: The file has none at all.
    """
    observed: dict[str, np.ndarray] = {}
    if position is not None:
        observed["position"] = position
    if rotation is not None:
        observed["orientation"] = rotation
    if markers is not None:
        observed |= {f"marker {i + 1}": markers[:, i] for i in range(markers.shape[1])}
    if "distance" in fields.values:
        observed["distance"] = fields.values["distance"][:, None]
    observed |= {f"tilt {link}": values for link, values in (tilt or {}).items()}
    if not observed and "contact" not in fields.values and "point" not in fields.values:
        raise DataError(
            f"{fields.source}: nothing was observed: "
            "add x[m], y[m], z[m], or distance, contact, markers or tilt"
        )
    return observed


def _stacked(fields: Fields, keys: tuple[str, ...]) -> np.ndarray | None:
    return np.stack([fields.values[key] for key in keys], axis=1) if keys[0] in fields.values else None


def _markers(fields: Fields) -> np.ndarray | None:
    """Markers m1 … mK, (rows, K, 3)."""
    numbers = sorted({int(m[1]) for key in fields.values if (m := re.fullmatch(r"m(\d+)[xyz]", key))})
    if not numbers:
        return None
    if numbers != list(range(1, len(numbers) + 1)):
        raise FileError("markers must be counted m1, m2, … without a gap", path=fields.source)
    for i in numbers:
        refuse_incomplete(fields, tuple(f"m{i}{axis}" for axis in "xyz"))
    return np.stack([np.stack([fields.values[f"m{i}{a}"] for a in "xyz"], axis=1) for i in numbers], axis=1)


def _tilt(fields: Fields) -> dict[int, np.ndarray] | None:
    links = sorted({int(m[1]) for key in fields.values if (m := re.fullmatch(r"tilt_[xy](\d+)", key))})
    for link in links:
        refuse_incomplete(fields, (f"tilt_x{link}", f"tilt_y{link}"))
    tilt = {i: np.stack([fields.values[f"tilt_{axis}{i}"] for axis in "xy"], axis=1) for i in links}
    return tilt or None


def _distance(fields: Fields) -> np.ndarray | None:
    values = fields.values.get("distance")
    if values is not None and (values < 0).any():
        raise fields.error("a distance is negative", int(np.argmax(values < 0)), "distance")
    return values


def _per_joint(fields: Fields, stem: str, joints: int) -> np.ndarray | None:
    """One value a joint; NaN for joints that have no column."""
    numbers = [int(m[1]) for key in fields.values if (m := re.fullmatch(rf"{stem}(\d+)", key))]
    if not numbers:
        return None
    if max(numbers) > joints or min(numbers) < 1:
        wrong = max(numbers) if max(numbers) > joints else min(numbers)
        raise FileError(f"there is {stem}{wrong}, but the joints are 1 … {joints}", path=fields.source)
    blank = np.full(fields.rows, np.nan)
    return np.stack([fields.values.get(f"{stem}{i}", blank) for i in range(1, joints + 1)], axis=1)


def _signs(fields: Fields, joints: int) -> np.ndarray | None:
    values = _per_joint(fields, "direction", joints)
    if values is not None:
        wrong = np.argwhere(~np.isin(values, (-1.0, 0.0, 1.0)) & ~np.isnan(values))
        if len(wrong):
            row, joint = wrong[0]
            raise fields.error(
                f"a direction is -1, 0 or 1, not {values[row, joint]:g}", int(row), f"direction{joint + 1}"
            )
    return values


def _sigma(fields: Fields) -> np.ndarray | None:
    keys = [f"sigma_{axis}" for axis in ("x", "y", "z", "rx", "ry", "rz")]
    if not any(key in fields.values for key in keys):
        return None
    blank = np.full(fields.rows, np.nan)
    sigma = np.stack([fields.values.get(key, blank) for key in keys], axis=1)
    wrong = np.argwhere(sigma <= 0.0)
    if len(wrong):
        row, axis = wrong[0]
        raise fields.error("a standard deviation must be above zero", int(row), keys[axis])
    return sigma


def _wrench(fields: Fields) -> np.ndarray | None:
    """Force and moment at the tool, 0 where there is no column for it."""
    keys = [f"{kind}_{axis}" for kind in ("force", "moment") for axis in "xyz"]
    if not any(key in fields.values for key in keys):
        return None
    return np.stack([fields.values.get(key, np.zeros(fields.rows)) for key in keys], axis=1)


def _plain(fields: Fields) -> dict[str, np.ndarray]:
    """Labels and single numbers, which are taken as they are."""
    plain = {key: fields.values[key] for key in (*_LABELS, *_NUMBERS) if key in fields.values}
    if "distance" in fields.values and "anchor" not in plain:
        plain["anchor"] = np.full(fields.rows, "anchor")
    return plain


def _reasons(fields: Fields, reasons: list[str], found: np.ndarray) -> np.ndarray | None:
    """The file's reasons, and ours for the rows that we keep out."""
    if "reason" not in fields.values and not found.any():
        return None
    given = fields.values.get("reason", np.full(fields.rows, ""))
    return np.array(
        [why if f else str(g) for g, why, f in zip(given, reasons, found, strict=True)], dtype=str
    )


def _excluded_notes(fields: Fields, excluded, found, reasons: list[str]) -> tuple[str, ...]:
    notes = [f"{counted(int(excluded.sum()), 'row')} kept out by the file"] if excluded.any() else []
    rows = np.flatnonzero(found)
    notes += [f"data row {row} (line {fields.lines[row]}) {reasons[row]} and is kept out" for row in rows[:5]]
    if len(rows) > 5:
        notes.append(f"{len(rows) - 5} more rows with gaps are kept out")
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
            notes.append(f"{counted(number, key)}")
            if (fields.values[key] == "").any():
                notes.append(f"rows without a {key} name are taken as one {key}")
    if "distance" in fields.values and "anchor" not in fields.values:
        notes.append("there is no 'anchor' column: all distances are taken from one anchor")
    for key in _NUMBERS:
        if key in fields.values and (missing := int(np.isnan(fields.values[key]).sum())):
            notes.append(f"{counted(missing, 'row')} without {key}")
    return tuple(notes)


def _repeats(dataset: Dataset, fields: Fields) -> tuple[str, ...]:
    """Notes on rows that stand twice."""
    pairs = repeated_rows(dataset)
    notes = [
        f"data row {again} (line {fields.lines[again]}) repeats data row {first} (line {fields.lines[first]})"
        for first, again in pairs[:5]
    ]
    return (*notes, *((f"{len(pairs) - 5} more rows repeat others",) if len(pairs) > 5 else ()))
