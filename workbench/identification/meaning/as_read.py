"""An arm and rows as a fit should take them: as given, as found, or not at all."""

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np

from workbench.arm.joint_units import sliding_numbers
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError, OptionError, UnitError
from workbench.base.remedy import remedy as at_entrance
from workbench.base.wording import in_mm, plural
from workbench.data.dataset import Dataset
from workbench.identification.meaning.meaning import RowMeaning
from workbench.identification.meaning.nominal_fit import with_holding_torques, with_planes, with_wires
from workbench.identification.meaning.read_rows import other_arm, read_rows
from workbench.identification.meaning.reading import FOREIGN_MISFIT, RowReading
from workbench.identification.meaning.search import CLEAR, STILL, ReadingSearch
from workbench.identification.meaning.unexplained import told_by_column
from workbench.identification.meaning.usable_rows import MIN_ROWS, usable, without_still_turns

SMALL_ZERO = 0.26
"""Zeros that differ by less [rad] are errors of the arm, which an identification finds."""
FEW_ROWS, NARROW_RANGE = 15, float(np.radians(30.0))
"""Rows, and range of the joints, below which a fit confirms neither zeros nor signs."""


def is_misread(meaning: RowMeaning) -> bool:
    """Whether the rows clearly mean something else, which the saved arm would have to share."""
    if meaning.best.is_plain:
        return False
    best = replace(meaning.best, inverse=False)
    is_small = best.only_zeros and bool(np.abs(best.zero).max() < SMALL_ZERO)
    return meaning.is_found and not best.is_plain and not is_small


def as_read(
    robot: Robot,
    data: Dataset,
    how: str = "auto",
    *,
    exclude: Mapping[int, str] | None = None,
    keeps_arm: bool = False,
    notes_rival: bool = False,
) -> tuple[Robot, Dataset]:
    """An arm and its rows in the reading that is clearly theirs, with a note on it.

    Units and conventions that a heading leaves open are applied. Signs, zeros, couplings, order, and
    another arm end with a sentence and its remedy, since a saved arm must count its joints as the
    controller does: where the reading is accepted the arm counts so, or the rows are changed and say it.

    Args:
        how: `found`: a reading beyond units and conventions is accepted; `given`: none at all; else the name
            of the one that is accepted of several that fit alike.
        exclude: Numbers of rows that are kept out, with the reason.
        keeps_arm: Whether the rows are changed in any case.
        notes_rival: Whether rows of another built-in arm are noted and taken, as where nothing is fitted.

    Raises:
        DataError: another reading is clearly better and `how` doesn't accept it, or the rows are of no such
        arm.
        UnitError: the file lacks units, and the rows don't tell them.
    """
    out = exclude or {}
    data = data.kept_out({k: out[row] for k, row in enumerate(data.row.tolist()) if row in out})
    if how == "given" or data.readings is not None:
        return robot, data.said
    arm, rows = _as_read(robot, data, how, keeps_arm, notes_rival)
    return arm, with_holding_torques(arm, _with_orientation(arm, rows))


@lru_cache(maxsize=2)
def _meaning(robot: Robot, data: Dataset) -> RowMeaning | None:
    """What rows mean, kept: what fits, what judges the fit, and the page ask it of the same ones."""
    meaning = read_rows(robot, data)
    return meaning if meaning is None or data.missing_units else told_by_column(robot, data, meaning)


def understood(robot: Robot, data: Dataset) -> tuple[Dataset, RowMeaning | None]:
    """Rows without those that a column tells not to fit, with a note, and their meaning as of `read_rows`."""
    meaning = _meaning(robot, data)
    if meaning is None or meaning.kept is None:
        return data, meaning
    lost = np.flatnonzero(data.included & ~np.isin(data.row, meaning.kept)).tolist()
    kept = data.kept_out(dict.fromkeys(lost, "is told by a column not to fit"))
    return understood(robot, _with_notes(kept, f"{plural(len(lost), 'row')} left out: {meaning.parts}"))


