"""What a fit hands back: parameters with standard errors, and what the rows could not see.

Everything here is computed at the answer from one factorisation, whichever algorithm found it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from workbench.identify.linear import Factor
from workbench.identify.noise import effective_parameters, factor_at
from workbench.identify.problem import Problem
from workbench.parameters import Parameter
from workbench.robots.robot import Robot
from workbench.types import Outcome

NOTICEABLE = 0.05
"""Weights below this part of the largest do not enter the words for an unidentifiable combination."""
SUSPICIOUS = 5.0
"""Rows whose residual is this many times what the others lead one to expect are listed."""
POOR_ANGLE, POOR_LENGTH = np.deg2rad(1.0), 5e-3
"""Standard errors above which a seen parameter is called poorly determined [rad], [m]."""


@dataclass(frozen=True, eq=False)
class Combination:
    """Parameters that can't be told apart: moving them together changes no row.

    Args:
        names: The parameters, the heaviest first.
        weights: Their shares [natural units], the largest 1.
        words: For people, such as `base yaw with joint1.theta`.
    """

    names: tuple[str, ...]
    weights: tuple[float, ...]
    words: str


@dataclass(frozen=True, eq=False, kw_only=True)
class Fit:
    """One algorithm's answer to a problem.

    Args:
        algorithm: Its name.
        title: Its name in tables and figures.
        problem: What it was asked.
        x: Unknowns [rad or m].
        outcome: How the search ended.
        history: Cost after every iteration.
        seconds: Time of the search.
        warnings: What a user should know, one sentence each.
    """

    algorithm: str
    title: str
    problem: Problem
    x: Float[np.ndarray, " p"]
    outcome: Outcome
    history: tuple[float, ...]
    seconds: float
    warnings: tuple[str, ...] = ()

    @property
    def iterations(self) -> int:
        """Iterations of the search."""
        return len(self.history) - 1

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The unknowns, in the order of x."""
        return self.problem.parameters

    @cached_property
    def calibrated(self) -> Robot:
        """The robot with the identified values."""
        return self.problem.robot_at(self.x)

    @cached_property
    def factor(self) -> Factor:
        """Factorisation of the whitened Jacobian at the answer."""
        return factor_at(self.problem, self.x)

    @cached_property
    def whitened(self) -> Float[np.ndarray, " m"]:
        """Whitened residual components at the answer."""
        return self.problem.residual(self.x)[: self.problem.size]

    @cached_property
    def variance_factor(self) -> float:
        """Residual variance per degree of freedom; 1 when the noise is as stated, or nothing can tell."""
        if self.spare < 1.0:
            return 1.0
        return float(self.whitened @ self.whitened) / self.spare

    @cached_property
    def spare(self) -> float:
        """Measured numbers beyond those that the parameters took; below one, errors can't be judged."""
        return self.problem.count - effective_parameters(self.problem, self.factor)

    @cached_property
    def covariance(self) -> Float[np.ndarray, "p p"]:
        """Covariance of x [rad, m] for the residuals that were left; zero along what can't be seen."""
        return self.factor.covariance() * self.variance_factor

    @cached_property
    def std(self) -> Float[np.ndarray, " p"]:
        """Standard errors [rad or m]."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def condition(self) -> float:
        """Condition number of what can be seen, in natural units."""
        return self.factor.condition

    @cached_property
    def unidentifiable(self) -> tuple[Combination, ...]:
        """Combinations that no row shows; they stayed as near to nominal as the rest allowed."""
        return combinations(self.factor.null_space, self.parameters)

    @cached_property
    def hardly_seen(self) -> tuple[Combination, ...]:
        """Combinations that the rows show too faintly to identify; they too stayed near nominal."""
        return combinations(self.factor.hardly, self.parameters)

    @cached_property
    def poorly_determined(self) -> tuple[str, ...]:
        """Constants that are seen, but only within more than a degree or 5 mm."""
        limits = [POOR_ANGLE if p.unit == "rad" else POOR_LENGTH for p in self.parameters]
        return tuple(
            p.words
            for p, s, limit in zip(self.parameters, self.std, limits, strict=True)
            if s > limit and not p.is_coefficient
        )

    @cached_property
    def at_bounds(self) -> tuple[str, ...]:
        """Parameters that ended on a bound."""
        lower, upper = self.problem.bounds
        on = (np.abs(self.x - lower) <= 1e-12) | (np.abs(self.x - upper) <= 1e-12)
        return tuple(p.words for p, b in zip(self.parameters, on, strict=True) if b)

    @cached_property
    def beyond_bounds(self) -> tuple[str, ...]:
        """Parameters beyond bounds that the user gave, which only bounded algorithms keep."""
        lower, upper = self.problem.bounds
        beyond = (self.x < lower - 1e-12) | (self.x > upper + 1e-12)
        given = self.problem.bounded
        return tuple(p.words for p, b in zip(self.parameters, beyond, strict=True) if b and p.name in given)

    @cached_property
    def row_residuals(self) -> Float[np.ndarray, " rows"]:
        """Residual of every row in stated standard deviations, whatever weight a robust loss gave it."""
        plain = self.problem.with_row_weights(None)
        components = plain.residual(self.x)[: plain.size]
        size = len(plain.data)
        square = np.bincount(plain.component_rows, components**2, size)
        measured = np.bincount(plain.component_rows, plain.inverse_sigma > 0.0, minlength=size)
        return np.sqrt(square / np.maximum(measured, 1.0))

    @cached_property
    def suspicious(self) -> np.ndarray:
        """Rows (of the problem's data) that stand out from the others, the worst first."""
        residuals = self.row_residuals
        typical = max(float(np.median(residuals)), 1e-12)
        found = np.flatnonzero(residuals > SUSPICIOUS * typical)
        return found[np.argsort(-residuals[found])]


def combinations(
    null_space: Float[np.ndarray, "p n"], parameters: tuple[Parameter, ...]
) -> tuple[Combination, ...]:
    """Words for a null space: its basis is reduced until every vector involves few parameters.

    Gauss–Jordan elimination with the largest pivots gives one parameter to each combination alone; the
    others that must move with it are named after it.
    """
    rows = null_space.T.copy()
    used: list[int] = []
    for k in range(len(rows)):
        free = np.abs(rows[k:])
        free[:, used] = 0.0
        row, column = divmod(int(np.argmax(free)), rows.shape[1])
        rows[[k, k + row]] = rows[[k + row, k]]
        rows[k] /= rows[k, column]
        others = np.arange(len(rows)) != k
        rows[others] -= np.outer(rows[others, column], rows[k])
        used.append(column)
    found = []
    for row in rows:
        weights = row / np.abs(row).max()
        chosen = np.flatnonzero(np.abs(weights) > NOTICEABLE)
        chosen = chosen[np.argsort(-np.abs(weights[chosen]), kind="stable")]
        found.append(_combination([parameters[i] for i in chosen], weights[chosen]))
    return tuple(found)


def _combination(parameters: list[Parameter], weights: np.ndarray) -> Combination:
    ordered = sorted(zip(parameters, weights, strict=True), key=lambda pair: pair[0].is_geometry)
    words = [p.words for p, _ in ordered]
    text = " with ".join(words) if len(words) > 1 else f"{words[0]} alone (no row shows it)"
    if len(words) > 3:
        text = f"{words[0]} with a combination of {', '.join(words[1:-1])} and {words[-1]}"
    return Combination(tuple(p.name for p, _ in ordered), tuple(float(w) for _, w in ordered), text)
