"""Limits on chosen poses: position and orientation of the tool, margins, distances between poses.

Region, orientation cone and margins concern each pose alone, the spread concerns every two of them, and the
travel every two that follow each other in the order of measuring. Margins are what an arm with manufacturing
errors needs to reach a pose too: a distance from its joint limits, and one from singular postures.

Candidates are folded first: of all full turns of a joint the one nearest to the middle of its limits is
taken, which changes no pose and shortens the travel. `feasible_start` chooses poses that keep all limits, or
says which of the limits conflict.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm.joint_units import sliding
from workbench.arm.kinematics.forward import geometric_jacobian
from workbench.arm.robot import Robot
from workbench.base.arguments import admit
from workbench.base.errors import DataError, OptionError
from workbench.base.types import frozen
from workbench.extras.poses.d_optimal import greedy_choice
from workbench.plate.collision import solid_clear
from workbench.plate.optimiser.clearance import Surroundings, arm_shape
from workbench.plate.plate import Plate
from workbench.plate.poses.sampling import in_base, poses_satisfying, random_poses
from workbench.plate.region import Region


@dataclass(frozen=True, eq=False, kw_only=True)
class PoseLimits:
    """Limits of chosen poses, in the robot's base frame.

    Args:
        region: Region for the tool; anywhere if None.
        towards: Orientations of the tool at the axis of the cone; any orientation if None.
        cone: Maximum angle between the tool's orientation and the nearest of them [rad].
        margin: Minimum distance of a turning joint from its limits [rad].
        dexterity: Minimum singular value of the geometric Jacobian, lengths in units of the arm's reach.
        spread: Minimum distance between the tool's places in two poses [m].
        travel: Maximum travel of any joint from one pose to the next [rad or m]; any if None.
        clearance: Minimum distance of the arm from itself, and from the table [m]; not checked if None.
        floor: Height of the table that the arm stands on, in the robot's base [m]; none if None.
        solid: A plate whose solid the arm must not touch; none if None.

    Raises:
        OptionError: a cone or travel that is not positive, or a negative spread, margin or dexterity.
    """

    region: Region | None = None
    towards: Float[np.ndarray, "orientations 3 3"] | None = None
    cone: float = np.pi
    margin: float = 0.0
    dexterity: float = 0.0
    spread: float = 0.0
    travel: float | None = None
    clearance: float | None = None
    floor: float | None = None
    solid: Plate | None = None

    def __post_init__(self):
        admit(self)
        minimum = min(self.spread, self.margin, self.dexterity)
        if minimum < 0 or not self.cone > 0 or (self.travel is not None and not self.travel > 0):
            raise OptionError(
                f"a cone of {np.rad2deg(self.cone):g}°, margin {np.rad2deg(self.margin):g}°, spread "
                f"{1e3 * self.spread:g} mm and a travel of {self.travel} are out of range: none may be "
                "negative, cone and travel must be positive",
                option="limits",
            )

    @property
    def single(self) -> bool:
        placed = self.region is not None or self.towards is not None
        return placed or self.clearance is not None or self.margin > 0 or self.dexterity > 0

    @property
    def pairs(self) -> bool:
        return self.spread > 0 or self.travel is not None

    def admits(self, robot: Robot, q: Float[np.ndarray, "rows n"]) -> Bool[np.ndarray, " rows"]:
        kept = self.inside(in_base(robot, q))
        kept[kept] = self._has_room(robot, q[kept])
        if self.clearance is not None and kept.any():
            shape = arm_shape(robot, self.clearance)
            room = Surroundings(shape, (), self.floor)
            own = room.distances(shape.placements(q[kept]), minimum=self.clearance)
            kept[kept] = own.min(1) >= self.clearance
        if self.solid is not None and kept.any():
            kept[kept] = solid_clear(robot, self.solid, q[kept])
        return kept

    def _has_room(self, robot: Robot, q: np.ndarray) -> np.ndarray:
        low, high = robot.limits.T
        away = np.minimum(q - low, high - q)[:, ~sliding(robot)].min(1, initial=np.inf) >= self.margin
        if self.dexterity > 0 and away.any():
            jacobian = geometric_jacobian(robot, q[away]) / np.repeat([robot.reach, 1.0], 3)[:, None]
            away[away] = np.linalg.svd(jacobian, compute_uv=False)[:, -1] >= self.dexterity
        return away

    def inside(self, poses: Float[np.ndarray, "rows 4 4"]) -> Bool[np.ndarray, " rows"]:
        """Which poses of the tool, in the robot's base frame, lie in the region and the cone."""
        return self._in_region(poses) & self._in_cone(poses)

    def _in_region(self, poses: np.ndarray) -> np.ndarray:
        return np.ones(len(poses), bool) if self.region is None else self.region.contains(poses[:, :3, 3])

    def _in_cone(self, poses: np.ndarray) -> np.ndarray:
        if self.towards is None:
            return np.ones(len(poses), bool)
        # the angle θ of Rᵀ R_k has trace 1 + 2 cos θ
        traces = np.einsum("rij,kij->rk", poses[:, :3, :3], self.towards).max(1)
        return traces >= 1.0 + 2.0 * np.cos(min(self.cone, np.pi)) - 1e-9

    def clash(self, places: Float[np.ndarray, "rows 3"]) -> Bool[np.ndarray, "rows rows"]:
        """Which poses must not be chosen together: too near, or the same."""
        gaps = np.linalg.norm(places[:, None] - places[None], axis=2)
        return (gaps < self.spread) | np.eye(len(places), dtype=bool)

    def follow(self, q: Float[np.ndarray, "rows n"]) -> Bool[np.ndarray, "rows rows"] | None:
        """Which joint positions may follow each other; None if all may."""
        if self.travel is None:
            return None
        return np.abs(q[:, None] - q[None]).max(2) <= self.travel

    def keeps(self, robot: Robot, q: Float[np.ndarray, "rows n"]) -> Bool[np.ndarray, " rows"]:
        """Which rows of an ordered set keep all limits, with their neighbours and the others."""
        poses = in_base(robot, q)
        near = self.clash(poses[:, :3, 3])
        np.fill_diagonal(near, False)
        kept = self.admits(robot, q) & ~near.any(1)
        if self.travel is not None:
            far = np.abs(np.diff(q, axis=0)).max(1, initial=0.0) > self.travel
            kept[:-1] &= ~far
            kept[1:] &= ~far
        return kept


