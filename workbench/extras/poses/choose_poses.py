"""Informative poses as one call, with output as a table, as JSON, and as a file for measuring."""

from pathlib import Path

import numpy as np
from rich import box
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from workbench.arm.joint_units import shown_joints, shown_units, sliding
from workbench.arm.robot import Robot
from workbench.base.arguments import Seed, checked_arguments
from workbench.base.errors import DataError, OptionError
from workbench.base.files import write_text
from workbench.base.threads import one_thread
from workbench.base.wording import plural
from workbench.data.arguments import RobotLike
from workbench.data.readers import read_trajectory
from workbench.extras.poses.informative_poses import Method, PoseSet, informative_poses
from workbench.extras.poses.pose_limits import PoseLimits
from workbench.plate.free_constants import identified_names
from workbench.plate.region_poses import PLATE_POSES, region_poses
from workbench.report.json import Json, document


@checked_arguments()
@one_thread()
def choose_poses(
    robot: RobotLike,
    number: int,
    *,
    index: str = "O1",
    candidates: Path | None = None,
    limits: PoseLimits | None = None,
    method: Method | str = Method.EXCHANGE,
    base: bool | None = None,
    tool: bool | None = None,
    seed: Seed = 0,
) -> PoseSet:
    """Joint positions with a large observability index, in measuring order.

    Args:
        robot: Nominal arm with limits.
        number: Number of poses.
        index: `O` (ARIA eqs. 17, 18, pose by pose), `O1` … `O5`, `A`, `D` of the whole set, or `I`: the
            predicted error in the limits' region.
        candidates: A file of measurements or joint rows to choose from.
        limits: Region, orientation cone, room, spread and travel.
        method: `exchange`, or `greedy` for the greedy choice alone.
        base: Whether the base is unknown and identified too; as the robot says if None.
        tool: Whether the tool is.
        seed: Of the random starts.

    Raises:
        DataError: fewer candidates than poses, or limits that conflict.
        OptionError: no such index or method.
    """
    if method not in tuple(Method):
        raise OptionError(f"unknown method '{method}'; choose from {', '.join(Method)}")
    rows = None if candidates is None else read_trajectory(candidates, joints=robot.joint_names).q
    if candidates is not None and rows is None:
        raise DataError(f"{candidates}: has no joint columns (q1[rad] …) to choose poses from")
    if rows is not None and len(rows) < number:
        raise DataError(
            f"{candidates}: {plural(len(rows), 'row')}, but {number} poses are needed; give more rows"
        )
    evaluation_poses = None
    if index == "I" and limits is not None and limits.region is not None:
        region, towards, cone = limits.region, limits.towards, limits.cone
        rng = np.random.default_rng(0)
        evaluation_poses = region_poses(robot, region, PLATE_POSES, rng=rng, towards=towards, cone=cone)
    return informative_poses(
        robot,
        number,
        index=index,
        candidates=rows,
        names=identified_names(robot, base=base, tool=tool),
        limits=limits,
        evaluation_poses=evaluation_poses,
        method=Method(method),
        rng=np.random.default_rng(seed),
    )


def write_poses(robot: Robot, poses: PoseSet, path: Path | str) -> Path:
    """Write joint positions as a table with units, ready to be measured at."""
    lines = [",".join(f"q{i + 1}[{'m' if slides else 'rad'}]" for i, slides in enumerate(sliding(robot)))]
    lines += [",".join(repr(float(v)) for v in row) for row in poses.q]
    return write_text(path, "\n".join(lines) + "\n")


def poses_table(robot: Robot, poses: PoseSet) -> RenderableType:
    """The index before and after, and every pose in degrees or millimetres."""
    title = f"{plural(len(poses.q), 'pose')} for {robot.name}"
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, title=escape(title), title_justify="left")
    table.add_column("pose", justify="right")
    for k, unit in enumerate(shown_units(robot)):
        table.add_column(escape(f"q{k + 1} [{unit.strip()}]"), justify="right", no_wrap=True)
    for number, q in enumerate(shown_joints(robot, poses.q), start=1):
        table.add_row(str(number), *(f"{v:.1f}" for v in q))
    text = f"index {poses.index}: {poses.before:.4g} for a random start, {poses.after:.4g} for these"
    sentences = [text]
    if poses.bound is not None:
        share = 100.0 * (1.0 - poses.after / poses.bound)
        sentences.append(
            f"no choice of these candidates exceeds {poses.bound:.6g} (convex bound): this one is "
            f"within {share:.2g} %"
        )
    if len(poses.q) > 1:
        longest, mean = np.rad2deg(poses.travels.max()), np.rad2deg(poses.travels.mean())
        of = "revolute joints, in general" if sliding(robot).any() else "the joint that travels most"
        sentences.append(f"travel between poses ({of}): {longest:.0f}° maximum, {mean:.0f}° mean")
    return Group(table, Text("\n".join(sentences)))


def poses_json(robot: Robot, poses: PoseSet) -> Json:
    return document(
        "workbench.poses/1",
        robot=robot.name,
        index={"name": poses.index, "before": poses.before, "after": poses.after},
        bound=poses.bound,
        travel={"max": poses.travels.max(initial=0.0), "sum": poses.travels.sum()},
        outcome=poses.outcome,
        poses=poses.q,
    )
