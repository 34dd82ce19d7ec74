"""What a pendant's numbers mean, found from the arm, and how exactly they are known."""

from dataclasses import replace

import numpy as np

from workbench.arm.frame import Frame
from workbench.arm.joint_units import sliding
from workbench.arm.kinematics.forward import geometric_jacobian
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.types import Freedom
from workbench.data.dataset import Dataset
from workbench.data.orientations import ORIENTATIONS
from workbench.extras.pendant.displayed import SIZES, Displayed
from workbench.identification.meaning.read_rows import read_rows
from workbench.identification.meaning.reading import FITS_TURN, FOREIGN_MISFIT, RowReading
from workbench.identification.meaning.search import CLEAR, EXACT, ReadingSearch
from workbench.identification.meaning.usable_rows import MIN_ROWS, usable

TURNED = float(np.deg2rad(3.0))
"""Rotation from which on a frame is set [rad]."""
KEPT = float(np.deg2rad(0.1))
"""Angle [rad] below which a tool keeps its orientation, so that the convention changes its tool alone."""
SET = 0.045
"""Share of the reach from which on a frame is set."""
UNIFORM = 1.0 / np.sqrt(12.0)
"""Standard deviation of rounding, in steps."""
EXACT_SIGMA = (1e-7, 1e-7)
"""Standard deviations of numbers that are exact [m], [rad]."""
MAX_DECIMALS = 7
"""Decimals of joint positions that may be all that were shown."""
COMMANDED = 0.5
"""Joint positions that are all whole multiples of this many degrees were commanded, not rounded."""


def reading_of_display(robot: Robot, shown: Displayed, how: str = "auto") -> RowReading:
    """The reading under which what is shown is this arm's; `how` as of `FitChoices.reading`.

    Raises:
        DataError: too few poses, no reading fits, several do, or the poses are of another arm.
    """
    if len(shown.data) < MIN_ROWS:
        few = f"{len(shown.data)} poses do not determine the convention; read at least {MIN_ROWS}"
        raise DataError(f"{shown.data.source}: {few}, and about 30 to extract the model")
    found = read_rows(robot, shown.data)
    assert found is not None
    best, given, far = found.best, found.given, FOREIGN_MISFIT * robot.reach
    if best.convention is None and not best.other:
        raise DataError(f"{shown.data.source}: the orientation stays the same while the joints turn the tool")
    is_given = how == "given" or not found.is_found
    if given and is_given and given.rotation < FITS_TURN and given.position < far:
        return _in_convention(robot, shown, given)  # an arm may differ from its table by as much
    if found.is_found and best.other:
        text = f"these rows don't belong to {robot.name}; {best.robot.name} fits to {best.size}"
        raise DataError(f"{shown.data.source}: {text}: choose the robot '{best.other}'")
    is_other = (shown.is_told and best.unit != 1.0) or best.mirrored or best.on(robot) is None
    taken = found.accepted(how) if is_other else best
    if not found.is_found or taken is None:
        said = found if shown.is_told else replace(found, best=replace(best, unit=1.0))
        cure = "correct the file" if found.told else found.remedy
        raise DataError(f"{shown.data.source}: {said.text()}; {cure}")
    return _in_convention(robot, shown, taken)


