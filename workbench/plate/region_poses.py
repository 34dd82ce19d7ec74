"""Evaluation poses: joint positions with the tool in the region of the calibration.

There are two kinds, for which a calibration's accuracy differs greatly:

* `region_poses`: any place in the region, any orientation within a cone about given ones (all
  orientations by default), any inverse-kinematics branch;
* `nearby_poses`: any place in the region, orientations within a cone about the measured ones, and the
  same branch as the measured pose that is nearest.
"""

from functools import lru_cache

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse import solve as inverse
from workbench.arm.inverse.damped_newton import Task
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.types import frozen
from workbench.plate.plate import Plate
from workbench.plate.poses.sampling import TRIES, in_base, random_poses
from workbench.plate.region import Region

PLATE_POSES = 60
"""Number of poses of a plate's region for predicted errors."""
PLATE_CONE = float(np.deg2rad(60.0))
"""Maximum rotation from the orientations of its targets [rad]."""
NEARBY_CONE = float(np.deg2rad(20.0))
"""Maximum angle from the orientation of the measured pose whose place is nearest [rad]."""
DOWN = np.diag([1.0, -1.0, -1.0])
"""Orientation of a tool that points straight down on a plate, meant where it has no targets."""
FEW_JOINTS_POSES = 150
"""Number of random postures in the region instead, for arms that can't reach any such orientation."""


def region_poses(
    robot: Robot,
    region: Region,
    number: int,
    *,
    rng: np.random.Generator,
    towards: Float[np.ndarray, "orientations 3 3"] | None = None,
    cone: float = np.pi,
) -> Float[np.ndarray, "rows n"]:
    """Joint positions for random poses in the region, all inverse-kinematics branches of each.

    Args:
        region: Where the tool is, evenly spread.
        number: How many poses of the tool; each gives as many rows as it has branches within limits.
        towards: Orientations about which the cone opens, robot's base; about any if None.
        cone: Maximum angle from one of them [rad].
    """
    _check_reach(robot, region)
    rows: list[np.ndarray] = []
    reached, tries = 0, 0
    if towards is None:
        towards, cone = np.eye(3)[None], np.pi
    while reached < number:
        centres = towards[rng.integers(0, len(towards), number - reached)]
        turned = _turns(len(centres), rng, cone) @ centres
        poses = robot.base.pose @ se3.pose(turned, region.sample(len(centres), rng=rng))
        for result in inverse.solve_many(robot, poses):
            rows += [branch.q for branch in result.within_limits]
            reached += result.reachable
        tries += len(poses)
        if tries > TRIES * max(reached, 1):
            raise DataError(
                f"robot '{robot.name}' reaches {reached} of {tries} random poses in the region "
                f"{region.min.tolist()} to {region.max.tolist()} m; move the region or widen the cone"
            )
    return np.array(rows)


def plate_region_poses(robot: Robot, plate: Plate, number: int = PLATE_POSES) -> Float[np.ndarray, "rows n"]:
    """Poses of a plate's region: any position and branch, rotated from a target by up to `PLATE_CONE`.

    Plates of the same region and orientations give the same array, on the page and in a terminal, so that
    predicted errors are comparable. An arm of fewer than six joints takes the orientations that it has there.
    """
    corners = np.stack([plate.region.min, plate.region.max])
    turns = plate.poses[:, :3, :3] if len(plate) else plate.pose[:3, :3] @ DOWN
    return _plate_region_poses(robot, corners.tobytes(), turns.tobytes(), number)


@lru_cache(maxsize=32)
def _plate_region_poses(
    robot: Robot, corners: bytes, towards: bytes, number: int
) -> Float[np.ndarray, "rows n"]:
    low, high = np.frombuffer(corners).reshape(2, 3)
    region, rng = Region(min=low, max=high), np.random.default_rng(0)
    if robot.dof < int(Task.POSE):
        _check_reach(robot, region)
        return frozen(random_poses(robot, FEW_JOINTS_POSES, rng=rng, region=region))
    turns = np.frombuffer(towards).reshape(-1, 3, 3)
    return frozen(region_poses(robot, region, number, rng=rng, towards=turns, cone=PLATE_CONE))


def nearby_poses(
    robot: Robot,
    region: Region,
    number: int,
    *,
    rng: np.random.Generator,
    measured: Float[np.ndarray, "measured n"],
) -> Float[np.ndarray, "number n"]:
    """Joint positions for random poses near measured ones: orientation within `NEARBY_CONE`, same branch.

    Args:
        region: Where the tool is, evenly spread.
        measured: Joint positions of the measured poses [rad or m].
    """
    places = in_base(robot, measured)
    found = np.zeros((0, robot.dof))
    tries = 0
    while len(found) < number:
        points = region.sample(number, rng=rng)
        nearest = np.argmin(np.linalg.norm(points[:, None] - places[None, :, :3, 3], axis=2), axis=1)
        turns = _turns(number, rng, NEARBY_CONE)
        poses = robot.base.pose @ se3.pose(turns @ places[nearest, :3, :3], points)
        followed = inverse.follow_many(robot, poses, measured[nearest])
        found = np.concatenate([found, followed.q[followed.converged]])
        tries += number
        if tries > TRIES * max(len(found), 1):
            raise DataError(
                f"robot '{robot.name}' reaches {len(found)} of {tries} poses near the measured ones in the "
                f"region {region.min.tolist()} to {region.max.tolist()} m; move the region",
                column="region",
                found=len(found),
            )
    return found[:number]


def _check_reach(robot: Robot, region: Region) -> None:
    """Refuse a region whose nearest point is beyond the arm's reach."""
    nearest = float(np.linalg.norm(np.clip(0.0, region.min, region.max)))
    if nearest > robot.reach:
        raise DataError(
            f"the region {region.min.tolist()} to {region.max.tolist()} m lies outside the reach of robot "
            f"'{robot.name}': its nearest point is {nearest:.3f} m from the base, the arm reaches "
            f"{robot.reach:.3f} m; move the region",
            column="region",
        )


def _turns(number: int, rng: np.random.Generator, cone: float) -> Float[np.ndarray, "number 3 3"]:
    """Rotations spread evenly (Haar) over all those of at most the angle `cone` [rad]."""
    axes = rng.normal(size=(number, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    # the angle's density is 1 − cos: solve its distribution (x − sin x)/(c − sin c) = u by bisection
    goal = rng.uniform(size=number) * (cone - np.sin(cone))
    low, high = np.zeros(number), np.full(number, cone)
    for _ in range(60):
        middle = 0.5 * (low + high)
        above = middle - np.sin(middle) > goal
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return se3.rotvec_to_matrix(axes * (0.5 * (low + high))[:, None])
