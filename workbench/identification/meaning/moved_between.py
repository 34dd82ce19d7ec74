"""Rows of which those up to one fit an arm, as where the instrument, the robot or the tool was moved."""

import numpy as np

from workbench.arm import chain as chains
from workbench.arm.robot import Robot
from workbench.base.wording import in_mm
from workbench.data.dataset import Dataset
from workbench.identification.meaning.placement import place
from workbench.identification.meaning.reading import FITS, NARROW

MIN_PART = 10
"""Minimum number of rows of a part: with fewer, base and point of the tool fit too much."""
WITHIN = 0.5 * FITS
"""Misfit of a part as a share of the reach."""


def parts_in_order(robot: Robot, data: Dataset) -> str:
    """`data rows 0–29 fit to 1.5 mm, and 30–59 to 1.6 mm elsewhere`; empty if neither end fits by itself.

    Args:
        robot: The arm that is said to have moved.
        data: Rows that fit it in no reading, in their order.
    """
    for rows, is_begin in ((data, True), (data.take(np.arange(len(data))[::-1]), False)):
        if (length := _part_that_fits(robot, rows)) in (0, len(rows)):
            continue
        own, other = rows.take(np.arange(length)), rows.take(np.arange(length, len(rows)))
        text = f"data rows {_span(own)} fit to {in_mm(_misfit(robot, own))}"
        if len(other) >= MIN_PART and _fits(robot, other):
            return f"{text}, and {_span(other)} to {in_mm(_misfit(robot, other))} with another base or tool"
        return f"{text}, those {'after' if is_begin else 'before'} them don't"
    return ""


def _span(data: Dataset) -> str:
    return f"{data.row.min()}–{data.row.max()}"


def _part_that_fits(robot: Robot, data: Dataset) -> int:
    """Number of rows at the beginning that fit by themselves; 0 if there is no such part."""
    low, high = MIN_PART, len(data)
    if high < 2 * MIN_PART or not _fits(robot, data.take(np.arange(low))):
        return 0
    while high - low > 1:  # a few rows more are set apart, and the part still fits
        middle = (low + high) // 2
        low, high = (middle, high) if _fits(robot, data.take(np.arange(middle))) else (low, middle)
    near = _errors(robot, data, max(MIN_PART, int(0.8 * low))) < WITHIN * robot.reach
    off = [not near[k] and near[k : k + 3].sum() < 2 for k in range(len(near))]
    return int(np.argmax([*off, True]))


def _errors(robot: Robot, data: Dataset, count: int) -> np.ndarray:
    """Distances of all rows [m] from an arm that is placed by the first of them."""
    points = np.asarray(data.position)
    at = place(robot.bare, data.q[None, :count], points[None, :count], None)
    placed = at.base[0] @ chains.poses(robot.bare.chain, data.q) @ at.tool[0]
    return np.linalg.norm(placed[:, :3, 3] - points, axis=1)


def _misfit(robot: Robot, data: Dataset) -> float:
    """Root mean square distance of rows that may set some apart [m]."""
    error = _errors(robot, data, len(data))
    return float(np.sqrt((np.sort(error)[: max(1, int(0.8 * len(data)))] ** 2).mean()))


def _fits(robot: Robot, data: Dataset) -> bool:
    points = np.asarray(data.position)
    wide = float(np.sqrt(((points - points.mean(0)) ** 2).sum(1).mean()))
    return _misfit(robot, data) < min(WITHIN * robot.reach, NARROW * wide)
