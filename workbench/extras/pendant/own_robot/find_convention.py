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
from workbench.base.errors import DataError, OptionError, ShapeError
from workbench.base.types import Freedom
from workbench.base.wording import in_mm
from workbench.data.dataset import Dataset
from workbench.extras.pendant.displayed import Displayed, of_dataset, typed
from workbench.extras.pendant.own_robot.table_meanings import TableReading, read_joint_table, table_readings
from workbench.identification.meaning.meaning import RowMeaning
from workbench.identification.meaning.read_rows import HELD_ROWS, read_held
from workbench.identification.meaning.reading import RowReading

MAX_ERROR = (0.005, float(np.deg2rad(0.5)))
"""Maximum error of a reading that fits: position, as a share of the arm's reach, and angle [rad]."""
HARDLY = float(np.deg2rad(5.0))
"""Range below which a joint hardly moves [rad]."""
UNKNOWN = Frame(free=Freedom.AUTO)
CHECK = "check every number, and that the pendant shows the flange (no tool) in the base (no user frame)"


@dataclass(frozen=True, eq=False, kw_only=True)
class FoundConvention:
    """A reading that fits.

    Args:
        robot: The arm, whose joints count as the pendant does.
        reading: Of table and numbers, and how well it fits.
        assumptions: What was assumed of table and numbers.
        tried: Number of readings.
    """

    robot: Robot
    reading: RowReading
    assumptions: tuple[str, ...]
    tried: int

    @property
    def notes(self) -> tuple[str, ...]:
        """What fits, what differs from the arm as it was given, and how well, one sentence each."""
        return (
            f"it fits: {', '.join(self.assumptions) or 'as it was given'}",
            *(f"change: {change}" for change in self.reading.changes),
            f"errors at the typed poses: {self.reading.size}; {self.tried} readings tried",
        )


@checked_arguments()
def find_convention(readings: Sequence[TableReading], poses: Displayed | Dataset) -> FoundConvention:
    """The interpretation of a table that reproduces given poses.

    Args:
        readings: What the table may mean; the likeliest first (`table_readings`).
        poses: Three or more, in numbers as they are shown or in SI.

    Raises:
        ShapeError: fewer than three poses, or another number of joints than the table has.
        DataError: no reading fits, or several do and differ elsewhere; says which, and what would decide.
    """
    if not readings:
        raise OptionError("no table to compare; give at least one reading of it")
    first = readings[0].robot
    shown = of_dataset(poses, first) if isinstance(poses, Dataset) else poses
    if len(shown) < HELD_ROWS:
        text = f"at least {HELD_ROWS} poses are needed, got {len(shown)}; move every joint between"
        raise ShapeError(text, expected=HELD_ROWS, found=len(shown))
    first.check_joints(shown.joints, "the typed poses")
    data = shown.dataset(first)
    arms = [reading.robot.bare for reading in readings]
    found = read_held(arms, data)
    table = next(t for t, arm in zip(readings, arms, strict=True) if arm is found.best.robot)
    assumed = (*table.assumptions, *shown.meaning(first, found.best).assumptions)
    robot = _checked(found, data, ", ".join(assumed)).on(table.robot)
    if robot is None:
        raise DataError(f"'{first.name}' can't count so: {found.best.text}; give its table")
    tried = sum(found.tried.values())
    return FoundConvention(robot=robot, reading=found.best, assumptions=assumed, tried=tried)


def _checked(found: RowMeaning, data: Dataset, assumed: str) -> RowReading:
    """The best reading, if it fits all poses and no other does."""
    best = found.best
    fits = best.position < MAX_ERROR[0] * best.robot.reach and best.rotation < MAX_ERROR[1]
    if fits and best.apart:
        row, position = best.apart[0], np.asarray(data.position)
        off = float(np.linalg.norm(best.flange(data.q)[row, :3, 3] - position[row]))
        others = f"the others fit to {in_mm(best.position)} with {assumed}"
        raise DataError(f"pose {row + 1} alone is {in_mm(off)} off, {others}: check its numbers")
    if not fits:
        raise DataError(
            f"none of {sum(found.tried.values())} readings of the table fits the typed poses; the nearest is "
            f"{best.size} off ({assumed}); {CHECK}"
        )
    if found.open and (still := np.flatnonzero(np.ptp(best.in_units(data.q), axis=0) < HARDLY).tolist()):
        names = ", ".join(str(k + 1) for k in still)
        raise DataError(
            f"the poses leave open how joint {names} counts, as it hardly moves between them; add a pose "
            "with it moved by 30° or more"
        )
    if found.open:
        shown = "; or ".join((best.text, *found.open)[:3])
        raise DataError(
            f"{1 + len(found.open)} readings give the typed poses and differ elsewhere: {shown}; add another "
            "pose"
        )
    return best


def check_robot(
    source: Path | str, poses: Sequence[str] | Displayed | Dataset, *, tip: str | None = None
) -> FoundConvention:
    """The reading of an arm or its table that gives the poses of the pendant.

    Its base and tool are decided from the data: the pendant's are not those of a later measurement.

    Args:
        source: A joint table, a file of a robot, or a built-in arm by name.
        poses: `q1,…,qn = x,y,z,a,b,c` (or a quaternion) each, whose units are found; or rows.
        tip: Last link of the chain, for a URDF with several.
    """
    readings = readings_of(source, tip=tip)
    shown = poses if isinstance(poses, Displayed | Dataset) else typed(poses, readings[0].robot.dof)
    found = find_convention(readings, shown)
    return replace(found, robot=found.robot.with_frames(base=UNKNOWN, tool=UNKNOWN))


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
    found = check_robot(source, poses)
    return replace(found.robot, notes=(*found.robot.notes, *found.notes))
