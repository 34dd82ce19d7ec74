"""Plausibility of measurements for a given arm: joints beyond limits, gross rows, copies.

What the rows mean, in what units, is asked of `identification/meaning/`.
"""

from collections.abc import Iterator
from dataclasses import fields, replace

import numpy as np
from jaxtyping import Float

from workbench.arm.built_in_arms import posed_arm
from workbench.arm.frame import revised
from workbench.arm.joint_units import implausible_joint, sliding
from workbench.arm.robot import Robot
from workbench.arm.urdf import tip_of
from workbench.base.errors import DataError, ShapeError
from workbench.base.remedy import remedy
from workbench.base.units import Quantity, conversion
from workbench.base.wording import in_mm, plural, ranges
from workbench.data.dataset import Dataset
from workbench.data.postures import MAX_SCATTER, equal_rows

SLACK, NO_DIFFERENCE = 0.05, 1e-6
"""How far beyond a limit a joint may be without a note, and what is no difference [rad or m]."""
MIN_STILLS, SETTLED, NOTICED = 8, 4.0, 2e-5
"""How many stills tell whether readings settle; by which factor [1], and beyond which distance [m]."""
UNCOMPARED = {"row", "place", "group", "exclude", "reason"}
"""Columns that tell nothing of what was measured."""


def checked(robot: Robot, dataset: Dataset) -> Dataset:
    """The same measurements, with a note on everything odd about them for this arm; rows that are kept out
    don't count."""
    if dataset.readings is not None and dataset.readings.has_tool_poses and robot is not posed_arm():
        why = f"the rows have tool poses instead of joints, so robot '{robot.name}' can't be checked"
        raise DataError(f"{dataset.source}: {why}; give the joints, or identify only camera and target")
    if (own := len(robot.limits)) != dataset.joints:
        numbers = f"the data have {dataset.joints} joints, the robot {own}: choose the robot measured"
        if tip := tip_of(robot, dataset.joints):
            numbers += f", or its chain of {dataset.joints} joints by --tip {tip}"
        raise ShapeError(f"{dataset.source}: {numbers}", expected=own, found=dataset.joints)
    q = dataset.q[dataset.included] if dataset.included.any() else None
    refuse_joint_units(robot, q, dataset.joint_units, dataset.source)
    if q is None:
        return dataset
    dataset = _without_copies(dataset)
    notes = dict.fromkeys((*dataset.notes, *_joint_notes(dataset, robot.limits), *_settling(dataset)))
    return revised(dataset, notes=tuple(notes))


def repeated_rows(dataset: Dataset) -> list[tuple[int, int]]:
    """Pairs (first, again) of rows that are equal to the last digit in all that was measured, in order.

    Independent readings at equal joints differ in what was read, in its time, or in what drives an effect.
    """
    if len(equal_rows(dataset.q)[1]) == len(dataset):
        return []
    readings = () if dataset.readings is None else (dataset.readings.numbers,)
    others = (*(dataset.tilt or {}).values(), *dataset.more.values(), *readings)
    mine = (getattr(dataset, f.name) for f in fields(dataset) if f.name not in UNCOMPARED)
    columns = [a for a in (*mine, *others) if isinstance(a, np.ndarray)]
    numbers = [np.unique(a, return_inverse=True)[1] if a.dtype.kind in "UO" else a for a in columns]
    whole = np.hstack([a.reshape(len(dataset), -1) for a in numbers])
    number, first = equal_rows(np.nan_to_num(whole, nan=np.inf))  # missing alike is alike
    return [(int(first[k]), row) for row, k in enumerate(number.tolist()) if first[k] != row]


