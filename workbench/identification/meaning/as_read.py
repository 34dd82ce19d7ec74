"""An arm and rows as a fit should take them: as given, as found, or not at all."""

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from itertools import product

import numpy as np

from workbench.arm.joint_units import sliding, sliding_numbers
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError, OptionError, UnitError
from workbench.base.wording import plural
from workbench.data.dataset import Dataset
from workbench.data.plausibility import checked
from workbench.identification.meaning.exchanged_markers import with_own_names
from workbench.identification.meaning.meaning import RowMeaning
from workbench.identification.meaning.nominal_fit import (
    with_holding_torques,
    with_planes,
    with_tool_points,
    with_wires,
)
from workbench.identification.meaning.read_rows import read_rows
from workbench.identification.meaning.reading import RowReading
from workbench.identification.meaning.search import STILL, ReadingSearch
from workbench.identification.meaning.usable_rows import MIN_ROWS, usable, without_still_turns
from workbench.identification.rows.row_selection import without

FEW_ROWS, NARROW_RANGE = 15, float(np.radians(30.0))
"""Rows, and range of the joints, below which a fit confirms neither zeros nor signs."""


def as_read(
    robot: Robot,
    data: Dataset,
    how: str = "auto",
    *,
    exclude: Mapping[int, str] | None = None,
    keeps_arm: bool = False,
    takes_rival: bool = False,
) -> tuple[Robot, Dataset, str]:
    """An arm, its rows as they clearly are, with a note on it, and that these are another arm's or "".

    Units and conventions that a heading leaves open are applied. Signs, zeros, couplings, order, and
    another arm end with a sentence and its remedy, since a saved arm must count its joints as the
    controller does: where the reading is accepted the arm counts so, or the rows are changed and say it.

    Args:
        how: What is accepted, as of `FitChoices.reading`.
        exclude: Numbers of rows that are kept out, with the reason.
        keeps_arm: Whether the rows are changed in any case.
        takes_rival: Whether rows of another built-in arm are taken, as where nothing is fitted.

    Raises:
        DataError: another reading is clearly better and `how` doesn't accept it, or the rows are of no such
        arm.
        UnitError: the file lacks units, and the rows don't tell them.
    """
    data = with_own_names(without(data, exclude or {}))
    if how == "given" or data.readings is not None:
        return robot, with_units(robot, data) if data.missing_units else data, ""
    arm, rows, rival = _as_read(robot, data, how, keeps_arm, takes_rival)
    rows = with_own_names(with_tool_points(arm, _with_orientation(arm, rows)))
    return arm, with_holding_torques(arm, rows), rival


_meaning = lru_cache(maxsize=2)(read_rows)
"""Kept: what fits, what judges the fit, and the page ask it of the same rows."""


def understood(robot: Robot, data: Dataset) -> tuple[Dataset, RowMeaning | None]:
    """Rows without those that a column tells not to fit, with a note, and their meaning as of `read_rows`."""
    meaning = _meaning(robot, data)
    if meaning is None or not meaning.kept:
        return data, meaning
    heading, value = meaning.kept
    lost = np.flatnonzero(data.included & (data.unread[heading] != value)).tolist()
    kept = data.kept_out(dict.fromkeys(lost, "is told by a column not to fit"))
    return understood(robot, _with_notes(kept, f"{plural(len(lost), 'row')} left out: {meaning.told}"))


def _as_read(
    robot: Robot, data: Dataset, how: str, keeps_arm: bool, takes_rival: bool
) -> tuple[Robot, Dataset, str]:
    data, meaning = understood(robot, with_wires(robot, with_planes(robot, without_still_turns(robot, data))))
    if data.missing_units:
        return _as_read(robot, with_units(robot, data), how, keeps_arm, takes_rival)
    if how not in {"auto", "found"} and not (meaning is not None and meaning.is_misread):
        known = "'auto', 'found' or 'given', as these rows mean one thing"
        raise OptionError(f"reading must be {known}, got '{how}'", option="reading", found=how)
    if meaning is None and data.position is not None and data.session is not None:
        few = f"no session has {MIN_ROWS} rows with a position: what they mean was not checked"
        return robot, _with_notes(data, few), ""
    if meaning is None or (data.joints != robot.dof and not meaning.is_found):
        return robot, data, ""
    if meaning.is_misread:
        sentence = f"{meaning.text(bare=bool(robot.effects))}; {meaning.remedy}"
        if meaning.best.other and takes_rival:
            return robot, data, sentence.rpartition(", or ")[0]
        if meaning.best.other or (accepted := meaning.accepted(how)) is None:
            raise DataError(f"{data.source}: {sentence}")
        arm = None if keeps_arm else accepted.on(robot)
        sentence = replace(meaning, best=accepted).text(bare=bool(robot.effects))
        note = f"{'read so' if arm in (None, robot) else 'the arm counts so'}: {sentence}"
        return arm or robot, _read_as(accepted.apply(data, joints=arm is None), note), ""
    if data.joints != robot.dof:
        return _as_read(robot, with_own_columns(robot, data), how, keeps_arm, takes_rival)
    data, given = as_told(data, meaning), meaning.given
    if given is None or meaning.is_far:
        checked(robot, data)  # a unit that the numbers contradict is named before any other arm
        unread = "".join(f"; {note}" for note in data.notes if note.startswith("columns left out"))
        raise DataError(f"{data.source}: {meaning.text()}; {meaning.remedy}{unread}")
    told = _unconfirmed(data) if meaning.is_found else (meaning.text(), meaning.cure)
    return robot, _with_notes(data, *filter(None, told)), ""


