"""How far joints scatter about what their motors read: play and slipping gears, from what a fit leaves.

    C = diag(s_p², s_r²) + σ² J Jᵀ        J the tool's twist per joint

is the covariance of a row's residual; the three sizes are those that make all residuals most likely, what
went into the fit's p unknowns taken off by N/(N−p). With it a fit weighs each row by what play can do to it,
and the intervals of its result hold.
"""

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize

from workbench.identification.problem import Noise

MIN_SIGMA = np.array([1e-4, 2e-4, 1e-4])
"""Smallest sizes: position [m], rotation [rad], joint [rad]."""


def joint_scatter(
    errors: Float[np.ndarray, "rows 6"], jacobian: Float[np.ndarray, "rows 6 n"], unknowns: int
) -> Noise:
    """The most likely sizes.

    Args:
        errors: What a fit leaves [m, rad].
        jacobian: Twist of the tool per joint.
        unknowns: Number of the fit's.
    """
    left = errors * np.sqrt(errors.size / max(errors.size - unknowns, 1))
    made = jacobian @ jacobian.swapaxes(1, 2)

    def cost(log: np.ndarray) -> float:
        variances = np.maximum(np.exp(2.0 * log), MIN_SIGMA**2)
        covariance = variances[2] * made + np.diag(np.repeat(variances[:2], 3))
        white = np.linalg.solve(covariance, left[..., None])[..., 0]
        return float(0.5 * (np.linalg.slogdet(covariance)[1] + (left * white).sum(1)).sum())

    size = np.sqrt((left**2).mean())
    begun = ([0.3 * size, size, 0.01 * size], [0.03 * size, 0.1 * size, 0.5 * size])
    found = min((minimize(cost, np.log(b), method="Nelder-Mead") for b in begun), key=lambda f: f.fun)
    position, rotation, joint = np.maximum(np.exp(found.x), MIN_SIGMA).tolist()
    return Noise(position, rotation, (joint,) * jacobian.shape[2])
