"""Poses by ISO 9283: on the diagonal planes of the largest cube of the workspace (Katana §3.4).

The cube's edges lie along the axes of the robot's base. Four of its diagonal planes are measured, those of
the standard; each carries the standard's five points, in the middle and on the diagonals a tenth of their
length from the corners, and further points spread evenly up to the edges, so that some are at the cube's
boundary. Every point is reached with joint positions drawn at random. The order of measuring lets all joints
move from one pose to the next.

Sources: ISO 9283:1998, §6.8 (cube, planes C1-C2-C7-C8 … and points P1 to P5); the thesis names 118 poses and
does not list them. Evenly spread points by the additive recurrence R2 (Roberts, 2018).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import minimum_filter
from scipy.spatial.distance import cdist

from workbench.arm.inverse import solve as inverse
from workbench.arm.inverse.solve import Task
from workbench.arm.joint_units import sliding
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.base.types import frozen
from workbench.plate.poses.sampling import in_base
from workbench.plate.region import Region

SAMPLES = 200_000
"""Random joint positions that map the workspace."""
VOXELS = 24
"""Voxels along the longest edge of the workspace's box."""
FULL = 3
"""Samples from which on a voxel counts as reached."""
COLUMN = 0.1
"""Radius about the base's z axis, as a share of the arm's reach, that the arm's own base takes up."""
MIN_MOVE = float(np.deg2rad(2.0))
"""Minimum motion of every joint between poses [rad], or as many radii of the arm's reach [m/m]."""
SWAPS = 20_000
"""Exchanges tried for the order of measuring."""
POINTS = np.array([[0.5, 0.5], [0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.9]])
"""P1 to P5 of a plane, along its two edges as shares."""
EDGE = 5
"""Every so many further points lies on the cube's edge."""
TRIES = 20
"""Random joint positions from which a point is sought."""
SAME_POINT = 1e-6
"""Points nearer to each other than this [m] are one, such as the middles of all planes."""
R2 = np.array([0.7548776662466927, 0.5698402909980532])
"""Steps of the evenly spread sequence."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CubePoses:
    """Poses of the cube's diagonal planes in order of measuring.

    Args:
        cube: The cube in the robot's base.
        q: Joint positions [rad or m].
        min_move: Minimum motion of any joint between poses that follow each other [rad or m].
    """

    cube: Region
    q: Float[np.ndarray, "rows n"]
    min_move: float


def largest_cube(robot: Robot, *, rng: np.random.Generator) -> Region:
    """The largest cube along the base's axes of which every part is reached by the tool's point.

    The workspace is mapped in voxels by random joint positions, so that its faces are right to a voxel. The
    column over the base is left out: the cube lies beside the arm, where it works.
    """
    low, high = robot.search_limits.T
    q = rng.uniform(low, high, (SAMPLES, robot.dof))
    points = in_base(robot, q)[:, :3, 3]
    corner, side = points.min(axis=0), float(np.ptp(points, axis=0).max()) / VOXELS
    cells = np.floor((points - corner) / side).astype(np.int64)
    counts = np.zeros(cells.max(axis=0) + 1, np.int64)
    np.add.at(counts, tuple(cells.T), 1)
    centres = np.stack(np.meshgrid(*(np.arange(n) + 0.5 for n in counts.shape[:2]), indexing="ij"), -1)
    beside = np.linalg.norm(corner[:2] + side * centres, axis=-1) > COLUMN * robot.reach
    first, edge = largest_full(counts * beside[:, :, None] >= FULL)
    if edge < 2:
        raise DataError(f"the workspace of robot '{robot.name}' holds no cube; choose poses by an index")
    minimum = corner + side * first
    return Region(min=frozen(minimum), max=frozen(minimum + side * edge), cube=side * edge)


def largest_full(voxels: Bool[np.ndarray, "x y z"]) -> tuple[Int[np.ndarray, "3"], int]:
    """Lowest voxel and edge of the largest cube of full voxels, the first of several; edge 0 without any."""
    for edge in range(min(voxels.shape), 0, -1):
        begins = minimum_filter(voxels, edge, mode="constant", origin=-(edge // 2))
        if begins.any():
            return np.argwhere(begins)[0], edge
    return np.zeros(3, np.int64), 0


def plane_points(cube: Region, number: int) -> Float[np.ndarray, "number 3"]:
    """Points on the cube's four diagonal planes, P1 to P5 of each first, then evenly spread ones [m]."""
    low, high = cube.min, cube.max
    foot = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]]
    corners = np.array([[*place, height] for height in (low[2], high[2]) for place in foot])
    planes = [corners[[int(c) - 1 for c in name]] for name in ("1278", "2385", "3456", "4167")]
    spread = (np.arange(1, number + 1)[:, None] * R2) % 1.0
    spread[EDGE - 1 :: EDGE, 1] = 1.0
    shares = [(plane, point) for point in POINTS for plane in range(4)]
    shares += [(i % 4, point) for i, point in enumerate(spread)]
    along, up = np.array([point for _, point in shares]).T[:, :, None]
    a, b, d = np.array([planes[plane][[0, 1, 3]] for plane, _ in shares]).transpose(1, 0, 2)
    places = a + along * (b - a) + up * (d - a)
    again = np.tril(cdist(places, places) < SAME_POINT, -1).any(axis=1)
    return places[~again][:number]


