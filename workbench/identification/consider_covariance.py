"""Covariance for residuals that scatter differently from their weights, and for uncertain held constants."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.identification.problem import Noise, Problem


def covariance(
    problem: Problem, x: Float[np.ndarray, " p"], root: Float[np.ndarray, "p r"], actual: Noise
) -> Float[np.ndarray, "p p"]:
    """Covariance of an estimate whose residuals scatter differently from how they were weighted (sandwich).

    Args:
        problem: With the weights that were used, x its solution.
        root: Square root of the covariance if residuals scattered as weighted.
        actual: Standard deviations with which they actually scatter.
    """
    known = problem.prior @ root
    middle = known.T @ known
    for (_, piece), block in zip(problem.pieces(x), problem.with_noise(actual).blocks, strict=True):
        moved = piece.jacobian @ root
        table = moved.reshape(*block.inverse_sigma.shape, -1)
        spread = block.mixed(table, 1.0).reshape(moved.shape)
        middle += moved.T @ spread * (actual.own / problem.noise.own) ** 2
    return root @ middle @ root.T


@dataclass(frozen=True, eq=False)
class Considered:
    """Uncertain constants held at nominal: their errors bias the estimates of the others (consider
    covariance).

    With J and K the Jacobians of the unknowns and of these constants, the estimate errs by S = −(JᵀJ)⁻¹JᵀK
    per unit error of each constant, so that S D² Sᵀ is added to its covariance.

    Args:
        problem: With these constants free as well.
        deviations: Standard deviation of each held constant; 0 for the estimated unknowns.

    Source: Schmidt, Application of state-space methods to navigation problems, Advances in Control Systems 3,
    1966.
    """

    problem: Problem
    deviations: Float[np.ndarray, " p"]

    def covariance(
        self, names: tuple[str, ...], x: Float[np.ndarray, " k"], root: Float[np.ndarray, "k r"]
    ) -> Float[np.ndarray, "k k"]:
        """Contribution to the covariance root rootᵀ of these estimates."""
        places, everything = [self.problem.names.index(n) for n in names], self.problem.start.copy()
        everything[places] = x
        jacobian = self.problem.evaluate(everything).jacobian
        inside = self.deviations > 0.0
        known = jacobian[:, inside] * self.deviations[inside]
        deflected = root @ (root.T @ (jacobian[:, places].T @ known))
        return deflected @ deflected.T