def folded(robot: Robot, q: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "rows n"]:
    """The same poses with every turning joint in the turn nearest to the middle of its limits [rad or m]."""
    low, high = robot.search_limits.T
    middle = 0.5 * (low + high)
    near = q - 2.0 * np.pi * np.round((q - middle) / (2.0 * np.pi))
    return frozen(np.where(~sliding(robot) & (near >= low) & (near <= high), near, q))


def sample_poses(
    robot: Robot, number: int, limits: PoseLimits, *, rng: np.random.Generator
) -> Float[np.ndarray, "number n"]:
    """Random joint positions with the tool in the region and the cone.

    Args:
        limits: Limits, of which those of single poses apply.
    """
    if not limits.single:
        return random_poses(robot, number, rng=rng)

    def complaint(found: int, tries: int) -> str:
        return _none_found(robot, limits, found, tries)

    return poses_satisfying(robot, number, lambda q: limits.admits(robot, q), rng=rng, complaint=complaint)


def walks(
    robot: Robot,
    starts: Float[np.ndarray, "walks n"],
    steps: int,
    limits: PoseLimits,
    *,
    rng: np.random.Generator,
) -> Float[np.ndarray, "rows n"]:
    """Random walks from poses that keep the limits, no step longer than the travel: candidates in reach.

    Args:
        starts: Starts of the walks [rad or m].
        steps: Number of steps of each; steps outside the limits are skipped.
        limits: With a travel.
    """
    low, high = robot.search_limits.T
    stride = np.inf if limits.travel is None else limits.travel
    here, rows = starts.copy(), []
    for _ in range(steps):
        reach = np.minimum(stride, high - low)
        there = np.clip(here + rng.uniform(-1.0, 1.0, here.shape) * reach, low, high)
        kept = limits.admits(robot, there)
        here[kept] = there[kept]
        rows.append(here[kept])
    return np.concatenate(rows)


