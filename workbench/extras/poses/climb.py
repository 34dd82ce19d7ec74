"""Gradient ascent of an index over poses, within joint limits.

The gradient by the joint positions is that of the index by the Jacobian's entries, through central
differences of the Jacobian. Poses climb log(index) by L-BFGS.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.optimize import Bounds, minimize

from workbench.arm.linearisation import Linearisation, linearise
from workbench.arm.robot import Robot
from workbench.base.progress import Cancelled, check_cancelled
from workbench.base.types import Outcome
from workbench.plate.free_constants import visible
from workbench.plate.observability import AbstractIndex

DIFFERENCE = 1e-5
"""Half-width of the central differences of the Jacobian [rad or m]; their error is about 1e-10."""
POLISH_STEPS = 100
"""Maximum number of steps of the continuous improvement."""


@dataclass(frozen=True, eq=False)
class PoseClimb:
    """An index of an arm's poses as a function of their joint positions.

    Args:
        index: The index to maximise.
        names: Constants to be identified; the default free ones if None.
        basis: Combinations of constants that the index is of, see `plate.free_constants`.
    """

    robot: Robot
    index: AbstractIndex
    names: tuple[str, ...] | None = None
    basis: Float[np.ndarray, "p r"] | None = None

    def at(self, q: Float[np.ndarray, "rows n"]) -> Linearisation:
        return visible(linearise(self.robot, q, names=self.names), self.basis)

    def value(self, q: Float[np.ndarray, "rows n"]) -> float:
        return self.index.value(self.at(q))

    def value_and_gradient(self, q: Float[np.ndarray, "rows n"]) -> tuple[float, Float[np.ndarray, "rows n"]]:
        linearisation = self.at(q)
        rows, joints = q.shape
        outer = self.index.gradient(linearisation).reshape(rows, -1)
        moved = q[None, :, None, :] + DIFFERENCE * np.array([1.0, -1.0])[:, None, None, None] * np.eye(joints)
        plus, minus = self.at(moved.reshape(-1, joints)).jacobian.reshape(2, rows, joints, -1)
        slope = np.einsum("rjk,rk->rj", plus - minus, outer) / (2.0 * DIFFERENCE)
        return self.index.value(linearisation), slope

    def climb(self, q: Float[np.ndarray, "rows n"]) -> tuple[Float[np.ndarray, "rows n"], Outcome]:
        """Local maximum of log(index) within the joint limits, from q; q itself if nothing is better."""
        best, highest = q, self.value(q)
        if highest <= 0.0:
            return q, Outcome.STALLED
        low, high = np.tile(self.robot.search_limits.T[:, None], (1, len(q), 1)).reshape(2, -1)

        def fall(x: np.ndarray) -> tuple[float, np.ndarray]:
            nonlocal best, highest
            check_cancelled()
            value, slope = self.value_and_gradient(x.reshape(q.shape))
            if value > highest:
                best, highest = x.reshape(q.shape).copy(), value
            if value <= 0.0:
                return 1e3, np.zeros_like(x)
            return -np.log(value), -slope.ravel() / value

        options, bounds = {"maxiter": POLISH_STEPS}, Bounds(low, high)
        try:
            found = minimize(fall, q.ravel(), jac=True, method="L-BFGS-B", bounds=bounds, options=options)
        except Cancelled:
            return best, Outcome.CANCELLED
        endings = {0: Outcome.CONVERGED, 1: Outcome.ITERATION_LIMIT}
        return best, endings.get(found.status, Outcome.STALLED)