def with_own_columns(robot: Robot, data: Dataset) -> Dataset:
    """The rows without the columns that move no joint of the arm, as of a jaw, where rows tell which.

    Raises:
        DataError: the others are in another order.
    """
    meaning = understood(robot, data)[1] if data.joints > robot.dof else None
    if meaning is None or not meaning.is_found or meaning.best.other or data.missing_units:
        return data
    if meaning.is_misread:
        raise DataError(f"{data.source}: {meaning.text()}; correct the file")
    return as_told(data, meaning)


def as_told(data: Dataset, meaning: RowMeaning) -> Dataset:
    """The rows with what headings leave open and they tell: units, which columns are joints, orientations."""
    best, plain = meaning.best, RowReading.plain(meaning.best.robot)
    if data.missing_units:
        read = replace(plain, unit=best.unit, scale=best.scale)
        note = "; ".join([f"units that the file lacks are told by the rows: {best.size}", *read.changes])
    elif data.joints > best.robot.dof:
        read, left = replace(plain, w=best.w), np.flatnonzero(~best.w.any(axis=0))
        names = ", ".join(f"q{k + 1}" for k in left)
        note = f"{names} moves no joint of this arm and is left out: {best.size}"
    elif meaning.turned is not None and meaning.plain is not None:
        read, instead = meaning.turned, f"instead of {meaning.plain.size} as the heading says"
        note = f"{read.text}: {read.size} {instead}; read so"
    else:
        return data
    return _read_as(replace(read.apply(data, joints=not data.missing_units), missing_units=""), note)


def _with_orientation(robot: Robot, data: Dataset) -> Dataset:
    """The rows with the orientation that three columns of angles clearly are, which nobody names."""
    if data.written is None or data.rotation is not None or data.joints != robot.dof:
        return data
    turned = replace(data, rotation=se3.rotvec_to_matrix(data.written.numbers))  # or as the rows tell
    if (rows := usable(turned)) is None or rows.rotation is None:
        return data
    search = ReadingSearch(robot, data=rows)
    (found,) = search.place([RowReading.plain(robot)])
    if not (found.is_plain and search.suffices(found)):
        return data
    return _read_as(found.apply(turned), f"angles left out: {found.orientation}, {found.size}; read so")


def with_units(robot: Robot, data: Dataset) -> Dataset:
    """The rows in the units that they tell, if need be without orientations; what slides is in m or mm."""
    said, nearest = np.array(data.joint_units or ("",) * data.joints), None
    slides = np.isin(said, ("", "rad", "deg")) & (data.joints == robot.dof and sliding(robot))
    numbers = np.where(said == "deg", np.rad2deg(data.q), data.q)  # a slide of 71 mm is no angle
    angles, scales = {"": data.q}, {"m": 1.0, "mm": 1e-3} if slides.any() else {"": 1.0}
    if slides.any() and np.abs(numbers[:, ~slides]).max(initial=0.0) <= 2.0 * np.pi and "deg" in said:
        angles[", what turns in rad"] = numbers
    for is_turned, turns, unit in product((True, False)[: 1 + (data.rotation is not None)], angles, scales):
        units = tuple(np.where(slides, unit, said).tolist()) if data.joint_units else ()
        rows = replace(data, q=np.where(slides, numbers * scales[unit], angles[turns]), joint_units=units)
        meaning = understood(robot, rows if is_turned else replace(rows, rotation=None, written=None))[1]
        nearest = nearest or meaning
        if meaning is not None and meaning.is_found and not meaning.best.other:
            told = f"what slides is in {unit}{turns}, as the rows tell"
            return _with_notes(as_told(rows, meaning), *[told] * bool(unit))
    raise _unread_units(robot, data, nearest)


def _unread_units(robot: Robot, data: Dataset, meaning: RowMeaning | None) -> UnitError:
    """That a file lacks units, which its rows don't tell."""
    text, slides = data.missing_units, [f"q{k + 1}" for k in sliding_numbers(robot)]
    if slides:
        text = text.replace("rad or deg", f"rad or deg, m or mm for {', '.join(slides)}")
        text = re.sub(r"\[(deg|rad)\]", "[mm]", text) if "q1" in slides and "q1[" in text else text
    elif meaning is not None and not meaning.is_found:
        text += f"; the rows tell none: the nearest leaves {meaning.best.size}"
    return UnitError(text, unit="")


def _read_as(data: Dataset, note: str) -> Dataset:
    """Rows with one more thing that isn't as their headings say."""
    return replace(_with_notes(data, note), read_as="; ".join(filter(None, [data.read_as, note])))


def _with_notes(data: Dataset, *notes: str) -> Dataset:
    return replace(data, notes=(*data.notes, *notes)) if notes else data


def _unconfirmed(data: Dataset) -> tuple[str, ...]:
    """What rows that are few, or move the joints little, leave open though they fit."""
    q = data.q[data.included]
    moved = np.ptp(q, axis=0) if len(q) else np.zeros(1)
    spread = float(np.median(moved[moved > STILL])) if (moved > STILL).any() else 0.0
    if len(q) >= FEW_ROWS and spread >= NARROW_RANGE:
        return ()
    few = f"{plural(len(q), 'row')} with joints within ± {np.degrees(spread / 2.0):.0f}°"
    return (f"{few} can't confirm the zeros and signs of joints",)
