"""Redundant constants of an arm: those whose effect other constants can reproduce.

The tool's twists per constant are taken at random poses all over the joint space; what these can't tell apart
no measurement can. Constants are kept one after the other, those that the robot's file frees first, as long
as each brings a new direction; the others are redundant and may be removed, their error then shows in those
kept. A complete model of a serial arm with base and tool keeps 4R + 2P + 6 constants for R revolute and P
prismatic joints.

Sources: Meggiolaro & Dubowsky, An analytical method to eliminate the redundant parameters in robot
calibration, ICRA 2000; Everett, Driels, Mooring, Kinematic modelling for robot calibration, ICRA 1987 (the
number of a complete model).
"""

from dataclasses import dataclass

import numpy as np

from workbench.arm.confounded_constants import Combination, combinations
from workbench.arm.frame import FRAME_PARTS
from workbench.arm.joint_units import sliding
from workbench.arm.kinematics.forward import identification_jacobian
from workbench.arm.motion import Motion
from workbench.arm.parameters import Parameter
from workbench.arm.robot import Robot
from workbench.base.threads import one_thread
from workbench.identification.undetermined_combinations import factorise, independent_columns
from workbench.plate.poses.sampling import random_poses

GENERIC = 100
"""Random poses that stand for all."""
NOTHING_NEW = 1e-7
"""Part of a constant's twists, as a share of the largest, that the kept ones leave by rounding."""


@dataclass(frozen=True, kw_only=True)
class Redundancy:
    """The redundancy in a set of constants.

    Args:
        independent: Those kept, which suffice for all.
        redundant: Those that may be removed.
        combinations: What moves together without changing anything, in words; one for each redundant one.
    """

    names: tuple[str, ...]
    independent: tuple[str, ...]
    redundant: tuple[str, ...]
    combinations: tuple[Combination, ...]

    @property
    def rank(self) -> int:
        """Number of independent constants."""
        return len(self.independent)


@one_thread()
def redundancy(
    robot: Robot, names: tuple[str, ...] | None = None, *, frames: bool = False, points: bool = False
) -> Redundancy:
    """Find which constants of an arm are redundant.

    Args:
        names: Constants to look at; all of the arm's own if None.
        frames: Whether the six constants of base and of tool are looked at as well.
        points: Whether only the tool's place is measured, without its orientation.
    """
    own = tuple(e.name for e in robot.elements if e.matrix is None) if names is None else names
    around = tuple(f"{frame}.{part}" for frame in ("base", "tool") for part in FRAME_PARTS)
    names = (*own, *(around if frames else ()))
    q = random_poses(robot, GENERIC, rng=np.random.default_rng(0))
    twists = identification_jacobian(robot, Motion(q), names)[1][:, : 3 if points else 6]
    columns = twists.reshape(-1, len(names))
    free = set(robot.default_free)
    order = sorted(range(len(names)), key=lambda i: names[i] not in free)
    minimum = np.full(len(names), NOTHING_NEW * np.linalg.norm(columns, axis=0).max(initial=0.0))
    kept = {order[i] for i in independent_columns(columns[:, order], minimum)}
    null_space = factorise(columns, np.zeros(len(columns))).null_space
    elements = robot.chain.elements
    parameters = tuple(
        Parameter(n, elements[i].unit, elements[i].value, -np.inf, np.inf)
        for n, i in zip(names, robot.chain.indices(names), strict=True)
    )
    return Redundancy(
        names=names,
        independent=tuple(n for i, n in enumerate(names) if i in kept),
        redundant=tuple(n for i, n in enumerate(names) if i not in kept),
        combinations=combinations(null_space, parameters),
    )


def complete(robot: Robot) -> int:
    """Constants of a complete model with base and tool: 4R + 2P + 6."""
    lengths = int(sliding(robot).sum())
    return 4 * (robot.dof - lengths) + 2 * lengths + 6
