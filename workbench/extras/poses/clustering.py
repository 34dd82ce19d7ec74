"""Workspace clustering: poses with equal O in mutually different cubes of the region (ARIA §4.2).

Equal O alone is not enough. O of eq. (17) does not change when joint 1 alone turns (the whole Jacobian turns
with it, and turning changes no singular value), so poses of equal O may have a stacked Jacobian of rank 6.
Of the sets with equal O the one with full rank and the best index of the whole set is taken:

1. random joint positions with the tool in the region, O of each and the cube that it lies in;
2. bands of O whose ends differ by no more than the tolerance and that hold enough different cubes;
3. in the most promising bands an exchange for the index of the set, no two poses in one cube;
4. Newton steps along ∂O/∂q until all poses of the winner have the same O, each staying in its cube: the
   median O, or where a pose can't get there within its cube and limits, the O at which such poses stop.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.linearisation import Linearisation, linearise
from workbench.arm.robot import Robot
from workbench.base.arguments import Seed, checked_arguments
from workbench.base.errors import DataError, OptionError
from workbench.base.progress import cancelled, part_of
from workbench.base.threads import one_thread
from workbench.base.types import Outcome, frozen
from workbench.extras.poses.climb import PoseClimb
from workbench.extras.poses.pose_limits import PoseLimits, sample_poses
from workbench.plate.exchange import by_determinant, of_information
from workbench.plate.observability import AbstractIndex, O, goal_index
from workbench.plate.plate import Plate, Target
from workbench.plate.poses.sampling import in_base
from workbench.plate.region import Region
from workbench.plate.region_poses import PLATE_POSES, region_poses

CANDIDATES = 6000
"""Random poses in the region."""
ROOMY = PoseLimits(margin=0.2, dexterity=0.1)
"""Of every pose: arms with errors of 5 mm and 5° in every constant reached all such poses."""
TOLERANCE = 0.01
"""Maximum relative difference of O within a set before it is made equal."""
BANDS = 8
"""Bands that are searched for the best set."""
MAX_BAND_POSES = 300
"""Poses of a band that take part in the exchange."""
LEVELLING = 12
"""Newton steps towards equal O."""
GOALS = 4
"""Values of O that are tried."""
EQUAL = 1e-9
"""Relative difference below which O is equal."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Cluster:
    """Poses with equal O in different cubes.

    Args:
        q: Joint positions [rad or m].
        o: O of each pose, ARIA eq. (17).
        cubes: The cube of each, numbered as in `Region.centres`.
        rank: Rank of their stacked Jacobian.
        stacked: σmin/σmax of the stacked Jacobian, unscaled as in the paper; 0 below full rank.
        value: The index of the set.
    """

    q: Float[np.ndarray, "poses n"]
    o: Float[np.ndarray, " poses"]
    cubes: Int[np.ndarray, " poses"]
    rank: int
    stacked: float
    value: float

    @property
    def difference(self) -> float:
        """Relative difference of the minimum and the maximum O."""
        return float(self.o.max() / self.o.min() - 1.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class Clustering:
    """What workspace clustering found.

    Args:
        index: Name of the index that chose between sets of equal O.
        best: The set with the best index.
        plain: A set with equal O in different cubes and nothing else asked, as §4.2 has it.
        turned: The first pose of `best` with joint 1 alone turned, once in every cube that it then meets.
    """

    robot: Robot
    region: Region
    index: str
    best: Cluster
    plain: Cluster
    turned: Cluster
    outcome: Outcome

    def plate(self) -> Plate:
        """The calibration tool that the best set is a design of: its poses as targets."""
        poses = in_base(self.robot, self.best.q)
        targets = tuple(Target.at(pose, q=frozen(q)) for pose, q in zip(poses, self.best.q, strict=True))
        return Plate(name="Clustering", targets=targets, region=self.region)


@dataclass(frozen=True, eq=False)
class _PoseCandidates:
    """Candidates: joint positions, O and cube of each, in the order of O."""

    robot: Robot
    region: Region
    limits: PoseLimits
    index: AbstractIndex
    q: np.ndarray
    o: np.ndarray
    cubes: np.ndarray
    linearisation: Linearisation

    def cluster(self, q: np.ndarray) -> Cluster:
        whole = linearise(self.robot, q)
        values = np.linalg.svd(whole.unwhitened, compute_uv=False)
        full = whole.rank() == len(whole.names)
        return Cluster(
            q=frozen(q),
            o=frozen(O().per_pose(whole)),
            cubes=frozen(self.region.cells(in_base(self.robot, q)[:, :3, 3])),
            rank=whole.rank(),
            stacked=float(values[-1] / values[0]) if full else 0.0,
            value=self.index.value(whole),
        )


@checked_arguments()
@one_thread()
def cluster_region(
    robot: Robot, region: Region, *, number: int = 10, index: str = "I", seed: Seed = 0
) -> Clustering:
    """Poses with equal O in mutually different cubes of a region, the best such set (ARIA §4.2).

    Args:
        robot: Nominal arm.
        region: The cuboid; its `cube` is the side L of the cubes.
        number: How many poses.
        index: What is made large among sets with equal O: `O1` … `O5`, or `I`, the predicted error.
        seed: Of the random candidates.
    """
    goal: str | np.ndarray = index
    if index == "I":
        goal = region_poses(robot, region, PLATE_POSES, rng=np.random.default_rng(0))
    aim = goal_index(goal, robot, linearise(robot, robot.search_limits.mean(axis=1)[None]))
    limits = replace(ROOMY, region=region)
    if number < 2:
        raise OptionError(f"clustering needs at least 2 poses, got {number}", option="number", found=number)
    if number > region.cubes:
        has = f"the region has {region.cubes} of side {region.cube:g} m; ask for fewer poses or smaller cubes"
        raise DataError(f"{number} poses need {number} different cubes, {has}", found=region.cubes)
    pool = _pool(robot, region, limits, aim, np.random.default_rng(seed))
    bands = _bands(pool, number)
    best, outcome = None, Outcome.CONVERGED
    for done, band in enumerate(bands):
        with part_of(done / len(bands), 1.0 / len(bands), "looking for equal O"):
            found = _level(pool, pool.q[_best_of_band(pool, band, number)])
        if best is None or found.value > best.value:
            best = found
        if cancelled():
            outcome = Outcome.CANCELLED
            break
    assert best is not None
    return Clustering(
        robot=robot,
        region=region,
        index=aim.name,
        best=best,
        plain=_level(pool, pool.q[_first_of_each_cube(pool, bands[0])[:number]]),
        turned=pool.cluster(_turned(pool, best.q[0])),
        outcome=outcome,
    )


def _pool(robot, region, limits, index, rng) -> _PoseCandidates:
    q = sample_poses(robot, CANDIDATES, limits, rng=rng)
    q = q[np.argsort(O().per_pose(linearise(robot, q)), kind="stable")]
    linearisation, cubes = linearise(robot, q), region.cells(in_base(robot, q)[:, :3, 3])
    return _PoseCandidates(robot, region, limits, index, q, O().per_pose(linearisation), cubes, linearisation)


def _bands(pool: _PoseCandidates, number: int) -> list[np.ndarray]:
    """Candidates of some bands of O with enough different cubes, the richest in cubes first."""
    ends = np.searchsorted(pool.o, pool.o * (1.0 + TOLERANCE), side="right")
    counts = np.array([len(np.unique(pool.cubes[k:end])) for k, end in enumerate(ends)])
    found: list[np.ndarray] = []
    taken = np.zeros(len(pool.o), bool)
    for k in np.argsort(-counts, kind="stable"):
        if counts[k] < number or len(found) == BANDS:
            break
        if not taken[k : ends[k]].any():
            found.append(np.arange(k, ends[k]))
            taken[k : ends[k]] = True
    if not found:
        most, equal = int(counts.max(initial=0)), f"have O equal to {100 * TOLERANCE:g} % in different cubes"
        text = f"of {len(pool.q)} random poses in the region at most {most} {equal}, {number} are needed"
        raise DataError(f"{text}; ask for fewer or a wider band", found=most)
    return found


def _first_of_each_cube(pool: _PoseCandidates, band: np.ndarray) -> np.ndarray:
    """One candidate for each cube that a band meets."""
    return band[np.sort(np.unique(pool.cubes[band], return_index=True)[1])]


def _best_of_band(pool: _PoseCandidates, band: np.ndarray, number: int) -> np.ndarray:
    """The candidates of a band, one a cube, whose index as a set is best."""
    band = np.union1d(_first_of_each_cube(pool, band), band[:: max(len(band) // MAX_BAND_POSES, 1)])
    blocks = pool.linearisation.scaled.reshape(len(pool.q), -1, len(pool.linearisation.names))[band]
    clash = pool.cubes[band][:, None] == pool.cubes[band]
    start = by_determinant(blocks, clash=clash).fill(number)
    grams = blocks.transpose(0, 2, 1) @ blocks
    return band[of_information(grams, pool.index, number, clash=clash).descend(start).choice]


def _level(pool: _PoseCandidates, q: np.ndarray) -> Cluster:
    """The set with O made equal, as far as every pose can stay in its cube and within the limits."""
    home = best = pool.cluster(q)
    goal = float(np.median(home.o))
    for _ in range(GOALS):
        level = pool.cluster(_levelled(pool, home, goal))
        if level.difference < best.difference and level.rank >= home.rank:
            best = level
        if level.difference < EQUAL:
            break
        goal = float(level.o[np.argmax(np.abs(level.o / goal - 1.0))])
    return best


def _levelled(pool: _PoseCandidates, home: Cluster, goal: float) -> np.ndarray:
    """Joint positions with O moved towards the goal; a step that leaves the cube or the limits is halved."""
    low, high = pool.robot.search_limits.T
    q, share, climb = home.q.copy(), np.ones(len(home.q)), PoseClimb(pool.robot, O())
    for _ in range(LEVELLING):
        o, slope = O().per_pose(climb.at(q)), len(q) * climb.value_and_gradient(q)[1]  # O of a set is a mean
        if np.abs(o / goal - 1.0).max() < EQUAL:
            break
        step = slope * ((goal - o) * share / np.maximum((slope**2).sum(1), 1e-9))[:, None]
        moved = np.clip(q + step, low, high)
        poses = in_base(pool.robot, moved)
        stays = (pool.region.cells(poses[:, :3, 3]) == home.cubes) & pool.limits.admits(pool.robot, moved)
        q[stays] = moved[stays]
        share = np.where(stays, 1.0, 0.5 * share)
    return q


def _turned(pool: _PoseCandidates, q: np.ndarray) -> np.ndarray:
    """A pose with joint 1 alone turned through its range, once for each cube of the region that it meets."""
    low, high = pool.robot.search_limits[0]
    turned = np.tile(q, (2000, 1))
    turned[:, 0] = np.linspace(low, high, len(turned))
    cubes = pool.region.cells(in_base(pool.robot, turned)[:, :3, 3])
    inside = np.flatnonzero(cubes >= 0)
    return turned[inside[np.sort(np.unique(cubes[inside], return_index=True)[1])]]
