"""Covariance of an answer whose residuals scatter otherwise than weighed, or whose other constants err."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.identification.problem import Noise, Problem


def covariance(
    problem: Problem, x: Float[np.ndarray, " p"], root: Float[np.ndarray, "p r"], actual: Noise
) -> Float[np.ndarray, "p p"]:
    """Covariance of an answer for residuals that scatter otherwise than they were weighed.

    Args:
        problem: As it was weighed.
        x: Its answer.
        root: Square root of the covariance if they scattered as weighed.
        actual: How they scatter.
    """
    middle = np.zeros((root.shape[1], root.shape[1]))
    for block, piece in problem.pieces(x):
        moved = piece.jacobian @ root
        spread = moved
        if block is not None:
            scattered = block.with_noise(problem.data.take(block.rows), actual)
            table = moved.reshape(*block.inverse_sigma.shape, -1)
            spread = scattered.mixed(table, 1.0).reshape(moved.shape) * (actual.own / problem.noise.own) ** 2
        middle += moved.T @ spread
    return root @ middle @ root.T


@dataclass(frozen=True, eq=False)
class Considered:
    """Constants that stay nominal, though they are known only so well: their errors bend the others.

    With J and K the Jacobians of the unknowns and of these constants, the answer errs by S = −(JᵀJ)⁻¹JᵀK for
    a unit error of each, so that S D² Sᵀ joins its covariance.

    Args:
        problem: With these constants free as well.
        deviations: Standard deviation of each of its unknowns that is only considered; 0 of the others.

    Source: Schmidt, Application of state-space methods to navigation problems, Advances in Control Systems 3,
    1966.
    """

    problem: Problem
    deviations: Float[np.ndarray, " p"]

    def covariance(
        self, names: tuple[str, ...], x: Float[np.ndarray, " k"], root: Float[np.ndarray, "k r"]
    ) -> Float[np.ndarray, "k k"]:
        """What it adds to the covariance root rootᵀ of these unknowns at their answer."""
        places, everything = [self.problem.names.index(n) for n in names], self.problem.start.copy()
        everything[places] = x
        jacobian = self.problem.evaluate(everything).jacobian
        inside = self.deviations > 0.0
        known = jacobian[:, inside] * self.deviations[inside]
        deflected = root @ (root.T @ (jacobian[:, places].T @ known))
        return deflected @ deflected.T
