"""INFLUENCE: every pose corrects the constants separately, the most influential most (Katana eqs. 3.5–3.8).

At each pose the smallest change of constants that explains its residual is sought in small steps,

    ΔE = C Jᵀ(J Jᵀ)⁺ ΔP,      E ← E + k ∘ ΔE,      ΔP ← ΔP − J (k ∘ ΔE),      C < 1,

where k are the influences of the constants at that pose as shares of the maximum. The steps end when ΔP is
below the instrument's resolution. Their limit has a closed form without C, which is computed here,
with K = diag(k):

    E = K Jᵀ(J K Jᵀ)⁺ ΔP

(C affects the path only: each step multiplies the remaining ΔP by 1 − C J K Jᵀ(J Jᵀ)⁺.) With k = 1 this
is the thesis's standard identification. The constants "that best fit all measured poses" are the mean
over the poses times the best step length; all poses then start again from there, until the error no longer
decreases. Averaging projections is Cimmino's method: weakly observable constants converge last, and stay
near nominal if the rounds end early.

Influences are columns of J times the deviations of §3.5, to first order what it imposes on the constants.

Sources: Katana §§3.5, 3.6; Cimmino, La Ricerca Scientifica 9 (1938); Censor & Zenios, Parallel Optimization
(1997), §5 (mean of projections).
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.base.types import Outcome
from workbench.identification.algorithms.identifier import AbstractIdentifier, SearchOutcome, descend
from workbench.identification.problem import LinearisedProblem, Problem

DEGREE, MILLIMETRE = float(np.deg2rad(1.0)), 1e-3
"""Units in which constants are compared [rad], [m], as the thesis lists them."""
ANGLE, LENGTH_DEVIATION = 0.05 * DEGREE, 0.1 * MILLIMETRE
"""Deviations by whose motion of the tool constants have influence [rad], [m] (Katana §3.5)."""
RCOND = 1e-6
"""Singular values of one pose's J K Jᵀ below this share of its largest count as zero."""


@final
@dataclass(frozen=True)
class InfluenceBased(AbstractIdentifier):
    """Mean of each pose's own correction, weighted by influence.

    Args:
        weighted: Whether constants are weighted by their influence; if not, the thesis's standard
            identification (k = 1).
        gain: Minimum relative decrease of the cost in one round; the rounds end below it.
        limit: Maximum number of rounds.
    """

    weighted: bool = True
    gain: float = 1e-3
    limit: int = 500
    name = "influence"
    title = "INFLUENCE"
    summary = "Mean of each pose's own correction, weighted by how far a parameter moves the tool there."

    def search(self, problem: Problem, *, begin: Float[np.ndarray, " p"] | None = None) -> SearchOutcome:
        order = np.argsort(rows := problem.component_rows, kind="stable")
        _, starts, counts = np.unique(rows[order], return_index=True, return_counts=True)
        stacks = [order[starts[counts == c][:, None] + np.arange(c)] for c in np.unique(counts)]  # alike
        units = np.array([DEGREE if p.unit == "rad" else MILLIMETRE for p in problem.parameters])

        def averaged(x, at, factor, cost):
            step, decrease = self._round(at, stacks, units)
            if decrease < 2.0 * self.gain * cost:
                return Outcome.CONVERGED
            at = problem.evaluate(x + step)
            return x + step, 0.5 * float(at.residual @ at.residual), at

        return descend(problem, averaged, limit=self.limit)

    def _round(
        self, at: LinearisedProblem, stacks: list[np.ndarray], units: Float[np.ndarray, " p"]
    ) -> tuple[Float[np.ndarray, " p"], float]:
        """Mean of the poses' corrections times the best step length, and the predicted decrease of |r|²."""
        jacobian = at.jacobian * units
        deviations = np.where(units == MILLIMETRE, LENGTH_DEVIATION, ANGLE) / units
        own = [self._poses(jacobian[stack], at.residual[stack], deviations) for stack in stacks]
        step = np.concatenate(own).mean(axis=0)
        moved = jacobian @ step
        along = max(float(moved @ at.residual), 0.0)
        length = along / max(float(moved @ moved), 1e-300)
        return length * step * units, length * along

    def _poses(self, jacobian, residual, deviations) -> Float[np.ndarray, "rows p"]:
        """The correction that explains each pose on its own, in degrees and millimetres."""
        k = pose_weights(jacobian * deviations) if self.weighted else np.ones((len(jacobian), 1))
        weighted = jacobian * k[:, None]
        gram = weighted @ jacobian.transpose(0, 2, 1)
        pull = np.linalg.pinv(gram, rcond=RCOND, hermitian=True) @ residual[..., None]
        return (weighted.transpose(0, 2, 1) @ pull)[..., 0]


def pose_weights(moves: Float[np.ndarray, "rows m p"]) -> Float[np.ndarray, "rows p"]:
    """Influence k at each pose: how far the unit deviation moves it, relative to the maximum (Katana 3.6)."""
    lengths = np.linalg.norm(moves, axis=1)
    return lengths / np.maximum(lengths.max(axis=1, keepdims=True), 1e-300)
