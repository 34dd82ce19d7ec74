"""Criteria: what a choice of measurements is to make small, as a function of its information alone.

The information of a set is the Gram matrix G = Σ AᵢᵀAᵢ of its scaled, whitened Jacobian. Leaving a
measurement out and putting another one in adds and takes two small products, so an exchange needs no
Jacobian of the whole set. A criterion takes a stack of Gram matrices and gives one cost for each.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from workbench.design.accuracy import position_weight
from workbench.design.freedom import visible_weight
from workbench.design.indices import AbstractSetIndex
from workbench.robots.robot import Robot

Grams = Float[np.ndarray, "sets p p"]
Criterion = Callable[[Grams], Float[np.ndarray, " sets"]]

RIDGE = 1e-12
"""Share of its mean diagonal added to a Gram matrix, so that a set below full rank is merely very bad."""


def index_criterion(index: AbstractSetIndex, measurements: int) -> Criterion:
    """Minus the index of sets of so many measurements."""

    def cost(grams: Grams) -> Float[np.ndarray, " sets"]:
        spectra = np.sqrt(np.clip(np.linalg.eigvalsh(_ridged(grams))[:, ::-1], 1e-300, None))
        return -index.of_spectra(spectra, measurements)

    return cost


def region_criterion(
    robot: Robot,
    q_region: Float[np.ndarray, "rows n"],
    names: tuple[str, ...],
    weights: Float[np.ndarray, " p"],
    basis: Float[np.ndarray, "p r"] | None = None,
) -> Criterion:
    """Root mean square predicted position error over poses that matter [m]: I-optimality.

    Args:
        robot: Geometry at which the poses are linearised.
        q_region: Joint positions of those poses [rad or m].
        names: The identified parameters.
        weights: Scaling of the parameters, as in `Linearisation.weights`.
        basis: Combinations of scaled parameters that the Gram matrices are of, see `design.freedom`.
    """
    weight = visible_weight(position_weight(robot, q_region, names, weights), basis)

    def cost(grams: Grams) -> Float[np.ndarray, " sets"]:
        return np.sqrt((np.linalg.inv(_ridged(grams)) * weight).sum((1, 2)))

    return cost


def _ridged(grams: Grams) -> Grams:
    size = grams.shape[-1]
    mean = np.trace(grams, axis1=1, axis2=2) / size
    return grams + RIDGE * mean[:, None, None] * np.eye(size)
