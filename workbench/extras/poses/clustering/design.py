"""Clustering the poses of a region, as one call."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from workbench.arm.linearisation import linearise
from workbench.arm.robot import Robot
from workbench.base.arguments import Seed
from workbench.base.errors import DataError
from workbench.base.threads import one_thread
from workbench.extras.poses.clustering import search
from workbench.extras.poses.clustering.search import Clustering
from workbench.plate.optimality_criterion import goal_index
from workbench.plate.plate import Plate
from workbench.plate.region import Region
from workbench.plate.region_poses import PLATE_POSES, region_poses

ERROR = "I"
"""Name of the index that is the predicted error over the region."""


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
    solid: Plate | None = None,
    seed: Seed = 0,
) -> Clustering:
    """Poses with equal O in different cubes of a region, the best such set (ARIA 4.2).

    Args:
        robot: Nominal arm.
        region: The cuboid.
        number: How many poses.
        side: Side L of the cubes [m]; the region's own if None.
        index: What is made large among sets with equal O: `O1` … `O5`, `A`, `D`, or `I`.
        towards: Orientations of the tool about which a cone opens; any orientation if None.
        cone: Maximum angle from the nearest of them [rad].
        solid: A plate that the arm must not run into, as long as there are such poses; none if None.
        seed: Of the random candidates.
    """
    goal: str | np.ndarray = index
    if index == ERROR:
        goal = region_poses(
            robot, region, PLATE_POSES, rng=np.random.default_rng(0), towards=towards, cone=cone
        )
    middle = robot.search_limits.mean(axis=1)[None]

    def found(solid: Plate | None) -> Clustering:
        return search.search_clusters(
            robot,
            region if side is None else replace(region, cube=side),
            index=goal_index(goal, robot, linearise(robot, middle)),
            rng=np.random.default_rng(seed),
            number=number,
            limits=replace(search.ROOMY, towards=towards, cone=cone, solid=solid),
        )

    if solid is None or solid.size is None:
        return found(None)
    try:
        return found(solid)
    except DataError:  # too few poses are clear of it: the others are better than none, and are named
        return found(None)