def _as_read(
    robot: Robot, data: Dataset, how: str, keeps_arm: bool, notes_rival: bool
) -> tuple[Robot, Dataset]:
    data, meaning = understood(robot, with_wires(robot, with_planes(robot, without_still_turns(robot, data))))
    if data.missing_units:
        return _as_read(robot, _with_units(robot, data, meaning), how, keeps_arm, notes_rival)
    if how not in {"auto", "found"} and not (meaning is not None and is_misread(meaning)):
        known = "'auto', 'found' or 'given', as these rows mean one thing"
        raise OptionError(f"reading must be {known}, got '{how}'", option="reading", found=how)
    if meaning is None and data.position is not None and data.session is not None:
        few = f"no session has {MIN_ROWS} rows with a position: what they mean was not checked"
        return robot, _with_notes(data, few)
    if meaning is None or (data.joints != robot.dof and not meaning.is_found):
        return robot, data
    if is_misread(meaning):
        sentence = f"{misread_text(meaning, robot)}; {remedy(meaning)}"
        if meaning.best.other and notes_rival:
            return robot, _with_notes(data, sentence)
        if meaning.best.other or (accepted := meaning.choices.get(how)) is None:
            raise DataError(f"{data.source}: {sentence}")
        arm = None if keeps_arm else accepted.on(robot)
        sentence = misread_text(replace(meaning, best=accepted), robot)
        note = f"{'read so' if arm in (None, robot) else 'the arm counts so'}: {sentence}"
        return arm or robot, _read_as(accepted.apply(data, joints=arm is None), note)
    if data.joints != robot.dof:
        return _as_read(robot, with_own_columns(robot, data), how, keeps_arm, notes_rival)
    data, plain = oriented(data, meaning), meaning.turned or meaning.plain
    if plain is None or plain.position > FOREIGN_MISFIT * robot.reach:
        unread = "".join(f"; {note}" for note in data.notes if note.startswith("columns left out"))
        raise DataError(f"{data.source}: {misread_text(meaning)}; {remedy(meaning)}{unread}")
    if not meaning.is_found:
        return robot, _with_notes(data, unexplained_text(meaning), *[meaning.remedy] * bool(meaning.parts))
    notes, off, some = _unconfirmed(data), plain.position, usable(data) if meaning.tried else None
    if some is not None and (rival := other_arm(robot, some, off / CLEAR)) is not None:
        found = f"{rival.robot.name} fits to {in_mm(rival.position)} with the best base and tool, this arm"
        notes += (f"{found} to {in_mm(off)}; choose the robot '{rival.other}' if it was measured",)
    return robot, _with_notes(data, *notes)


def with_own_columns(robot: Robot, data: Dataset) -> Dataset:
    """The rows without the columns that move no joint of the arm, as of a jaw, where rows tell which.

    Raises:
        DataError: the others are in another order.
    """
    if data.joints <= robot.dof or (meaning := understood(robot, data)[1]) is None:
        return data
    best = meaning.best
    if not meaning.is_found or best.other or data.missing_units:
        return data
    if is_misread(meaning):
        raise DataError(f"{data.source}: {misread_text(meaning)}; correct the file")
    rows = replace(replace(RowReading.plain(robot), w=best.w).apply(data), written=data.written)
    units = data.joint_units and tuple(data.joint_units[k] for k in best.w.argmax(1))
    left = ", ".join(f"q{k + 1}" for k in np.flatnonzero(~best.w.any(axis=0)))
    note = f"{left} moves no joint of this arm and is left out: {best.size}"
    return _read_as(replace(rows, joint_units=units), note)


def oriented(data: Dataset, meaning: RowMeaning) -> Dataset:
    """The rows with the orientations, or poses, that are clearly theirs, which a heading leaves open."""
    found, plain = meaning.turned, meaning.plain
    if found is None or plain is None:
        return data
    note = f"{found.text}: {found.size} instead of {plain.size} as the heading says; read so"
    return _read_as(found.apply(data), note)