def refuse_joint_units(robot: Robot, q: np.ndarray | None, units: tuple[str, ...], source: str) -> None:
    """Raise where a joint's column is a wrong quantity by its unit, or far beyond limits by its numbers."""
    doubtful = []
    for joint, (unit, slides) in enumerate(zip(units, sliding(robot), strict=False), start=1):
        is_length = unit and conversion(unit, Quantity.ANGLE, Quantity.LENGTH).quantity is Quantity.LENGTH
        if is_length != slides and unit not in ("", "rad"):
            kind, wanted = ("slides", "mm") if slides else ("turns", "deg")
            wrong = f"joint {joint} {kind}, but its column is q{joint}[{unit}]: write q{joint}[{wanted}]"
            raise DataError(f"{source}: {wrong}")
        doubtful += [f"q{joint}[deg]"] * (unit in ("", "rad") and not slides)
    if q is None or (found := implausible_joint(q, robot.limits)) is None:
        return
    joint, unit, bound = found
    as_degrees = f"degrees labelled rad: write {', '.join(doubtful) or 'q1[deg] …'}"
    looks = {"mm": "mm labelled m: write the correct unit", "degrees": as_degrees}
    check = "check the units and the order of the joint columns"
    guess = f"these look like {looks[unit]} in the header" if unit else check
    largest, limit = np.nanmax(np.abs(q[:, joint])), f"{bound:.4g} {'m' if unit == 'mm' else 'rad'}"
    far = f"joint {joint + 1} reaches {largest:.4g} but its limit is {limit}"
    raise DataError(f"{source}: {far}: {guess}", joint=joint)


def _joint_notes(dataset: Dataset, limits: Float[np.ndarray, "n 2"]) -> Iterator[str]:
    """Joints that never move or go beyond their limits."""
    q, rows = dataset.q[dataset.included], dataset.row[dataset.included]
    is_outside = (q < limits[:, 0] - SLACK) | (q > limits[:, 1] + SLACK)
    for joint in np.flatnonzero(is_outside.any(0)):
        (low, high), outside = limits[joint], rows[is_outside[:, joint]]
        where = f"outside its limits ({low:.4g} … {high:.4g}) in {len(outside)} row(s)"
        yield f"joint {joint + 1} is {where}, first in data row {outside[0]}"
    still = (np.flatnonzero(np.ptp(q, axis=0) < NO_DIFFERENCE) + 1).tolist()
    if len(q) > 1 and still:
        why = "their errors can't be distinguished from their neighbours'"
        yield f"joint(s) {', '.join(map(str, still))} never move: {why}"


def _settling(dataset: Dataset) -> Iterator[str]:
    """Readings of stills that move on, ever less, until their middle: scatter, drift, and jumps don't."""
    seen = dataset.position if dataset.markers is None else dataset.markers[:, 0]
    if seen is None:
        return
    rows = np.flatnonzero(dataset.included & np.isfinite(seen).all(1))
    moved = np.abs(np.diff(dataset.q[rows], axis=0)).max(1, initial=0.0) > MAX_SCATTER
    stills = [k for k in np.split(rows, np.flatnonzero(moved) + 1) if len(k) > 4]
    stills = [k for k in stills if np.ptp(dataset.q[k], axis=0).max() < MAX_SCATTER]
    if len(stills) < MIN_STILLS:
        return
    ways = [seen[k[[0, 1, -1]]] - seen[k[len(k) // 2]] for k in stills]
    early, second, late = np.median(np.linalg.norm(ways, axis=2), axis=0)
    is_jump = abs(second / max(early, NOTICED) - 0.5) > 0.4  # another load or approach
    if not is_jump and early > SETTLED * max(late, NOTICED):
        before = dataset.row[np.concatenate([k[: len(k) // 2] for k in stills])].tolist()
        moved = f"moves by {in_mm(early)}, then by {in_mm(late)}: they began before the arm stood still"
        out = f"leave out rows {ranges(before)}{remedy(' (--exclude)', page='')}"
        yield f"until the middle of its readings the point of a posture {moved}; {out}"


def _without_copies(dataset: Dataset) -> Dataset:
    """The rows without what repeats another to the last digit, rows or their markers: it tells nothing."""
    included, markers = np.flatnonzero(dataset.included), dataset.markers
    rows = dataset.take(included)
    same = "to the last digit"
    copies = {included[b]: f"repeats data row {rows.row[a]} {same}" for a, b in repeated_rows(rows)}
    if markers is not None:
        seen, markers = np.isfinite(markers).any((1, 2)), markers.copy()
        for k in range(markers.shape[1]):
            again = [b for _, b in repeated_rows(replace(rows, markers=markers[included, k : k + 1]))]
            markers[included[again], k] = np.nan
        gone = included[(seen & np.isnan(markers).all((1, 2)))[included]]
        copies = dict.fromkeys(gone, f"repeats others {same}") | copies
    if not copies:
        return dataset
    note = f"{plural(len(copies), 'duplicate row')} ignored"
    return replace(dataset.kept_out(copies), markers=markers, notes=(*dataset.notes, note))
