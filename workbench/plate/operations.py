"""Fixture plates as calls: scored, and found by workspace clustering."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from jaxtyping import Float

from workbench.arm.linearisation import linearise
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.base.threads import one_thread
from workbench.plate import clustering
from workbench.plate import score as plate_score
from workbench.plate.clustering import Clustering
from workbench.plate.criterion import goal_index
from workbench.plate.placement import check_place
from workbench.plate.plate import Plate
from workbench.plate.readings import SIGMA_POSITION, SIGMA_ROTATION
from workbench.plate.region import Region
from workbench.plate.region_poses import PLATE_POSES, plate_region_poses, region_poses
from workbench.plate.score import PlateScore

ERROR = "I"
"""Name of the index that is the predicted error over the region."""


@one_thread()
def score_plate(
    robot: Robot,
    plate: Plate,
    *,
    sigma: tuple[float, float] = (SIGMA_POSITION, SIGMA_ROTATION),
    base: bool | None = None,
    tool: bool | None = None,
    matter: Float[np.ndarray, "rows n"] | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> PlateScore:
    """What a plate tells about an arm, target by target and as a set.

    Args:
        robot: Nominal arm.
        plate: Its targets and region.
        sigma: Standard deviations of the instrument, position [m] and rotation [rad].
        base: Whether the base is identified too; as the robot says if None.
        tool: Whether the tool is.
        matter: Poses for which the error is predicted [rad or m]; those of the plate's own region if None.
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
        matter=matter,
        rng=np.random.default_rng(seed),
        progress=progress,
        cancel=cancel,
    )


@one_thread()
def score_plates(
    robot: Robot,
    plates: Sequence[Plate],
    *,
    sigma: tuple[float, float] = (SIGMA_POSITION, SIGMA_ROTATION),
    base: bool | None = None,
    tool: bool | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> tuple[PlateScore, ...]:
    """Scores that compare: all errors are predicted for the poses that the first plate's region asks for.

    Args:
        robot: Nominal arm.
        plates: At least one; those left when cancelled are not scored.
        sigma: Standard deviations of the instrument, position [m] and rotation [rad].
        base: Whether the base is identified too; as the robot says if None.
        tool: Whether the tool is.
        seed: Of the mixes of branches that are tried.
        progress: Called with the share of the work done.
        cancel: Asked now and then whether to stop.

    Raises:
        OptionError: no plates.
        DataError: a plate that nothing can be measured on, or a region out of reach.
    """
    if not plates:
        raise OptionError("no plates to score; give at least one")
    check_place(robot, plates[0])
    matter = plate_region_poses(robot, plates[0])
    report = progress or (lambda part: None)
    scores: list[PlateScore] = []
    for number, plate in enumerate(plates):
        if scores and cancel is not None and cancel():
            break
        scores.append(
            score_plate(
                robot,
                plate,
                sigma=sigma,
                base=base,
                tool=tool,
                matter=matter,
                seed=seed,
                progress=partial(_part, report, number, len(plates)),
                cancel=cancel,
            )
        )
    return tuple(scores)


def _part(report: Callable[[float], None], done: int, of: int, part: float) -> None:
    report((done + part) / of)


@one_thread()
def cluster_region(
    robot: Robot,
    region: Region,
    *,
    number: int = 10,
    side: float | None = None,
    index: str = ERROR,
    towards: Float[np.ndarray, "orientations 3 3"] | None = None,
    cone: float = np.pi,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> Clustering:
    """Poses with equal O in different cubes of a region, the best such set (ARIA 4.2).

    Args:
        robot: Nominal arm.
        region: The cuboid.
        number: How many poses.
        side: Side L of the cubes [m]; the region's own if None.
        index: What is made large among sets with equal O: `O1` … `O5`, `A`, `D`, or `I`.
        towards: Orientations of the tool about which a cone opens; any orientation if None.
        cone: Greatest angle from the nearest of them [rad].
        seed: Of the random candidates.
        progress: Called with the share of the work done.
        cancel: Asked now and then whether to stop with the best set so far.
    """
    rng = np.random.default_rng(seed)
    goal: str | np.ndarray = index
    if index == ERROR:
        goal = region_poses(
            robot, region, PLATE_POSES, rng=np.random.default_rng(0), towards=towards, cone=cone
        )
    middle = robot.search_limits.mean(axis=1)[None]
    return clustering.cluster_region(
        robot,
        region if side is None else replace(region, cube=side),
        index=goal_index(goal, robot, linearise(robot, middle)),
        rng=rng,
        number=number,
        limits=replace(clustering.ROOMY, towards=towards, cone=cone),
        progress=progress,
        cancel=cancel,
    )
