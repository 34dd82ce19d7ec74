"""The reading of a robot's table that reproduces the poses shown on its pendant.

The pendant shows the flange in the robot's base, so that three full poses tell units, signs, zeros and
couplings of the joints, and whether the table is standard or modified DH.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from workbench.arm.built_in_arms import load_robot
from workbench.arm.frame import Frame
from workbench.arm.robot import Robot
from workbench.base.arguments import checked_arguments
from workbench.base.errors import DataError, FileError, OptionError, ShapeError
from workbench.base.hand_eye import nearest_rotation
from workbench.base.remedy import remedy
from workbench.base.types import Freedom
from workbench.base.wording import first_of, in_mm
from workbench.data.dataset import Dataset
from workbench.data.readers.read import read_measurements
from workbench.extras.pendant.convention import SET
from workbench.extras.pendant.displayed import Displayed, read_display
from workbench.extras.pendant.own_robot.table_meanings import TableReading, read_joint_table, table_readings
from workbench.identification.meaning.meaning import RowMeaning, same_motion
from workbench.identification.meaning.read_rows import HELD_ROWS, read_any
from workbench.identification.meaning.reading import RowReading
from workbench.identification.meaning.search import FEW_POINTS
from workbench.identification.meaning.unexplained import FAR, one_constant
from workbench.identification.meaning.usable_rows import MIN_ROWS, usable

MAX_ERROR = (0.005, float(np.deg2rad(0.5)))
"""Maximum error of a reading that fits: position, as a share of the arm's reach, and angle [rad]."""
HARDLY = float(np.deg2rad(5.0))
"""Range below which a joint hardly moves [rad]."""
AS_WELL = 1.1
"""Ratio of errors below which another reading is as likely."""
UNKNOWN = Frame(free=Freedom.AUTO)
CHECK = "check every number, and that the pendant shows the flange (no tool) in the base (no user frame)"
CHECK_ROWS = "check the table, and that its arm was measured"
MORE = "add poses with every joint moved by 30° or more"


@dataclass(frozen=True, eq=False, kw_only=True)
class FoundConvention:
    """A reading that fits.

    Args:
        robot: The arm, whose joints count as the rows do; a later measurement decides on base and tool.
        reading: Of table and numbers, and how well it fits.
        assumptions: What was assumed of table and numbers.
        changes: What differs from the arm as it was given.
        notes: What fits, what differs, how well, and what else would, one sentence each.
        doubt: Which other reading fits as well; empty if none does.
    """

    robot: Robot
    reading: RowReading
    assumptions: tuple[str, ...]
    tried: int
    changes: tuple[str, ...]
    notes: tuple[str, ...]
    doubt: str = ""


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
    shown = read_display(poses, first) if isinstance(poses, Dataset) and poses.rotation is not None else poses
    data = shown.data if isinstance(shown, Displayed) else shown
    least, data = MIN_ROWS if data.rotation is None else HELD_ROWS, _posed(data)
    rows = usable(data)
    if len(data) < least or (rows is None and data.rotation is None):
        text = f"at least {least} poses are needed that show one point, got {len(data)}"
        raise ShapeError(f"{text}; move every joint between", expected=least, found=len(data))
    first.check_joints(data.q, data.source)
    found, held = _meaning([reading.robot for reading in readings], data, rows)
    best, table = found.best, _table_of(found.best, readings)
    where = "the typed poses" if held else f"{len(data)} rows of unknown base and tool"
    seen = data if rows is None or data.position is not None else rows
    placed = (best.base @ best.flange(seen.q) @ best.tool)[:, :3, 3]
    error = np.linalg.norm(placed - best.apply(seen, joints=False).position, axis=1)
    far = (error > max(MAX_ERROR[0] * best.robot.reach, FAR * best.position)) & seen.included & (not held)
    worst, which = in_mm(float(np.nanmax(error))), f"{first_of(seen.row[far], 10)} ({data.counted})"
    shows = shown.meaning(best).assumptions if isinstance(shown, Displayed) else ()
    assumed, tried = (*table.assumptions, *filter(None, shows)), sum(found.tried.values())
    said = ", ".join(assumed)
    if held and best.apart and _fits_typed(best):
        alone = f"pose {best.apart[0] + 1} alone is {in_mm(error[best.apart[0]])} off, the others fit to "
        raise DataError(f"{alone}{in_mm(best.position)} with {said}: check its numbers")
    is_near, is_exact = _fits_typed(best), held or (len(data) < FEW_POINTS and best.convention is not None)
    wrong = {} if is_near or rows is None else one_constant(first, rows, replace(found, turned=best))
    if wrong or not (is_near if is_exact else best.fits):
        cure = CHECK if held else CHECK_ROWS + f", or give {FEW_POINTS} poses of a rough arm" * is_exact
        nearest = f"the nearest is {best.size} off ({said}); {wrong.get('told', cure)}"
        raise DataError(f"none of {tried} readings of the table fits {where}; {nearest}")
    if either := _left_open(found, readings, data.q, held=held):
        raise DataError(f"{where} leave open how joints count: {either}; {MORE}")
    robot, changes = best.on(table.robot), best.changes
    if found.equal:
        robot = table.robot
        changes = (f"{', or '.join(found.choices)}: these rows can't tell, an identification asks",)
    if robot is None:
        raise DataError(f"'{first.name}' can't count so: {best.text}; give its table")
    other = f" (next best {found.margin:.3g} times worse)" if found.margin < 1e6 else ""
    low, high = data.q.min(0) - 1.0 / best.unit, data.q.max(0) + 1.0 / best.unit
    q, (off, turned) = np.random.default_rng(0).uniform(low, high, (24, len(low))), MAX_ERROR
    same = partial(same_motion, best, q=q, off=2.0 * off, turned=2.0 * turned)
    alike = [r for r in found.open if r.score < AS_WELL * best.score and not same(r)][:1]
    ways = " and ".join(f"{', '.join(_way(r, readings))} ({r.size})" for r in (best, *alike))
    return FoundConvention(
        robot=robot.with_frames(base=UNKNOWN, tool=UNKNOWN),
        reading=best,
        assumptions=assumed,
        tried=tried,
        changes=changes,
        doubt=f"{ways} fit alike; {MORE}, or of a point farther off the last axis" if alike else "",
        notes=(
            f"{'it fits' if is_near else 'the nearest'}: {said or 'as it was given'}",
            *(f"{'left open' if found.equal else 'change'}: {change}" for change in changes),
            f"errors at {where}: {best.size}{other}; {tried} readings tried",
            *[f"rows {which} don't count, off by up to {worst}: correct them"] * bool(far.any()),
        ),
    )


