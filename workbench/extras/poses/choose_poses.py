"""Informative poses as one call, with output as a table, as JSON, and as a file for measuring."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from workbench.arm.joint_units import shown_joints, shown_units, sliding_numbers
from workbench.arm.robot import Robot
from workbench.base.arguments import Count, Seed, checked_arguments
from workbench.base.threads import one_thread
from workbench.base.wording import plural
from workbench.data.arguments import RobotLike
from workbench.data.dataset import Dataset
from workbench.data.readers import AS_HEADED
from workbench.data.readers.assemble import assemble, joint_columns
from workbench.data.readers.read import read_fields
from workbench.data.writer import write_measurements
from workbench.extras.poses.informative_poses import PoseSet, informative_poses
from workbench.extras.poses.pose_limits import PoseLimits
from workbench.identification.meaning.as_read import with_units
from workbench.plate.free_constants import identified_names
from workbench.report.blocks import Block, ResultTable, Sentence
from workbench.report.json import Json, document


@checked_arguments()
@one_thread()
def choose_poses(
    robot: RobotLike,
    number: Count,
    *,
    index: str = "O1",
    candidates: Path | None = None,
    limits: PoseLimits | None = None,
    base: bool | None = None,
    tool: bool | None = None,
    seed: Seed = 0,
) -> PoseSet:
    """Joint positions with a large observability index.

    Args:
        robot: Nominal arm with limits.
        number: Number of poses.
        index: `O` (ARIA eqs. 17, 18, pose by pose), `O1` … `O5` of the whole set, or `I`: the
            predicted error in the limits' region.
        candidates: A file of measurements or joint rows to choose from.
        limits: Region and room.
        base: Whether the base is unknown and identified too; as the robot says if None.
        tool: Whether the tool is.
        seed: Of the random starts.

    Raises:
        DataError: fewer candidates than poses, or limits that conflict.
        OptionError: no such index.
    """
    rows = None if candidates is None else _joints_in(candidates, robot)
    return informative_poses(
        robot,
        number,
        index=index,
        candidates=rows,
        names=identified_names(robot, base=base, tool=tool),
        limits=limits,
        rng=np.random.default_rng(seed),
    )


def _joints_in(path: Path, robot: Robot) -> np.ndarray:
    """Whole joint positions of a file, in units that its measurements tell where it lacks them."""
    fields = read_fields(path, columns=AS_HEADED, joints=robot)
    if fields.missing_units:
        q = with_units(robot, assemble(fields, joints=robot)).q
    else:
        q = joint_columns(fields, robot)
    return q[np.isfinite(q).all(1)]


def write_poses(robot: Robot, poses: PoseSet, path: Path | str) -> Path:
    """Write joint positions as a table with units, ready to be measured at."""
    rows = Dataset(q=poses.q, row=np.arange(len(poses.q)))
    return write_measurements(rows, path, prismatic=sliding_numbers(robot))


def poses_blocks(robot: Robot, poses: PoseSet) -> Iterator[Block]:
    """The index before and after, and every pose in degrees or millimetres."""
    heads = (f"q{k + 1} [{unit.strip()}]" for k, unit in enumerate(shown_units(robot)))
    rows = [(str(k), *(f"{v:.1f}" for v in q)) for k, q in enumerate(shown_joints(robot, poses.q), 1)]
    yield ResultTable(f"{plural(len(poses.q), 'pose')} for {robot.name}", ("pose", *heads), rows)
    yield Sentence(f"index {poses.index}: {poses.before:.4g} for a random start, {poses.after:.4g} for these")


def poses_json(robot: Robot, poses: PoseSet) -> Json:
    return document(
        "workbench.poses/1",
        robot=robot.name,
        index={"name": poses.index, "before": poses.before, "after": poses.after},
        outcome=poses.outcome,
        poses=poses.q,
    )
