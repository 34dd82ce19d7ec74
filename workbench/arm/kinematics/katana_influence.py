"""Influence of each constant on the tool's position, pose by pose (Katana §3.5).

A deviation is imposed on one constant at a time, +0.05° on an angle and +0.1 mm on a length, and the motion
of the tool is its influence. A length moves it by its own deviation everywhere; an angle by its lever arm, so
that its influence depends on the configuration. The weights k of a pose are its influences as shares of the
maximum:

    e_i(q) = |p(q; φ + δ_i) − p(q; φ)|,      k_i(q) = e_i(q) / max_j e_j(q)
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.types import frozen

ANGLE = float(np.deg2rad(0.05))
"""Deviation imposed on an angle [rad], Katana §3.5."""
LENGTH_DEVIATION = 1e-4
"""Deviation imposed on a length [m], Katana §3.5."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Influence:
    """Motion of the tool for a standard deviation of each constant.

    Args:
        distances: At each pose for each constant [m].
    """

    names: tuple[str, ...]
    distances: Float[np.ndarray, "rows p"]

    @property
    def weights(self) -> Float[np.ndarray, "rows p"]:
        """k of every pose: shares of its maximum influence (Katana §3.6); zero where nothing moves."""
        maximum = self.distances.max(axis=1, keepdims=True)
        return self.distances / np.where(maximum > 0.0, maximum, 1.0)

    @property
    def minimum(self) -> Float[np.ndarray, " p"]:
        """Minimum influence of each constant over the poses [m]."""
        return self.distances.min(axis=0)

    @property
    def mean(self) -> Float[np.ndarray, " p"]:
        """Mean influence of each constant over the poses [m]."""
        return self.distances.mean(axis=0)

    @property
    def maximum(self) -> Float[np.ndarray, " p"]:
        """Maximum influence of each constant over the poses [m]."""
        return self.distances.max(axis=0)


def influence(
    robot: Robot,
    motion: Motion,
    *,
    names: tuple[str, ...] | None = None,
    angle: float = ANGLE,
    length: float = LENGTH_DEVIATION,
) -> Influence:
    """Impose a deviation on each constant and compute the tool's motion.

    Args:
        names: Constants; the robot's default free ones if None.
        angle: Deviation of an angle [rad].
        length: Deviation of a length [m].
    """
    names = robot.default_free if names is None else names
    elements = robot.chain.elements
    turns = np.array([elements[i].axis.turns for i in robot.chain.indices(names)], bool)
    deviated = robot.values(names) + np.where(turns, angle, length)
    here = tool_poses(robot, motion)[:, :3, 3]
    moved = [
        tool_poses(robot.with_values({name: float(value)}), motion)[:, :3, 3] - here
        for name, value in zip(names, deviated, strict=True)
    ]
    return Influence(names=names, distances=frozen(np.linalg.norm(np.stack(moved, axis=1), axis=-1)))
