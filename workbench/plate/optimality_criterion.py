"""Criteria: costs to be minimised by a choice of measurements, functions of its information matrix alone.

The information of a set is the Gram matrix G = Σ AᵢᵀAᵢ of its scaled, whitened Jacobian. Leaving a
measurement out and putting another one in adds and takes two small products, so an exchange needs no
Jacobian of the whole set. A criterion takes a stack of Gram matrices and gives one cost for each; its slope
S = ∂cost/∂G tells which of many exchanges can help: to first order the cost changes by ⟨S, BᵀB − AᵀA⟩. For
costs that are convex in G (all but those of O2 and O4) no exchange does better than this.
"""

from abc import ABC, abstractmethod
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.linearisation import Linearisation
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.plate.free_constants import visible_weight
from workbench.plate.observability import AbstractIndex, I, SetIndex, index_named
from workbench.plate.predicted_error import position_weight

Grams = Float[np.ndarray, "sets p p"]

RIDGE = 1e-12
"""Share of its mean diagonal added to a Gram matrix, so that a set below full rank has a large finite
cost."""


class AbstractCriterion(ABC):
    """A cost of information, smaller is better."""

    @abstractmethod
    def __call__(self, grams: Grams) -> Float[np.ndarray, " sets"]:
        """The cost of each Gram matrix."""

    @abstractmethod
    def slope(self, gram: Float[np.ndarray, "p p"]) -> Float[np.ndarray, "p p"]:
        """∂cost/∂G at one Gram matrix."""


@final
class IndexCriterion(AbstractCriterion):
    """Minus an index of sets of so many measurements."""

    def __init__(self, index: SetIndex, measurements: int):
        self.index, self.measurements = index, measurements

    def __call__(self, grams: Grams) -> Float[np.ndarray, " sets"]:
        spectra = np.sqrt(np.clip(np.linalg.eigvalsh(_ridged(grams))[:, ::-1], 1e-300, None))
        return -self.index.of_spectra(spectra, self.measurements)

    def slope(self, gram: Float[np.ndarray, "p p"]) -> Float[np.ndarray, "p p"]:
        squares, vectors = np.linalg.eigh(_ridged(gram[None])[0])
        values = np.sqrt(np.clip(squares, 1e-300, None))
        pull = self.index.slope(values[::-1], self.measurements)[::-1] / (2.0 * values)
        return -(vectors * pull) @ vectors.T


@final
class RegionCriterion(AbstractCriterion):
    """√trace(W G⁻¹): root mean square predicted position error [m]."""

    def __init__(self, weight: Float[np.ndarray, "p p"]):
        """Of W for the parameters that the Gram matrices are of [m²]."""
        self.weight = weight

    def __call__(self, grams: Grams) -> Float[np.ndarray, " sets"]:
        return np.sqrt((np.linalg.inv(_ridged(grams)) * self.weight).sum((1, 2)))

    def slope(self, gram: Float[np.ndarray, "p p"]) -> Float[np.ndarray, "p p"]:
        inverse = np.linalg.inv(_ridged(gram[None])[0])
        return -inverse @ self.weight @ inverse / (2.0 * np.sqrt((inverse * self.weight).sum()))


def goal_index(
    goal: Float[np.ndarray, "rows n"] | str,
    robot: Robot,
    linearisation: Linearisation,
    basis: Float[np.ndarray, "p r"] | None = None,
) -> AbstractIndex:
    """The index for a goal: I over evaluation poses, or one by name.

    Args:
        goal: Joint positions of evaluation poses [rad or m], or the name of an index.
        robot: Geometry at which those poses are linearised.
        linearisation: Of any measurements; says what is identified, and how it is scaled.
        basis: Combinations of scaled parameters that the index is of, see `plate.free_constants`.
    """
    if isinstance(goal, str):
        return index_named(goal)
    weight = position_weight(robot, goal, linearisation.names, linearisation.weights)
    return I(visible_weight(weight, basis))


def criterion_of(index: AbstractIndex, measurements: int) -> AbstractCriterion:
    """The cost whose minimisation maximises an index."""
    if isinstance(index, I):
        return RegionCriterion(index.weight)
    if not isinstance(index, SetIndex):
        raise OptionError(
            f"index {index.name} looks at single poses; choose by O1 … O5, A, D or I",
            option="index",
            found=index.name,
        )
    return IndexCriterion(index, measurements)


def _ridged(grams: Grams) -> Grams:
    size = grams.shape[-1]
    mean = np.trace(grams, axis1=1, axis2=2) / size
    return grams + RIDGE * mean[:, None, None] * np.eye(size)
