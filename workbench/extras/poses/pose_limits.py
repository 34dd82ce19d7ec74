"""Limits on chosen poses: position of the tool, margins.

Margins are what an arm with manufacturing errors needs to reach a pose too: a distance from its joint limits,
and one from singular postures.

Candidates are folded: of all full turns of a joint the one nearest to the middle of its limits is taken,
which changes no pose and shortens the travel.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.joint import NotNegative
from workbench.arm.joint_units import sliding
from workbench.arm.kinematics.forward import geometric_jacobian
from workbench.arm.robot import Robot
from workbench.base.arguments import Angle, Length, admit
from workbench.base.types import frozen
from workbench.plate.optimiser.meshes import arm_shape
from workbench.plate.poses.sampling import in_base, poses_satisfying, random_poses
from workbench.plate.region import Region

Check = Callable[[np.ndarray], np.ndarray]
"""Which of a stack of joint positions keep one limit."""
COUNTED = 2000
"""Random poses that tell which limit is rarely kept."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PoseLimits:
    """Limits of chosen poses, in the robot's base frame.

    Args:
        region: Region for the tool; anywhere if None.
        margin: Minimum distance of a turning joint from its limits [rad].
        dexterity: Minimum singular value of the geometric Jacobian, lengths in units of the arm's reach.
        clearance: Minimum distance of the arm from itself and its table [m]; not checked if None.

    Raises:
        OptionError: anything negative.
    """

    region: Region | None = None
    margin: Angle = 0.0
    dexterity: NotNegative = 0.0
    clearance: Length | None = None

    def __post_init__(self):
        admit(self)

    def admits(self, robot: Robot, q: Float[np.ndarray, "rows n"]) -> Bool[np.ndarray, " rows"]:
        """Which poses keep every limit of single poses."""
        kept = np.ones(len(q), bool)
        for check in self.checks(robot).values():
            if kept.any():
                kept[kept] = check(q[kept])
        return kept

    def checks(self, robot: Robot) -> dict[str, Check]:
        """The limits of single poses that there are, by what they are called, the quickest first."""
        found: dict[str, Check] = {}
        if (region := self.region) is not None:
            box = f"region {region.min.tolist()} to {region.max.tolist()} m"
            found[box] = lambda q: region.contains(in_base(robot, q)[:, :3, 3])
        if self.margin > 0:
            low, high = robot.limits[~sliding(robot)].T + np.array([[self.margin], [-self.margin]])
            found[f"margin of {np.rad2deg(self.margin):.3g}° to the joint limits"] = lambda q: (
                (q[:, ~sliding(robot)] >= low) & (q[:, ~sliding(robot)] <= high)
            ).all(1)
        if self.dexterity > 0:
            found["distance from singular postures"] = lambda q: self._is_dexterous(robot, q)
        if self.clearance is not None:
            found["clearance of the arm and the table"] = lambda q: self._is_clear(robot, q)
        return found

    def _is_dexterous(self, robot: Robot, q: np.ndarray) -> np.ndarray:
        jacobian = geometric_jacobian(robot, q) / np.repeat([robot.reach, 1.0], 3)[:, None]
        return np.linalg.svd(jacobian, compute_uv=False)[:, -1] >= self.dexterity

    def _is_clear(self, robot: Robot, q: np.ndarray) -> np.ndarray:
        assert self.clearance is not None  # else there is no such check
        shape, table = arm_shape(robot, self.clearance), min(0.0, -float(robot.base.xyz[2]))
        found = shape.clearances(shape.placements(q), floor=table, minimum=self.clearance)
        return found.min(1) >= self.clearance


def folded(robot: Robot, q: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "rows n"]:
    """The same poses with every turning joint in the turn nearest to the middle of its limits [rad or m]."""
    low, high = robot.search_limits.T
    middle = 0.5 * (low + high)
    near = q - 2.0 * np.pi * np.round((q - middle) / (2.0 * np.pi))
    return frozen(np.where(~sliding(robot) & (near >= low) & (near <= high), near, q))


def sample_poses(
    robot: Robot, number: int, limits: PoseLimits, *, rng: np.random.Generator
) -> Float[np.ndarray, "number n"]:
    """Random joint positions, folded, that keep the limits of single poses [rad or m].

    Raises:
        DataError: practically none does; says how many keep each limit alone.
    """
    checks = limits.checks(robot)
    if not checks:
        return folded(robot, random_poses(robot, number, rng=rng))

    def complaint(found: int, tries: int) -> str:
        q = random_poses(robot, COUNTED, rng=np.random.default_rng(0))
        alone = "; ".join(f"the {name}: {int(check(q).sum())}" for name, check in checks.items())
        return (
            f"robot '{robot.name}' rarely keeps all limits ({found} of {tries} random joint positions). Of "
            f"{COUNTED} so many keep each limit alone: {alone}. Relax the tightest"
        )

    q = poses_satisfying(robot, number, lambda q: limits.admits(robot, q), rng=rng, complaint=complaint)
    return folded(robot, q)
