"""Linearisation: the whitened identification Jacobian of some measurements, and derived quantities.

    r(p + δ) ≈ r(p) − J δ,        J = diag(1/σ) ∂predicted/∂p,        C = (JᵀJ)⁺

Every row is divided by its instrument's standard deviation, so C is the covariance of the parameters. For
singular values, ranks and indices the columns must be comparable too: an angle is scaled to the arc at one
characteristic length L, the arm's maximum reach. The unit of every scaled parameter is then the metre, and a
scaled parameter of δ moves the tool by at most about δ.

Sources: Golub & Van Loan, Matrix Computations (4th ed.), §5.5 (pseudo-inverse, rank); Schröer, Albright &
Grethlein, Robotics and Computer-Integrated Manufacturing 13(3), 1997 (scaling of rows by the deviation
of measurements and of columns by a length).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.kinematics.forward import identification_jacobian
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.types import frozen

RANK_TOLERANCE = 1e-9
"""Singular values below this share of the largest (scaled) one count as zero."""
SIGMA = (1e-4, float(np.deg2rad(0.02)))
"""Standard deviations of a measured coordinate [m], and of a rotation about an axis [rad]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Linearisation:
    """A whitened identification Jacobian, with the meaning of its rows and columns.

    Args:
        jacobian: ∂predicted/∂parameter divided by the row's standard deviation [1 per unit].
        units: Their units, `m` or `rad` (others count unscaled).
        sigma: Standard deviation of each row [m or rad].
        measurement: Which measurement each row belongs to, counted from 0, in increasing order.
        length: Characteristic length L [m] at which an angle counts as an arc.
        residual: Whitened measured − predicted, once measured.
    """

    jacobian: Float[np.ndarray, "m p"]
    names: tuple[str, ...]
    units: tuple[str, ...]
    sigma: Float[np.ndarray, " m"]
    measurement: Int[np.ndarray, " m"]
    length: float
    residual: Float[np.ndarray, " m"] | None = None

    @cached_property
    def measurements(self) -> int:
        return int(self.measurement[-1]) + 1 if len(self.measurement) else 0

    @cached_property
    def weights(self) -> Float[np.ndarray, " p"]:
        """One metre of each scaled parameter in the parameter's own unit: 1/L for an angle."""
        return frozen(np.array([1.0 / self.length if unit == "rad" else 1.0 for unit in self.units]))

    @cached_property
    def scaled(self) -> Float[np.ndarray, "m p"]:
        """Whitened Jacobian per metre of scaled parameter [1/m]."""
        return frozen(self.jacobian * self.weights)

    @cached_property
    def unwhitened(self) -> Float[np.ndarray, "m p"]:
        """∂predicted/∂parameter in its own units, metres and radians mixed, as in the paper."""
        return frozen(self.jacobian * self.sigma[:, None])

    @cached_property
    def singular_values(self) -> Float[np.ndarray, " k"]:
        """Singular values of the scaled Jacobian [1/m], largest first, min(m, p) of them."""
        return self.factors[1]

    @cached_property
    def factors(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """U, σ, Vᵀ of the scaled Jacobian (thin)."""
        u, values, vt = np.linalg.svd(self.scaled, full_matrices=False)
        return frozen(u), frozen(values), frozen(vt)

    def rank(self) -> int:
        """Number of combinations of parameters that the measurements determine."""
        values = self.singular_values
        return int(np.count_nonzero(values > RANK_TOLERANCE * values[:1]))

    @cached_property
    def condition(self) -> float:
        """σmax/σmin of the scaled Jacobian; infinite below full rank."""
        values = self.singular_values
        return float(values[0] / values[-1]) if self.rank() == len(self.names) else np.inf

    @cached_property
    def covariance(self) -> Float[np.ndarray, "p p"]:
        """C = (JᵀJ)⁺ in the parameters' own units, on the identifiable subspace.

        Below full rank, unidentifiable combinations of scaled parameters count as fixed, so their variance is
        zero here: check `rank` first.
        """
        _, values, vt = self.factors
        rank = self.rank()
        root = (vt[:rank] / values[:rank, None]) * self.weights
        return frozen(root.T @ root)

    @cached_property
    def unidentifiable(self) -> Float[np.ndarray, "p missing"]:
        """Orthonormal combinations of scaled parameters that are unobservable, as columns."""
        rows, columns = self.scaled.shape
        vt = self.factors[2] if rows >= columns else np.linalg.svd(self.scaled, full_matrices=True)[2]
        return frozen(vt[self.rank() :].T)


def linearise(
    robot: Robot, q: Float[np.ndarray, "rows n"], *, names: tuple[str, ...] | None = None
) -> Linearisation:
    """Linearisation of full poses at the robot's current constants, of the usual `SIGMA`.

    Args:
        q: Joint positions [rad or m].
        names: Constants to identify, P of them; the robot's default free ones if None. With an unknown
            base or tool its `base.…` and `tool.…` constants belong here.

    Returns:
        Six rows per pose: position first, then rotation, base axes.
    """
    names = robot.default_free if names is None else names
    _, twists = identification_jacobian(robot, Motion(q), names)
    deviations = np.repeat(SIGMA, 3)
    whitened = twists / deviations[:, None]
    elements, coefficients = robot.chain.elements, robot.coefficient_units
    return Linearisation(
        jacobian=frozen(whitened.reshape(-1, len(names))),
        names=names,
        units=tuple(coefficients.get(n) or elements[robot.chain.index[n]].unit for n in names),
        sigma=frozen(np.tile(deviations, len(q))),
        measurement=frozen(np.repeat(np.arange(len(q)), len(deviations))),
        length=robot.reach,
    )
