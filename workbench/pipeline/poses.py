"""Informative poses as one call, and the file that a measurement starts from."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from workbench.design.poses import PoseSet, informative_poses
from workbench.errors import DataError
from workbench.files import write_text
from workbench.measure.readers import read_trajectory
from workbench.robots.robot import JointKind, Robot


def choose_poses(
    robot: Robot,
    number: int,
    *,
    index: str = "O1",
    candidates: Path | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> PoseSet:
    """Joint positions with a large observability index.

    Args:
        robot: Nominal arm with limits.
        number: How many.
        index: `O` (ARIA eqs. 17, 18, pose by pose) or `O1` … `O5` of the whole set.
        candidates: A file of measurements or joint rows to choose from.
        seed: Of the random starts.
        progress: Called with the share of the work done.

    Raises:
        DataError: fewer candidates than poses.
    """
    rows = None if candidates is None else read_trajectory(candidates, joints=robot.dof).q
    if candidates is not None and rows is None:
        raise DataError(f"{candidates}: has no joint columns (q1[rad] …) to choose poses from")
    if rows is not None and len(rows) < number:
        raise DataError(f"{candidates}: {len(rows)} rows, but {number} poses are wanted; give more rows")
    rng = np.random.default_rng(seed)
    return informative_poses(robot, number, index=index, candidates=rows, rng=rng, progress=progress)


def write_poses(robot: Robot, poses: PoseSet, path: Path | str) -> Path:
    """Write joint positions as a table with units, ready to be measured at."""
    units = ["m" if j.kind is JointKind.PRISMATIC else "rad" for j in robot.moving]
    lines = [",".join(f"q{i + 1}[{unit}]" for i, unit in enumerate(units))]
    lines += [",".join(repr(float(v)) for v in row) for row in poses.q]
    return write_text(path, "\n".join(lines) + "\n")
