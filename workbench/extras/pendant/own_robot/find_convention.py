"""The reading of a robot's table that reproduces the poses shown on its pendant.

The pendant shows the flange in the robot's base, so that three full poses tell units, signs, zeros and
couplings of the joints, and whether the table is standard or modified DH.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from workbench.arm.built_in_arms import load_robot
from workbench.arm.frame import Frame
from workbench.arm.robot import Robot
from workbench.base.arguments import checked_arguments
from workbench.base.errors import DataError, FileError, OptionError, ShapeError
from workbench.base.types import Freedom
from workbench.base.wording import in_mm
from workbench.data.dataset import Dataset
from workbench.data.readers.read import read_measurements
from workbench.extras.pendant.convention import SET
from workbench.extras.pendant.displayed import Displayed, of_dataset, read_display, typed
from workbench.extras.pendant.own_robot.table_meanings import TableReading, read_joint_table, table_readings
from workbench.identification.meaning.meaning import RowMeaning
from workbench.identification.meaning.read_rows import HELD_ROWS, read_any
from workbench.identification.meaning.reading import RowReading
from workbench.identification.meaning.usable_rows import MIN_ROWS, usable

MAX_ERROR = (0.005, float(np.deg2rad(0.5)))
"""Maximum error of a reading that fits: position, as a share of the arm's reach, and angle [rad]."""
HARDLY = float(np.deg2rad(5.0))
"""Range below which a joint hardly moves [rad]."""
UNKNOWN = Frame(free=Freedom.AUTO)
CHECK = "check every number, and that the pendant shows the flange (no tool) in the base (no user frame)"
CHECK_ROWS = "check the table, and that its arm was measured"


@dataclass(frozen=True, eq=False, kw_only=True)
class FoundConvention:
    """A reading that fits.

    Args:
        robot: The arm, whose joints count as the rows do; a later measurement decides on base and tool.
        reading: Of table and numbers, and how well it fits.
        assumptions: What was assumed of table and numbers.
        tried: Number of readings.
        changes: What differs from the arm as it was given.
        notes: What fits, what differs, how well, and what else would, one sentence each.
    """

    robot: Robot
    reading: RowReading
    assumptions: tuple[str, ...]
    tried: int
    changes: tuple[str, ...]
    notes: tuple[str, ...]


@checked_arguments()
def find_convention(readings: Sequence[TableReading], poses: Displayed | Dataset) -> FoundConvention:
    """The interpretation of a table that reproduces given poses, or fits rows that were measured elsewhere.

    Args:
        readings: What the table may mean; the likeliest first (`table_readings`).
        poses: Three or more of the flange in the base, in numbers as they are shown or in SI; or six rows or
            more of points, markers or poses of any tool in any frame.

    Raises:
        ShapeError: fewer of them, or another number of joints than the table has.
        DataError: no reading fits, or several do and differ elsewhere; says which, and what would decide.
    """
    if not readings:
        raise OptionError("no table to compare; give at least one reading of it")
    first = readings[0].robot
    shown = of_dataset(poses, first) if isinstance(poses, Dataset) and poses.rotation is not None else poses
    data = shown.dataset(first) if isinstance(shown, Displayed) else shown
    rows, is_posed = usable(data), data.rotation is not None
    least = HELD_ROWS if is_posed else MIN_ROWS
    if len(data) < least or (rows is None and not is_posed):
        text = f"at least {least} poses are needed, got {len(data)}; move every joint between"
        raise ShapeError(text, expected=least, found=len(data))
    first.check_joints(data.q, "the typed poses")
    arms = [reading.robot for reading in readings]
    found = None if rows is None else _read_anywhere(arms, rows)
    held = found is None or (is_posed and _is_in_base(found.best))
    if held:
        known = read_any(arms, data, held=True)
        held = found is None or _fits_typed(known.best)
        found = known if held else found
    assert found is not None
    best, of = found.best, {id(reading.robot.elements): reading for reading in readings}
    table, tried = of[id(best.robot.elements)], sum(found.tried.values())
    shows = shown.meaning(first, best).assumptions if isinstance(shown, Displayed) else ()
    assumed = (*table.assumptions, *filter(None, shows))
    where = "the typed poses" if held else f"{len(data)} rows of unknown base and tool"
    if held:
        _check_slip(best, data, ", ".join(assumed))
    if not (_fits_typed(best) if held else best.fits):
        raise DataError(
            f"none of {tried} readings of the table fits {where}; the nearest is {best.size} off "
            f"({', '.join(assumed)}); {CHECK if held else CHECK_ROWS}"
        )
    same = (r for r in found.open if of[id(r.robot.elements)] is table)
    says_more = [r for r in same if {*best.changes} < {*r.changes}]
    still = np.flatnonzero(np.ptp(best.in_units(data.q), axis=0) < HARDLY).tolist()
    if len(found.open) > (0 if held else len(says_more)) or (still and not held):
        rest = f"; hardly moved: joint {', '.join(str(k + 1) for k in still)}" if still else ""
        every = (", ".join((*of[id(r.robot.elements)].assumptions[:1], r.text)) for r in (best, *found.open))
        ways = [*dict.fromkeys(every)]
        raise DataError(
            f"{where} leave open how joints count: {'; or '.join(ways[:3])}{rest}; add poses with every "
            "joint moved by 30° or more"
        )
    robot = table.robot if found.equal else best.on(table.robot)
    if robot is None:
        raise DataError(f"'{first.name}' can't count so: {best.text}; give its table")
    either = f"{', or '.join(found.choices)}: these rows can't tell, 'identify' asks"
    changes = (either,) if found.equal else best.changes
    name, margin = "", found.margin
    for r in says_more[:1]:
        name, margin = f", {next(c for c in r.changes if c not in best.changes)},", r.score / best.score
    other = f" (next best{name} {margin:.3g} times worse)" if margin < 1e6 else ""
    return FoundConvention(
        robot=robot.with_frames(base=UNKNOWN, tool=UNKNOWN),
        reading=best,
        assumptions=assumed,
        tried=tried,
        changes=changes,
        notes=(
            f"it fits: {', '.join(assumed) or 'as it was given'}",
            *(f"change: {change}" for change in changes),
            f"errors at {where}: {best.size}{other}; {tried} readings tried",
        ),
    )


