"""Predicted error of the calibrated arm, from the covariance of its parameters.

    Σ(q) = J(q) C J(q)ᵀ

J(q) is the twist of the tool per parameter at an evaluation pose, C the covariance after a set of
measurements. The root of the trace of Σ's position part is the root mean square error at that pose;
its mean square over a region is minimised by I-optimality. It is the error of the *prediction* alone: effects
that the model lacks are added to it.

The contribution of a measurement is the increase of that error without it:

    C₋ᵢ = C + K (I − S)⁻¹ Kᵀ,     K = C Aᵢᵀ,     S = Aᵢ C Aᵢᵀ

with Aᵢ its whitened rows; S has an eigenvalue of 1 where only that measurement sees some combination of
parameters.

Sources: Atkinson, Donev & Tobias, Optimum Experimental Designs, with SAS (2007), §10.6 (I-, V-optimality);
mean of the norm by Satterthwaite's χ² of equal mean and variance, Biometrics Bulletin 2(6), 1946; Golub & Van
Loan, Matrix Computations (4th ed.), §2.1.4 (Sherman–Morrison–Woodbury).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Float
from scipy.special import gammaln

from workbench.arm.kinematics.forward import identification_jacobian
from workbench.arm.linearisation import Linearisation
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.types import frozen

UNSEEN = 1e-6
"""Motion of the tool per metre of an unidentifiable combination [m/m] above which its error is unbounded."""


@dataclass(frozen=True, eq=False)
class PredictedError:
    """Expected errors of the calibrated arm over evaluation poses.

    Args:
        twists: J at every pose.
        squares: Mean of JᵀJ over the poses, of position and of rotation.
        covariance: C.
        blind: Combinations of parameters that the measurements leave open, as columns.
    """

    twists: Float[np.ndarray, "rows 6 p"]
    squares: Float[np.ndarray, "2 p p"]
    covariance: Float[np.ndarray, "p p"]
    blind: Float[np.ndarray, "p missing"]

    @property
    def position(self) -> Float[np.ndarray, " rows"]:
        """Root mean square of the distance error at each pose [m]; infinite where it is left open."""
        return self._lengths[0][0]

    @property
    def rotation(self) -> Float[np.ndarray, " rows"]:
        """Root mean square of the rotation angle error at each pose [rad]; infinite where it is left open."""
        return self._lengths[1][0]

    @property
    def position_rms(self) -> float:
        return self._rms(0)

    @property
    def rotation_rms(self) -> float:
        return self._rms(1)

    @property
    def position_mean(self) -> float:
        """Mean distance error over the poses [m], to compare with the mean of held-out rows."""
        return float(self._lengths[0][1].mean())

    @property
    def rotation_mean(self) -> float:
        """Mean rotation error over the poses [rad]."""
        return float(self._lengths[1][1].mean())

    def _rms(self, part: int) -> float:
        """Over all poses: trace(W C), which needs none of them unless something is left open."""
        if self.blind.size:
            return float(np.sqrt(np.mean(self._lengths[part][0] ** 2)))
        return float(np.sqrt((self.squares[part] * self.covariance).sum()))

    @cached_property
    def _lengths(self) -> list[tuple[Float[np.ndarray, " rows"], ...]]:
        """Of translation and rotation at each pose: root mean square and mean length of a normal vector."""
        found = []
        for moves in (self.twists[:, :3], self.twists[:, 3:]):
            covariance = moves @ self.covariance @ moves.transpose(0, 2, 1)
            trace = np.trace(covariance, axis1=1, axis2=2)
            square = np.maximum((covariance**2).sum((1, 2)), np.finfo(float).tiny)
            freedom = np.clip(trace**2 / square, 1.0, 3.0)
            rms = np.sqrt(trace)
            mean = rms * np.sqrt(2.0 / freedom) * np.exp(gammaln((freedom + 1) / 2) - gammaln(freedom / 2))
            unseen = (np.abs(moves @ self.blind) > UNSEEN).any((1, 2))
            found.append(tuple(frozen(np.where(unseen, np.inf, each)) for each in (rms, mean)))
        return found


def predicted_error(
    linearisation: Linearisation, robot: Robot, q_region: Float[np.ndarray, "rows n"]
) -> PredictedError:
    """Expected errors at evaluation poses after a calibration with the linearised measurements.

    Args:
        linearisation: The measurements; its names are the identified parameters, all others are known.
        robot: Geometry at which the poses are linearised.
        q_region: Joint positions of evaluation poses [rad or m], see `plate.region_poses`.
    """
    blind = linearisation.weights[:, None] * linearisation.unidentifiable
    at = _twists(robot, q_region.tobytes(), q_region.shape, linearisation.names)
    return PredictedError(*at, linearisation.covariance, frozen(blind))


def position_weight(
    robot: Robot,
    q_region: Float[np.ndarray, "rows n"],
    names: tuple[str, ...],
    weights: Float[np.ndarray, " p"],
) -> Float[np.ndarray, "p p"]:
    """W with trace(W C) = mean square position error over the poses [m² per product of two units].

    Args:
        robot: Geometry at which the poses are linearised.
        q_region: Joint positions of poses that matter [rad or m].
        weights: Scaling of the parameters, as in `Linearisation.weights`: C is of scaled ones.
    """
    whole = _twists(robot, q_region.tobytes(), q_region.shape, names)[1][0]
    return whole * np.outer(weights, weights)


def blocks(linearisation: Linearisation) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Measurements with equally many rows (six of a pose, three of a point), and the rows of each."""
    counts = np.bincount(linearisation.measurement)
    for count in np.unique(counts):
        alike = np.flatnonzero(counts == count)
        yield alike, np.searchsorted(linearisation.measurement, alike)[:, None] + np.arange(count)