def iso_cube_poses(robot: Robot, number: int = 118, *, rng: np.random.Generator) -> CubePoses:
    """Joint positions for points of the cube's diagonal planes, in an order that moves all joints.

    Args:
        number: How many poses; the thesis takes 118.
    """
    if number < 2:
        raise OptionError(f"the number of poses must be at least 2, got {number}")
    cube, q = largest_cube(robot, rng=rng), np.zeros((0, robot.dof))
    for tried in (number, 2 * number, 4 * number):
        q = _reached(robot, plane_points(cube, tried), rng)[:number]
        if len(q) == number:
            break
    else:
        raise DataError(
            f"robot '{robot.name}' reaches {len(q)} of {4 * number} points on the planes of the cube from "
            f"{cube.min.round(3).tolist()} to {cube.max.round(3).tolist()} m; choose poses by an index"
        )
    order = _order(robot, q, rng)
    moves = np.abs(np.diff(q[order], axis=0)).min()
    return CubePoses(cube=cube, q=frozen(q[order]), min_move=float(moves))


def _reached(
    robot: Robot, points: Float[np.ndarray, "points 3"], rng: np.random.Generator
) -> Float[np.ndarray, "rows n"]:
    """Random joint positions with the tool's point at each place, in order; places out of reach left out."""
    low, high = robot.search_limits.T
    targets = robot.base.pose @ se3.pose(np.broadcast_to(np.eye(3), (len(points), 3, 3)), points)
    q, done = np.zeros((len(points), robot.dof)), np.zeros(len(points), bool)
    for _ in range(TRIES):
        rows = np.flatnonzero(~done)
        starts = rng.uniform(low, high, (len(rows), robot.dof))
        found = inverse.follow_many(robot, targets[rows], starts, task=Task.POSITION)
        q[rows[found.converged]] = found.q[found.converged]
        done[rows[found.converged]] = True
        if done.all():
            break
    return q[done]


def _order(
    robot: Robot, q: Float[np.ndarray, "rows n"], rng: np.random.Generator
) -> Int[np.ndarray, " rows"]:
    """A random order whose pairs of neighbours move every joint, mended by exchanges of two poses."""
    need = np.where(sliding(robot), MIN_MOVE * robot.reach, MIN_MOVE)
    still = (np.abs(q[:, None] - q[None]) < need).any(axis=-1)
    order = rng.permutation(len(q))

    def idle(places: np.ndarray) -> int:
        """Pairs at the places and after them that leave a joint where it is."""
        pairs = np.unique(np.concatenate([places - 1, places]))
        pairs = pairs[(pairs >= 0) & (pairs < len(order) - 1)]
        return int(still[order[pairs], order[pairs + 1]].sum())

    for _ in range(SWAPS):
        bad = np.flatnonzero(still[order[:-1], order[1:]])
        if not len(bad):
            break
        places = np.array([bad[rng.integers(len(bad))] + rng.integers(2), rng.integers(len(order))])
        before = idle(places)
        order[places] = order[places[::-1]]
        if idle(places) > before:
            order[places] = order[places[::-1]]
    return order