def _none_found(robot: Robot, limits: PoseLimits, found: int, tries: int) -> str:
    """Which limits conflict, by the number of random poses that keep each alone."""
    region, cone = limits.region, f"orientation cone of {np.rad2deg(limits.cone):.3g}°"
    if region is None:
        return (
            f"robot '{robot.name}' rarely keeps the {cone} with a margin of "
            f"{np.rad2deg(limits.margin):.3g}° to its limits ({found} of {tries} tries); relax them"
        )
    box = f"region {region.min.tolist()} to {region.max.tolist()} m"
    q = random_poses(robot, tries, rng=np.random.default_rng(0))
    poses = in_base(robot, q)
    placed, turned = int(limits._in_region(poses).sum()), int(limits._in_cone(poses).sum())
    if limits.towards is None or not placed:
        return (
            f"robot '{robot.name}' rarely reaches the {box} ({placed} of {tries} random joint "
            "positions); move the region"
        )
    return (
        f"the {box} and the {cone} conflict: of {tries} random joint positions of robot '{robot.name}' "
        f"{placed} keep the region, {turned} the cone, {found} both and a margin of "
        f"{np.rad2deg(limits.margin):.3g}° to the limits; move the region or widen the cone"
    )


GREEDY_STARTS = 30
"""Number of greedy starts before the limits count as conflicting."""


def feasible_start(
    blocks: Float[np.ndarray, "options r p"],
    number: int,
    limits: PoseLimits,
    clash: Bool[np.ndarray, "options options"],
    follow: Bool[np.ndarray, "options options"] | None,
    *,
    rng: np.random.Generator,
) -> Int[np.ndarray, " number"]:
    """Candidates that keep the spread, in an order that keeps the travel.

    Args:
        blocks: Scaled, whitened Jacobian of each candidate.
        limits: The limits, for the message if they can't be met.
        clash: Which candidates must not be chosen together.
        follow: Which may follow each other; any if None.
    """
    found = _longest(blocks, number, clash, follow, rng)
    if len(found) == number:
        return found
    same = np.eye(len(blocks), dtype=bool)
    spread_alone = len(_longest(blocks, number, clash, None, rng))
    travel_alone = len(_longest(blocks, number, same, follow, rng))
    spread = f"a spread of {1e3 * limits.spread:g} mm"
    travel = f"a travel of at most {np.rad2deg(limits.travel or np.pi):.3g}° from pose to pose"
    where = "the region" if limits.region is not None else "the reach of the arm"
    if spread_alone < number:
        raise DataError(
            f"{number} poses with {spread} and {where} conflict: at most {spread_alone} were found to fit; "
            "use fewer poses or less spread",
            found=(spread_alone,),
        )
    if travel_alone < number:
        raise DataError(
            f"{number} different poses and {travel} conflict: at most {travel_alone} were found; allow more "
            "travel or give more candidates",
            found=travel_alone,
        )
    raise DataError(
        f"{spread} and {travel} conflict: at most {len(found)} of {number} poses were found that keep both; "
        "relax one of them",
        found=len(found),
    )


def _longest(blocks, number, clash, follow, rng) -> np.ndarray:
    """The longest of several greedy choices; the first that is long enough."""
    firsts = [None, *rng.permutation(len(blocks))[:GREEDY_STARTS].tolist()]
    best = np.zeros(0, np.int64)
    for first in firsts:
        found = greedy_choice(blocks, number, clash=clash, follow=follow, first=first)
        if len(found) > len(best):
            best = found
        if len(best) == number:
            break
    return best