def _read_anywhere(arms: Sequence[Robot], rows: Dataset) -> RowMeaning:
    """What rows mean with base and tool free: without orientations that fit in no way while the points do."""
    found = read_any(arms, rows, held=False)
    if found.best.fits or rows.rotation is None:
        return found
    alone = read_any(arms, replace(rows, rotation=None, written=None), held=False)
    return alone if alone.best.fits and not alone.open else found


def _is_in_base(reading: RowReading) -> bool:
    """Whether poses may be of the flange in the base, where a reading puts both."""
    away = np.linalg.norm([reading.base[:3, 3], reading.tool[:3, 3]], axis=1)
    return reading.fits and bool(away.max() < SET * reading.robot.reach)


def _fits_typed(reading: RowReading) -> bool:
    return reading.position < MAX_ERROR[0] * reading.robot.reach and reading.rotation < MAX_ERROR[1]


def _check_slip(best: RowReading, data: Dataset, assumed: str) -> None:
    """Raise where a reading gives all typed poses but one."""
    if best.apart and _fits_typed(best):
        row, position = best.apart[0], np.asarray(data.position)
        off = float(np.linalg.norm(best.flange(data.q)[row, :3, 3] - position[row]))
        others = f"the others fit to {in_mm(best.position)} with {assumed}"
        raise DataError(f"pose {row + 1} alone is {in_mm(off)} off, {others}: check its numbers")


def read_poses(path: Path, robot: Robot, *, columns: str | None = None) -> Displayed | Dataset:
    """Poses of a table as a pendant shows them, or measured points or markers."""
    try:
        return read_display(path, robot, columns=columns)
    except FileError:
        rows = read_measurements(path, joints=robot.joint_names, columns=columns)
        if rows.rotation is not None or (rows.position is None and rows.markers is None):
            raise
        return rows


def readings_of(source: Path | str, *, tip: str | None = None) -> list[TableReading]:
    """What a file or a built-in arm may mean: a table in several ways, everything else in one."""
    path = Path(source)
    if path.suffix.lower() in ("", ".toml", ".urdf", ".xml", ".xacro"):
        return [TableReading(load_robot(source, tip=tip).bare)]
    return table_readings(**read_joint_table(path)._asdict(), name=path.stem)


def robot_that_gives(source: Path | str, poses: Sequence[str]) -> Robot:
    """The arm that gives typed poses, or the one that a table can only be; what was found is in its notes."""
    if not poses:
        read, *others = readings_of(source)
        if others:
            ways = "; or ".join(", ".join(one.assumptions) for one in (read, *others))
            raise OptionError(f"the table may be {ways}: say its convention, or type three poses")
        notes = (*read.robot.notes, f"it fits: {', '.join(read.assumptions)}")
        return replace(read.robot.with_frames(base=UNKNOWN, tool=UNKNOWN), notes=notes)
    readings = readings_of(source)
    found = find_convention(readings, typed(poses, readings[0].robot.dof))
    return replace(found.robot, notes=(*found.robot.notes, *found.notes))