MIN_LEFT = 1e-9
"""Share of information remaining without a measurement below which it counts as zero."""


def rise_without_each(
    linearisation: Linearisation, weight: Float[np.ndarray, "p p"]
) -> Float[np.ndarray, " measurements"]:
    """Relative rise of the root mean square error without each measurement.

    Args:
        linearisation: All measurements; must have full rank.
        weight: W with trace(W C) = mean square error, such as `position_weight`.

    Returns:
        0.1 for 10 % more; infinite where parameters could no longer be told apart; NaN below full rank.
    """
    count = linearisation.measurements
    if linearisation.rank() < len(linearisation.names):
        return np.full(count, np.nan)
    covariance = linearisation.covariance
    gain = linearisation.jacobian @ covariance
    rises = np.empty(count)  # of trace(W C) without these rows
    for poses, rows in blocks(linearisation):
        own = gain[rows]
        spread = linearisation.jacobian[rows] @ own.transpose(0, 2, 1)
        values, vectors = np.linalg.eigh(np.eye(rows.shape[1]) - spread)
        turned = vectors.transpose(0, 2, 1) @ own
        squares = ((turned @ weight) * turned).sum(2)
        with np.errstate(divide="ignore"):
            rises[poses] = np.where(values[:, 0] < MIN_LEFT, np.inf, (squares / values).sum(1))
    return np.sqrt(1.0 + rises / float((weight * covariance).sum())) - 1.0


@lru_cache(maxsize=4)
def _twists(
    robot: Robot, q: bytes, shape: tuple[int, int], names: tuple[str, ...]
) -> tuple[Float[np.ndarray, "rows 6 p"], Float[np.ndarray, "2 p p"]]:
    """Identification Jacobian J at evaluation poses, and means of JᵀJ of position and of rotation.

    Cached, since a drag uses the same poses repeatedly.
    """
    twists = identification_jacobian(robot, Motion(np.frombuffer(q).reshape(shape)), names)[1]
    parts = (twists[:, part].reshape(-1, len(names)) for part in (slice(3), slice(3, None)))
    return frozen(twists), frozen(np.stack([part.T @ part / max(shape[0], 1) for part in parts]))
