"""Fixture plates as calls: scored, and compared."""

from collections.abc import Callable

import numpy as np

from workbench.design import plate_score
from workbench.design.plate import Plate
from workbench.design.plate_score import PlateScore
from workbench.design.target_rows import SIGMA_POSITION, SIGMA_ROTATION
from workbench.robots.robot import Robot


def score_plate(
    robot: Robot,
    plate: Plate,
    *,
    sigma: tuple[float, float] = (SIGMA_POSITION, SIGMA_ROTATION),
    base: bool | None = None,
    tool: bool | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> PlateScore:
    """What a plate tells about an arm; see `design.plate_score.score_plate`.

    Args:
        robot: Nominal arm.
        plate: Its targets and region.
        sigma: Standard deviations of the instrument, position [m] and rotation [rad].
        base: Whether the base is identified too; as the robot says if None.
        tool: Whether the tool is.
        seed: Of the mixes of branches that are tried.
        progress: Called with the share of the work done.
        cancel: Asked now and then whether to stop with the best branches so far.
    """
    return plate_score.score_plate(
        robot,
        plate,
        sigma=sigma,
        base=base,
        tool=tool,
        rng=np.random.default_rng(seed),
        progress=progress,
        cancel=cancel,
    )