def _posed(data: Dataset) -> Dataset:
    """Rows that show three markers or more as full poses of these, which tell more than a point."""
    if data.markers is None or data.position is not None:
        return data
    rows = data.take(np.isfinite(data.markers).all((1, 2)) & data.included)
    middle = np.asarray(rows.markers).mean(1)
    apart = np.asarray(rows.markers) - middle[:, None]
    if len(rows) < MIN_ROWS or np.linalg.matrix_rank(apart[0], tol=1e-3) < 2:  # on one line, to 1 mm
        return data
    turns = nearest_rotation(np.einsum("rmi,mj->rij", apart, apart[0]))
    return replace(rows, position=middle, rotation=turns, markers=None)


def _meaning(arms: Sequence[Robot], data: Dataset, rows: Dataset | None) -> tuple[RowMeaning, bool]:
    """What poses mean, and whether they are of the flange in the base; else base and tool are free, and
    orientations that fit in no way while the points do are left out."""
    if rows is not None:
        found = read_any(arms, rows, held=False)
        away = np.linalg.norm([found.best.base[:3, 3], found.best.tool[:3, 3]], axis=1).max()
        if data.rotation is not None and not found.best.fits:
            alone = read_any(arms, replace(rows, rotation=None, written=None), held=False)
            return (alone if alone.best.fits and not alone.open else found), False
        if data.rotation is None or away > SET * found.best.robot.reach:
            return found, False
    known = read_any(arms, data, held=True)
    return (known, True) if rows is None or _fits_typed(known.best) else (found, False)


def _table_of(reading: RowReading, readings: Sequence[TableReading]) -> TableReading:
    return next(table for table in readings if table.robot.elements is reading.robot.elements)


def _way(reading: RowReading, readings: Sequence[TableReading]) -> tuple[str, ...]:
    return *_table_of(reading, readings).assumptions[:1], reading.text


def _left_open(found: RowMeaning, readings: Sequence[TableReading], q: np.ndarray, *, held: bool) -> str:
    """What the rows can't tell; where they are many and measured, not what only says more of one table."""
    best = found.best
    same = (r for r in found.open if not held and r.robot.elements is best.robot.elements)
    says_more = [r for r in same if {*best.changes} < {*r.changes}]
    still = np.flatnonzero(np.ptp(best.in_units(q), axis=0) < HARDLY)
    if len(found.open) == len(says_more) and (held or not still.size):
        return ""
    every = (_way(r, readings) for r in (best, *found.open))
    ways = "; or ".join([*dict.fromkeys(map(", ".join, every))][:3])
    return f"{ways}; hardly moved: joint {', '.join(str(k + 1) for k in still)}" if still.size else ways


def _fits_typed(reading: RowReading) -> bool:
    return reading.position < MAX_ERROR[0] * reading.robot.reach and not reading.rotation >= MAX_ERROR[1]


def read_poses(
    source: Path | Sequence[str], robot: Robot, *, columns: str | None = None
) -> Displayed | Dataset:
    """Poses, typed or of a table, as a pendant shows them, or measured points or markers."""
    try:
        return read_display(source, robot, columns=columns)
    except FileError:
        rows = read_measurements(source, joints=robot, columns=columns)
        if rows.rotation is not None or (rows.position is None and rows.markers is None):
            raise
        return rows


def readings_of(source: Path | str, *, tip: str | None = None) -> list[TableReading]:
    """What a file or a built-in arm may mean: a table in several ways, everything else in one."""
    path = Path(source)
    if path.suffix.lower() in ("", ".toml", ".urdf", ".xml", ".xacro"):
        return [TableReading(load_robot(source, tip=tip).bare)]
    return table_readings(**read_joint_table(path)._asdict(), name=path.stem)


def robot_that_gives(source: Path | str, poses: Sequence[str] | Path) -> Robot:
    """The arm that gives typed poses or rows of a file, or the one that a table can only be, with notes."""
    readings = readings_of(source)
    ways = [", ".join(one.assumptions) for one in readings]
    robot, notes = readings[0].robot.with_frames(base=UNKNOWN, tool=UNKNOWN), [f"it fits: {ways[0]}"]
    if poses:
        found = find_convention(readings, read_poses(poses, robot))
        robot, notes = found.robot, [*found.notes, *filter(None, [found.doubt])]
    elif ways[1:]:
        page = "choose where it stands now, 'Your own robot' or '… or its DH table'; or give poses there"
        cure = remedy("say its convention, or give poses", page=page)
        raise OptionError(f"the table may be {'; or '.join(ways)}: {cure}")
    return replace(robot, notes=(*robot.notes, *notes))