def _in_convention(robot: Robot, shown: Displayed, reading: RowReading) -> RowReading:
    """The reading; where others fit alike with another tool in the convention that headings name.

    A tool that keeps its orientation fits in all, and can't be parted from the base: the likeliest is taken.
    """
    search = ReadingSearch(robot, data=usable(shown.data) or shown.data)
    turns = reading.flange(search.data.q)[:, :3, :3]
    turned = np.linalg.norm(se3.matrix_to_rotvec(turns @ turns[0].T), axis=1).max()
    bare = replace(reading, base=np.eye(4), tool=np.eye(4))
    ways = [replace(bare, convention=c, cost=c.cost) for c in search.conventions]
    if turned > KEPT:
        placed = search.aligned(ways)
        ways = [way for way in placed if way.score < CLEAR * min(w.score for w in placed) + EXACT]
        tools = se3.matrix_to_rotvec(np.array([w.tool[:3, :3].T @ reading.tool[:3, :3] for w in ways]))
        if np.linalg.norm(tools, axis=1).max() < TURNED:
            return reading
    ways.sort(key=lambda w: ((m := shown.meaning(w)).angles != m.joints, w.cost))  # angles as joints
    named = [kind.text for kind in ORIENTATIONS if kind.name == shown.named]
    told = [w for w in ways if w.convention and w.convention.name in named]
    if not told and turned > KEPT:
        names = ", or ".join(w.convention.name for w in ways[:2] if w.convention)
        way = f"the tool turns by {np.rad2deg(turned):.2g}° about one axis only, which fits in several"
        raise DataError(
            f"{shown.data.source}: {way} conventions, such as {names}: add poses with the tool turned about "
            "all axes, or name the angles in the headings (A, B, C; roll, pitch, yaw)"
        )
    return (told or ways)[0]


def with_displayed_frames(robot: Robot, reading: RowReading) -> Robot:
    """The nominal arm in the frame of the display; the rows decide on what may be there or not."""
    frames = {}
    for name, pose in (("base", reading.base), ("tool", reading.tool)):
        turn, way = np.linalg.norm(se3.matrix_to_rotvec(pose[:3, :3])), np.linalg.norm(pose[:3, 3])
        is_set = turn > TURNED or way > SET * robot.reach  # farther from none than production errors explain
        frames[name] = Frame.from_pose(pose, Freedom.FREE) if is_set else Frame(free=Freedom.AUTO)
    return robot.bare.with_frames(**frames)


def as_datasets(arm: Robot, robot: Robot, shown: Displayed, reading: RowReading) -> tuple[Dataset, Dataset]:
    """The poses of an arm that counts as they do, each with the standard deviation that rounding gives it;
    first with joints as written, and exact at whole degrees, as if they were commanded there."""
    joint, length, angle = (UNIFORM * step for step in shown.steps)
    written, convention, is_own = shown.data.written, reading.convention, arm is robot
    assert written is not None
    assert convention is not None
    data, at = reading.apply(shown.data, joints=is_own), convention.rotations(shown.data)
    degrees = np.rad2deg(data.q[:, ~sliding(robot)])
    known = np.zeros((len(data), 6))
    known[:, :3] = (reading.scale * length) ** 2
    for own, step in zip(angle.T, np.eye(angle.shape[1]) * 1e-6, strict=True):
        moved = replace(shown.data, written=written._replace(numbers=written.numbers + step))
        change = se3.matrix_to_rotvec(convention.rotations(moved) @ at.swapaxes(1, 2)) / 1e-6
        known[:, 3:] += (own[:, None] * change) ** 2
    counted = np.abs(reading.w.T if is_own else np.eye(joint.shape[1]))
    jacobian = geometric_jacobian(arm, data.q)
    sizes = SIZES[shown.units[0]] * 10.0 ** -np.arange(MAX_DECIMALS)
    shares = ((size, shown.data.q / size) for size in sizes)  # whole ones tell how many digits were shown
    step = next((size for size, n in shares if np.allclose(n, np.round(n), rtol=0, atol=1e-6)), 0.0)
    told = np.maximum(joint, UNIFORM * step)
    written, rounded = (
        known + ((jacobian * (reading.in_units(j) @ counted)[:, None]) ** 2).sum(2) for j in (joint, told)
    )
    is_whole = np.allclose(degrees, COMMANDED * np.round(degrees / COMMANDED), atol=1e-9)
    variances = np.maximum([known if is_whole else written, rounded], np.repeat(EXACT_SIGMA, 3) ** 2)
    first, second = (replace(data, sigma=s, read_as=reading.text) for s in np.sqrt(variances))
    return first, second
