"""Observability indices: how well measurements determine the parameters, as one number; larger is better.

O (ARIA eq. 17) is of single poses: how evenly a pose alone determines its observable combinations. It uses
the unscaled Jacobian, as in the paper, which mixes metres and radians. A pose has six rows, so of p > 6
parameters it shows six combinations, and σ1 … σ6 are meant. For a set O is the mean over its poses and says
nothing about the set as a whole: ten identical poses of high O show six combinations only.

O1 … O5 are of a whole set, by the singular values σ1 ≥ … ≥ σp of its scaled, whitened Jacobian
(see `workbench.arm.linearisation` for the scaling). Each is zero where a parameter can't be seen.
Their gradient comes from dσ_k = u_kᵀ dJ v_k. Choosing poses by O1 does not depend on units: scaling
rows or columns multiplies them by a constant. O2 is the same for rows all scaled alike and for poses that
are added again, and changes with single columns; added measurements never lower O3 and O5.

I is of a set and a region. It comes with the robot and poses that matter, so it is made where it is needed:
`goal_index(…)`.

A choice of measurements maximises an index of sets by their information, the Gram matrix G = Σ AᵢᵀAᵢ of the
scaled, whitened Jacobian: leaving a measurement out and putting another one in adds and takes two small
products. The slope S = ∂index/∂G tells which of many exchanges can help: to first order the index changes by
⟨S, BᵀB − AᵀA⟩. Where the index is concave in G (all but O2 and O4) no exchange does better than this.

A new index of sets is a `SetIndex`, any other one a small class, with an entry in `INDICES`.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.linearisation import RANK_TOLERANCE, Linearisation
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.base.types import frozen
from workbench.plate.free_constants import visible_weight
from workbench.plate.predicted_error import blocks, position_weight

MIN_GRAM_INDEX = 1e-3
"""Above this value O from J Jᵀ has at least ten correct digits; below it the slower SVD is used."""

Spectra = Float[np.ndarray, "sets p"]
Grams = Float[np.ndarray, "sets p p"]
RIDGE = 1e-12
"""Share of its mean diagonal added to a Gram matrix, so that a set below full rank has some index."""


class AbstractIndex(ABC):
    """An observability index: a number for a linearisation, larger is better.

    Attributes:
        name: Its short name in the registry and on the command line.
        meaning: What it measures, in a few words for people.
        source: Where it was proposed.
    """

    name: str
    meaning: str
    source: str

    @abstractmethod
    def value(self, linearisation: Linearisation) -> float:
        """The index."""

    @abstractmethod
    def gradient(self, linearisation: Linearisation) -> Float[np.ndarray, "m p"]:
        """Its derivative by each entry of the whitened Jacobian `linearisation.jacobian`."""


class AbstractSetIndex(AbstractIndex):
    """An index of a whole set, whose information alone tells it."""

    @abstractmethod
    def of_grams(self, grams: Grams, measurements: int) -> Float[np.ndarray, " sets"]:
        """The index of each Gram matrix, of sets of so many measurements."""

    @abstractmethod
    def slope(self, gram: Float[np.ndarray, "p p"], measurements: int) -> Float[np.ndarray, "p p"]:
        """∂index/∂G at one Gram matrix."""

    def gradient(self, linearisation: Linearisation) -> Float[np.ndarray, "m p"]:
        if linearisation.rank() < len(linearisation.names):
            return np.zeros_like(linearisation.jacobian)
        scaled = linearisation.scaled
        slope = self.slope(scaled.T @ scaled, linearisation.measurements)
        return 2.0 * scaled @ slope * linearisation.weights


@final
@dataclass(frozen=True, eq=False)
class SetIndex(AbstractSetIndex):
    """An index of the singular values of a whole set of measurements.

    Args:
        of_spectrum: From full-rank spectra (rows, largest value first) and the number of measurements in each
            set, the index of each.
        by_value: From the index, one spectrum and the number of measurements, its derivative by each singular
            value.
    """

    name: str
    meaning: str
    source: str
    of_spectrum: Callable[[Spectra, int], Float[np.ndarray, " sets"]]
    by_value: Callable[[float, Float[np.ndarray, " p"], int], Float[np.ndarray, " p"]]

    def of_grams(self, grams: Grams, measurements: int) -> Float[np.ndarray, " sets"]:
        spectra = np.sqrt(np.clip(np.linalg.eigvalsh(_ridged(grams))[:, ::-1], 1e-300, None))
        seen = spectra[:, -1] > RANK_TOLERANCE * spectra[:, 0]  # zero for those below full rank
        safe = np.where(seen[:, None], spectra, 1.0)
        return np.where(seen, self.of_spectrum(safe, max(measurements, 1)), 0.0)

    def slope(self, gram: Float[np.ndarray, "p p"], measurements: int) -> Float[np.ndarray, "p p"]:
        squares, vectors = np.linalg.eigh(_ridged(gram))
        values = np.sqrt(np.clip(squares, 1e-300, None))
        spectrum = values[::-1]
        value = float(self.of_spectrum(spectrum[None], measurements)[0])
        pull = self.by_value(value, spectrum, measurements)[::-1] / (2.0 * values)
        return (vectors * pull) @ vectors.T

    def value(self, linearisation: Linearisation) -> float:
        if linearisation.rank() < len(linearisation.names):
            return 0.0
        return float(self.of_spectrum(linearisation.singular_values[None], linearisation.measurements)[0])


def inverse_condition(jacobians: Float[np.ndarray, "rows r p"]) -> Float[np.ndarray, " rows"]:
    """O of each pose from its unscaled Jacobian; zero where all singular values are."""
    squares = np.linalg.eigvalsh(jacobians @ jacobians.transpose(0, 2, 1))
    tiny = np.finfo(float).tiny
    result = np.sqrt(np.maximum(squares[:, 0], 0.0) / np.maximum(squares[:, -1], tiny))
    flat = result < MIN_GRAM_INDEX
    if flat.any():
        values = np.linalg.svd(jacobians[flat], compute_uv=False)
        result[flat] = values[:, -1] / np.maximum(values[:, 0], tiny)
    return result


@final
class O(AbstractIndex):  # noqa: E742 - the paper's name
    """Inverse condition number of single poses, unscaled; for a set their mean."""

    name = "O"
    meaning = "inverse condition number of each pose alone, mean over the poses, unscaled"
    source = "ARIA eq. (17), after Borm & Menq, Int. J. Robotics Research 10(1), 1991"

    def value(self, linearisation: Linearisation) -> float:
        values = self.per_pose(linearisation)
        return float(values.mean()) if len(values) else 0.0

    def per_pose(self, linearisation: Linearisation) -> Float[np.ndarray, " measurements"]:
        result = np.zeros(linearisation.measurements)
        for poses, rows in blocks(linearisation):
            result[poses] = inverse_condition(linearisation.unwhitened[rows])
        return result

    def gradient(self, linearisation: Linearisation) -> Float[np.ndarray, "m p"]:
        gradient = np.zeros_like(linearisation.jacobian)
        for _, rows in blocks(linearisation):
            u, values, vt = np.linalg.svd(linearisation.unwhitened[rows], full_matrices=False)
            minimum, maximum = values[:, -1], np.maximum(values[:, 0], np.finfo(float).tiny)
            by_minimum = u[:, :, -1, None] * vt[:, None, -1] / maximum[:, None, None]
            by_maximum = u[:, :, 0, None] * vt[:, None, 0] * (minimum / maximum**2)[:, None, None]
            gradient[rows] = by_minimum - by_maximum
        return gradient * (linearisation.sigma[:, None] / max(linearisation.measurements, 1))


def _ends(spectrum: Float[np.ndarray, " p"], minimum: float, maximum: float = 0.0) -> Float[np.ndarray, " p"]:
    """A derivative by the minimum and the maximum singular value alone."""
    slope = np.zeros_like(spectrum)
    slope[-1] += minimum
    slope[0] += maximum
    return slope


_OF_SETS = (
    SetIndex(  # the volume of the ellipsoid that the parameters' unit ball becomes
        "O1",
        "geometric mean of the singular values: overall information (D-optimality)",
        "Borm & Menq, Int. J. Robotics Research 10(1), 1991",
        of_spectrum=lambda s, m: np.exp(np.log(s).mean(-1)) / np.sqrt(m),
        by_value=lambda value, s, m: value / (len(s) * s),
    ),
    SetIndex(  # bounds how much relative errors of the measurements can grow in the parameters
        "O2",
        "inverse condition number: how evenly the parameters are determined",
        "Driels & Pathre, J. Robotic Systems 7(2), 1990",
        of_spectrum=lambda s, m: s[:, -1] / s[:, 0],
        by_value=lambda value, s, m: _ends(s, 1.0 / s[0], -s[-1] / s[0] ** 2),
    ),
    SetIndex(
        "O3",
        "smallest singular value: the worst determined combination (E-optimality) [1/m]",
        "Nahvi, Hollerbach & Hayward, IEEE Int. Conf. Robotics and Automation, 1994",
        of_spectrum=lambda s, m: s[:, -1],
        by_value=lambda value, s, m: _ends(s, 1.0),
    ),
    SetIndex(  # a large and a round ellipsoid
        "O4",
        "noise amplification index: O2 times O3 [1/m]",
        "Nahvi & Hollerbach, IEEE Int. Conf. Robotics and Automation, 1996",
        of_spectrum=lambda s, m: s[:, -1] ** 2 / s[:, 0],
        by_value=lambda value, s, m: _ends(s, 2.0 * s[-1] / s[0], -((s[-1] / s[0]) ** 2)),
    ),
    SetIndex(  # near to A-optimality, which sums 1/σ²
        "O5",
        "inverse sum of inverse singular values (close to A-optimality) [1/m]",
        "Sun & Hollerbach, IEEE Int. Conf. Robotics and Automation, 2008",
        of_spectrum=lambda s, m: 1.0 / (1.0 / s).sum(-1),
        by_value=lambda value, s, m: (value / s) ** 2,
    ),
)


@final
class I(AbstractSetIndex):  # noqa: E742 - the literature's name
    """1/√trace(W C), C = (JᵀJ)⁻¹: inverse root mean square position error predicted over poses that matter.

    With W = mean of J_p(q)ᵀ J_p(q) over these poses, trace(W C) is the mean square position error there for
    the instrument's noise, so 1/I is the number that users care about, in metres.
    """

    name = "I"
    meaning = "inverse predicted position error over the region (I-optimality) [1/m]"
    source = "Atkinson, Donev & Tobias, Optimum Experimental Designs (2007), §10.6"

    def __init__(self, weight: Float[np.ndarray, "p p"]):
        """The index for a W of the scaled parameters [m² per m²], see `predicted_error.position_weight`."""
        self.weight = frozen(weight)

    def of_grams(self, grams: Grams, measurements: int) -> Float[np.ndarray, " sets"]:
        return (np.linalg.inv(_ridged(grams)) * self.weight).sum((1, 2)) ** -0.5

    def slope(self, gram: Float[np.ndarray, "p p"], measurements: int) -> Float[np.ndarray, "p p"]:
        inverse = np.linalg.inv(_ridged(gram))
        return 0.5 * (inverse * self.weight).sum() ** -1.5 * inverse @ self.weight @ inverse

    def value(self, linearisation: Linearisation) -> float:
        if linearisation.rank() < len(linearisation.names):
            return 0.0
        _, values, vt = linearisation.factors
        root = vt.T / values  # whose square is C of the scaled parameters
        return float(((self.weight @ root) * root).sum() ** -0.5)


def _ridged(grams: Float[np.ndarray, "*sets p p"]) -> Float[np.ndarray, "*sets p p"]:
    mean = np.trace(grams, axis1=-2, axis2=-1) / grams.shape[-1]
    return grams + RIDGE * mean[..., None, None] * np.eye(grams.shape[-1])


INDICES: dict[str, AbstractIndex] = {index.name: index for index in (O(), *_OF_SETS)}
"""All indices that need no region, by name; `I` is created for one."""


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
        if goal not in INDICES:
            known = ", ".join(INDICES)
            raise OptionError(f"unknown index '{goal}'; known: {known}", option="index", found=goal)
        return INDICES[goal]
    weight = position_weight(robot, goal, linearisation.names, linearisation.weights)
    return I(visible_weight(weight, basis))
