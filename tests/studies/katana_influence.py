"""Influence of each constant on the tool's position, pose by pose (Katana §3.5).

The deviation of `influence_based` is imposed on one constant at a time, and the motion of the tool is its
influence. The weights k of a pose are its influences as shares of the maximum:

    e_i(q) = |p(q; φ + δ_i) − p(q; φ)|,      k_i(q) = e_i(q) / max_j e_j(q)
"""

from dataclasses import dataclass

import numpy as np

from workbench import Motion, Robot, tool_poses
from workbench.identification.algorithms.influence_based import ANGLE, LENGTH_DEVIATION


@dataclass(frozen=True, eq=False, kw_only=True)
class Influence:
    """Motion of the tool for the deviation of each constant: `distances` (rows, p) [m]."""

    names: tuple[str, ...]
    distances: np.ndarray

    @property
    def weights(self) -> np.ndarray:
        """k of every pose (Katana §3.6); zero where nothing moves."""
        maximum = self.distances.max(axis=1, keepdims=True)
        return self.distances / np.where(maximum > 0.0, maximum, 1.0)

    @property
    def mean(self) -> np.ndarray:
        """Of each constant over the poses [m]."""
        return self.distances.mean(axis=0)


def with_errors(robot: Robot, names: tuple[str, ...], errors: np.ndarray) -> Robot:
    """The arm whose constants are off by so much."""
    return robot.with_values(dict(zip(names, (robot.values(names) + errors).tolist(), strict=True)))


def influence(robot: Robot, motion: Motion, *, names: tuple[str, ...]) -> Influence:
    """Impose the deviation on each constant and compute the tool's motion."""
    elements, here = robot.chain.elements, tool_poses(robot, motion)[:, :3, 3]
    sizes = [ANGLE if elements[i].axis.turns else LENGTH_DEVIATION for i in robot.chain.indices(names)]
    changed = zip(names, robot.values(names) + sizes, strict=True)
    moved = [tool_poses(robot.with_values({n: float(v)}), motion)[:, :3, 3] - here for n, v in changed]
    return Influence(names=names, distances=np.linalg.norm(np.stack(moved, axis=1), axis=-1))