def _with_orientation(robot: Robot, data: Dataset) -> Dataset:
    """The rows with the orientation that three columns of angles clearly are, which nobody names."""
    if data.written is None or data.rotation is not None or data.joints != robot.dof:
        return data
    turned = replace(data, rotation=se3.rotvec_to_matrix(data.written.numbers))  # or as the rows tell
    if (rows := usable(turned)) is None or rows.rotation is None:
        return data
    search = ReadingSearch(robot, rows)
    (found,) = search.place([RowReading.plain(robot)])
    if not (found.is_plain and search.suffices(found)):
        return data
    return _read_as(found.apply(turned), f"angles left out: {found.orientation}, {found.size}; read so")


def _with_units(robot: Robot, data: Dataset, meaning: RowMeaning | None) -> Dataset:
    """Rows of a file that lacks units, in those that the rows tell; refused if they tell none."""
    slides = [f"q{k + 1}" for k in sliding_numbers(robot)]
    if meaning is None or slides:
        wanted = f"rad or deg, m or mm for {', '.join(slides)}" if slides else "rad or deg"
        text = data.missing_units.replace("rad or deg", wanted)
        text = re.sub(r"\[(deg|rad)\]", "[mm]", text) if "q1" in slides and "q1[" in text else text
        raise UnitError(text, unit="")
    if not meaning.is_found or meaning.best.other:
        tried = "" if meaning.is_found else f"; the rows tell none: the nearest leaves {meaning.best.size}"
        raise UnitError(f"{data.missing_units}{tried}", unit="")
    best = meaning.best
    units = replace(RowReading.plain(robot), unit=best.unit, scale=best.scale)
    rows = replace(units.apply(data, joints=False), written=data.written, missing_units="")
    found = "; ".join([f"units that the file lacks are told by the rows: {best.size}", *units.changes])
    return _read_as(rows, found)


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


def misread_text(meaning: RowMeaning, robot: Robot | None = None) -> str:
    """`joint 3 = q3 + q2: 0.03 mm instead of 220 mm as given (next best 7 458 times worse)`."""
    best, plain = meaning.best, meaning.plain
    if not is_misread(meaning):
        return unexplained_text(meaning)
    given = "" if plain is None else f" instead of {plain.size} as given"
    other = f" (next best {meaning.margin:.3g} times worse)" if meaning.margin < 1e6 else ""
    equal = [name for name, r in meaning.choices.items() if meaning.equal and r is not best]
    if others := equal or meaning.blind[:2]:
        other = f"; or else {', or '.join(others)}: these rows can't tell"
    bare = " without the arm's effects" if robot is not None and robot.effects and not best.other else ""
    return f"{best.text}: {best.size}{bare}{given}{other}"


def unexplained_text(meaning: RowMeaning) -> str:
    """What was tried in full, and how near the nearest came."""
    given = meaning.turned or meaning.plain
    said = f"the nominal arm is {given.size} off with the best base and tool" if given else "no reading fits"
    if not meaning.tried:
        return said
    if meaning.parts or meaning.constant:
        return f"{said}; {meaning.parts or meaning.constant}"
    tried = ", ".join(f"{number} {family}" for family, number in meaning.tried.items())
    return f"{said}; tried in full: {tried}; the nearest leaves {meaning.best.size}"


def remedy(meaning: RowMeaning) -> str:
    """What to do where rows mean something else."""
    if meaning.parts:
        return meaning.remedy
    if not meaning.is_found:
        return "choose the robot that was measured, or correct its table"
    if meaning.best.other:
        anyway = at_entrance("--force to continue anyway", page="'Identify anyway'")
        return f"choose the robot '{meaning.best.other}', or {anyway}"
    names = " or ".join(f"'{name}'" for name in meaning.choices)
    accepted = at_entrance(f"with reading={names} (--reading)", page="by 'Read so'")
    if meaning.equal:
        return f"jog the arm to see which is true, and accept it {accepted}"
    return f"accept it {accepted}, or correct the file"
