"""The result of a fit: parameters with standard errors, and the unobservable combinations.

Everything is computed from one factorisation at the solution, whichever algorithm found it.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np
from jaxtyping import Float

from workbench.arm.calibration_record import Calibration, pose_keys
from workbench.arm.confounded_constants import Combination, combinations
from workbench.arm.parameters import OF_FRAMES, Parameter
from workbench.arm.robot import Robot
from workbench.base.advice import beside
from workbench.base.frames import data_frame
from workbench.base.types import Outcome, frozen
from workbench.identification.algorithms.identifier import AbstractIdentifier, SearchOutcome
from workbench.identification.consider_covariance import Considered, covariance
from workbench.identification.noise import degrees_of_freedom, factor_at
from workbench.identification.problem import Noise, Problem
from workbench.identification.rows.outlying_rows import row_sizes
from workbench.identification.tool_observability import observed_by
from workbench.identification.undetermined_combinations import WEAKLY_OBSERVABLE, Factor
from workbench.report.result_display import AbstractReported

if TYPE_CHECKING:
    from pandas import DataFrame

NUMBERS_PER_CONSTANT = 1.5
"""Measured numbers for each constant below which residuals don't tell the noise: with six poses of an arm
from a URDF, errors of the tool are 2 to 30 times those expected."""
OF_FRAMES_ALONE = 0.99
"""Part of base and tool in a direction of length 1 that is none of the arm's constants."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Fit(AbstractReported):
    """One algorithm's solution of a problem, and how its search went.

    Args:
        seconds: Time of the search.
        actual: Actual scatter of the readings, where all were weighted equally.
        considered: Uncertain constants that were held at nominal.
    """

    algorithm: AbstractIdentifier
    problem: Problem
    search: SearchOutcome
    seconds: float = 0.0
    actual: Noise | None = None
    considered: Considered | None = None

    @property
    def x(self) -> Float[np.ndarray, " p"]:
        """Unknowns [rad or m]."""
        return self.search.x

    @property
    def outcome(self) -> Outcome:
        return self.search.outcome

    def to_frame(self) -> "DataFrame":
        """The parameters by name as a data frame: unit, nominal, identified, standard error; SI."""
        own = ("name", "unit", "nominal")
        columns: dict[str, Any] = {name: [getattr(p, name) for p in self.parameters] for name in own}
        return data_frame(columns | {"identified": self.x, "std": self.std}, index="name")

    @property
    def cost(self) -> float:
        """½|r|² at the solution."""
        return self.search.history[-1]

    @property
    def iterations(self) -> int:
        return len(self.search.history) - 1

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The unknowns, in the order of x."""
        return self.problem.parameters

    @cached_property
    def arm(self) -> Robot:
        """The robot with the identified values."""
        return self.problem.robot_at(self.x)

    @cached_property
    def calibrated(self) -> Robot:
        """The robot with the identified values and a record of its calibration."""
        hidden = {name for combination in self.unidentifiable for name in combination.names}
        std = zip(self.problem.names, self.std.tolist(), strict=True)
        calibration = Calibration(
            source=Path(self.problem.data.source).name,
            poses=pose_keys(self.problem.data.q),
            std={name: value for name, value in std if name not in hidden and np.isfinite(value)},
            nominal={p.name: p.nominal for p in self.parameters if p.is_plain and not p.is_instrument},
            covariance=self._of_geometry,
            observed=observed_by(self),
            reading=self.problem.data.read_as,
        )
        return replace(self.arm, calibration=calibration)

    @cached_property
    def factor(self) -> Factor:
        """Factorisation of the whitened Jacobian at the solution."""
        return factor_at(self.problem, self.x)

    @cached_property
    def rows_factor(self) -> Factor:
        """The same for the rows alone, without the prior on constants."""
        if self.problem.deviation is None:
            return self.factor
        return factor_at(self.problem.with_deviation(None), self.x)

    @cached_property
    def variance_factor(self) -> float:
        """Residual variance per degree of freedom; 1 if the noise is as stated or no degree of freedom is
        left."""
        if self.spare < 1.0:
            return 1.0
        whitened = self.problem.residual(self.x)[: self.problem.size]
        return float(whitened @ whitened) / self.spare

    @cached_property
    def spare(self) -> float:
        """Degrees of freedom: measured numbers less parameters; below one, errors can't be assessed."""
        return degrees_of_freedom(self.problem, self.factor)

    @property
    def is_assessed(self) -> bool:
        """Whether the numbers outnumber the constants by enough to tell their standard errors."""
        constants = len(self.problem.names) - self.rows_factor.null_space.shape[1]
        return self.problem.count >= NUMBERS_PER_CONSTANT * constants

    @cached_property
    def covariance(self) -> Float[np.ndarray, "p p"]:
        """Covariance of x [rad, m] scaled to the residuals; zero along unobservable directions of constants,
        whose nominal values stand, but not of base and tool, for which nobody gave any."""
        if self.actual is not None:
            found = covariance(self.problem, self.x, self.factor.root, self.actual)
        else:
            found = self.factor.covariance() * self.variance_factor
        if self._adrift.size and self.problem.sees_base:
            wide = WEAKLY_OBSERVABLE * self.factor.units[:, None] * self._adrift
            found = found + wide @ wide.T
        if self.considered is None:
            return found
        return found + self.considered.covariance(self.problem.names, self.x, self.factor.root)

    @property
    def _of_geometry(self) -> Float[np.ndarray, "k k"]:
        """Covariance of the arm's own constants [rad, m] for base, tool and effects as found: any other ones
        are found anew with the arm. Where rows show no base, what moves the whole arm alike counts as its
        base, and no place that was touched as found."""
        mine, found = self.problem.geometry, self.covariance
        given = ~mine
        if not self.problem.sees_base:
            given &= [not p.is_instrument for p in self.parameters]
            units, unseen = self.factor.units, self.rows_factor.null_space
            left = np.eye(len(units)) - unseen @ unseen.T * np.divide.outer(units, units)
            found = left @ found @ left.T
        scale = np.where(self.std > 0.0, self.std, 1.0)
        alike = found / np.outer(scale, scale)
        cross = alike[np.ix_(mine, given)]
        own = alike[np.ix_(mine, mine)] - cross @ np.linalg.pinv(alike[np.ix_(given, given)], 1e-9) @ cross.T
        return frozen(own * np.outer(scale[mine], scale[mine]))

    @cached_property
    def std(self) -> Float[np.ndarray, " p"]:
        """Standard errors [rad or m]."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @cached_property
    def unidentifiable(self) -> tuple[Combination, ...]:
        """Unobservable combinations of parameters, kept as near to nominal as possible."""
        return combinations(self.rows_factor.null_space, self.parameters)

    @cached_property
    def weakly_observable(self) -> tuple[Combination, ...]:
        """Combinations that are too weakly observable to identify; they too were kept near nominal."""
        return combinations(self.rows_factor.weak, self.parameters)

    @cached_property
    def _adrift(self) -> Float[np.ndarray, "p n"]:
        """Directions [natural units] of base, tool and markers that neither rows nor the prior hold."""
        unseen = np.hstack([self.factor.null_space, self.factor.weak])
        of_frames = [p.name.startswith((*OF_FRAMES, "marker")) for p in self.parameters]
        return unseen[:, np.linalg.norm(unseen[of_frames], axis=0) > OF_FRAMES_ALONE]

    @property
    def adrift(self) -> tuple[Combination, ...]:
        """Combinations of base and tool that may be anywhere, and are kept where the search began."""
        return combinations(self._adrift, self.parameters) if self.problem.deviation is not None else ()

    @property
    @beside("cautions about the fit", ())
    def cautions(self) -> tuple[str, ...]:
        """Warnings that are the same for all algorithms."""
        found = []
        if not self.is_assessed:
            found.append("too few rows to say how accurate constants and tool are; measure more poses")
        if self.weakly_observable:
            hidden = "; ".join(c.text for c in self.weakly_observable)
            found.append(f"barely observable, kept near nominal: {hidden}")
        if self.adrift:
            open_ = "; ".join(c.text for c in self.adrift)
            how = "turn joints about other axes, too, or give base or tool in the robot's file"
            found.append(f"open by any amount, and kept where the search began: {open_}; {how}")
        return tuple(found)

    @cached_property
    def row_residuals(self) -> Float[np.ndarray, " rows"]:
        """Residual of each row's worst channel in stated standard deviations, before any robust weighting."""
        plain = replace(self.problem, row_weights=None, shares=None)
        return row_sizes(plain, self.x, np.ones(len(plain.data), bool), 0.0 * self.factor.root).max(1)
