"""Gradient ascent of an index over poses, within joint limits and other constraints.

The gradient by the joint positions is that of the index by the Jacobian's entries, through central
differences of the Jacobian. Free poses climb log(index) by L-BFGS within the joint limits. Poses that must
stay in a region, apart from each other or within a maximum travel climb by steps along the gradient, in
which every pose that would violate its limits keeps its place.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.optimize import Bounds, minimize

from workbench.arm.linearisation import Linearisation, linearise
from workbench.arm.robot import Robot
from workbench.base.progress import Cancelled, cancelled, check_cancelled
from workbench.base.types import Outcome
from workbench.extras.poses.pose_limits import PoseLimits
from workbench.plate.free_constants import visible
from workbench.plate.observability import AbstractIndex

DIFFERENCE = 1e-5
"""Half-width of the central differences of the Jacobian [rad or m]; their error is about 1e-10."""
POLISH_STEPS = 100
"""Maximum number of steps of the continuous improvement."""
STRIDE = 0.1
"""First stride of poses with limits [rad or m]."""
MIN_STRIDE = 1e-4
"""Minimum stride of poses with limits [rad or m]."""

Climbed = tuple[np.ndarray, list[float], Outcome]


@dataclass(frozen=True, eq=False)
class PoseClimb:
    """An index of an arm's poses as a function of their joint positions.

    Args:
        index: The index to maximise.
        options: Of `linearise`: names, standard deviations.
        basis: Combinations of constants that the index is of, see `plate.free_constants`.
    """

    robot: Robot
    index: AbstractIndex
    options: dict
    basis: Float[np.ndarray, "p r"] | None = None

    def at(self, q: Float[np.ndarray, "rows n"]) -> Linearisation:
        return visible(linearise(self.robot, q, **self.options), self.basis)

    def value(self, q: Float[np.ndarray, "rows n"]) -> float:
        return self.index.value(self.at(q))

    def value_and_gradient(self, q: Float[np.ndarray, "rows n"]) -> tuple[float, Float[np.ndarray, "rows n"]]:
        linearisation = self.at(q)
        rows, joints = q.shape
        outer = self.index.gradient(linearisation).reshape(rows, -1)
        moved = q[None, :, None, :] + DIFFERENCE * np.array([1.0, -1.0])[:, None, None, None] * np.eye(joints)
        near = self.at(moved.reshape(-1, joints)).jacobian
        plus, minus = near.reshape(2, rows, joints, -1)
        slope = np.einsum("rjk,rk->rj", plus - minus, outer) / (2.0 * DIFFERENCE)
        return self.index.value(linearisation), slope

    def climb(self, q: Float[np.ndarray, "rows n"]) -> Climbed:
        """Local maximum of log(index) within the joint limits, from q; q itself if nothing is better."""
        start = self.value(q)
        best, history = (start, q), [start]
        if start <= 0.0:
            return q, history, Outcome.STALLED
        low, high = np.tile(self.robot.search_limits.T[:, None], (1, len(q), 1)).reshape(2, -1)

        def fall(x: np.ndarray) -> tuple[float, np.ndarray]:
            nonlocal best
            check_cancelled()
            trial = x.reshape(q.shape)
            value, slope = self.value_and_gradient(trial)
            if value > best[0]:
                best = (value, trial.copy())
            if value <= 0.0:
                return 1e3, np.zeros_like(x)
            return -np.log(value), -slope.ravel() / value

        try:
            found = minimize(
                fall,
                q.ravel(),
                jac=True,
                method="L-BFGS-B",
                bounds=Bounds(low, high),
                options={"maxiter": POLISH_STEPS},
                callback=lambda _: history.append(best[0]),
            )
            outcome = {0: Outcome.CONVERGED, 1: Outcome.ITERATION_LIMIT}.get(found.status, Outcome.STALLED)
        except Cancelled:
            outcome = Outcome.CANCELLED
        return best[1], [*history, best[0]], outcome

    def climb_within(self, q: Float[np.ndarray, "rows n"], limits: PoseLimits) -> Climbed:
        """The same for an ordered set of poses with limits, which they keep."""
        value, slope = self.value_and_gradient(q)
        history, stride = [value], STRIDE
        for _ in range(POLISH_STEPS):
            if cancelled():
                return q, history, Outcome.CANCELLED
            steepest = np.abs(slope).max()
            if not steepest > 0:
                break
            trial = self._stay(q, q + stride * slope / steepest, limits)
            if self.value(trial) > value * (1.0 + 1e-9):
                q, stride = trial, 2.0 * stride
                value, slope = self.value_and_gradient(q)
                history.append(value)
            elif stride <= MIN_STRIDE:
                return q, history, Outcome.CONVERGED
            else:
                stride = 0.3 * stride
        return q, history, Outcome.ITERATION_LIMIT

    def _stay(self, q: np.ndarray, trial: np.ndarray, limits: PoseLimits) -> np.ndarray:
        """The trial with every pose that violates a limit put back; the previous poses keep all."""
        low, high = self.robot.search_limits.T
        trial = np.clip(trial, low, high)
        back = np.zeros(len(q), bool)
        while (wrong := ~limits.keeps(self.robot, trial) & ~back).any():
            back |= wrong
            trial[wrong] = q[wrong]
        return trial
