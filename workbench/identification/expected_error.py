"""Expected error of a calibrated arm, at poses like the measured ones and elsewhere.

The covariance of the identified constants moves the tool by J Σ Jᵀ. Rows of one kind (one elbow, one
region) may leave a combination of constants so uncertain that the model is good only near them; the two
numbers side by side say so before anybody trusts it elsewhere.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from workbench.arm.calibration_record import Expected
from workbench.arm.motion import Motion
from workbench.identification.fit import Fit
from workbench.identification.observed import fit_twists

ELSEWHERE = 400
"""Random poses that stand for the whole joint space."""
MADE_ANGLE, MADE_LENGTH = np.deg2rad(5.0) / np.sqrt(3.0), 5e-3 / np.sqrt(3.0)
"""Standard deviation of manufacturing errors, even within 5° and 5 mm [rad], [m]."""
SERIOUS = 2.0
"""Ratio of the two expected errors from which on the user is warned."""


class Transfer(NamedTuple):
    """Expected errors at poses like the measured ones, and anywhere within the joint limits."""

    near: Expected
    anywhere: Expected

    @property
    def ratio(self) -> float:
        """How much worse it is elsewhere."""
        return self.anywhere.position / max(self.near.position, 1e-15)


def expected_error(fit: Fit, motion: Motion) -> Expected:
    """Expected error of a fit's arm at some joint positions.

    Args:
        fit: Constants of the arm with their covariance; base and tool count with the arm as one, as the
            first session has them.
        motion: Where: joint positions, and what drives the arm's effects.
    """
    _, twists, places = fit_twists(fit, motion)
    covariance = (fit.covariance + _unseen(fit))[np.ix_(places, places)]
    spread = ((twists @ covariance) * twists).sum(2)
    position, rotation = spread[:, :3].sum(1), spread[:, 3:].sum(1)
    sizes = np.sqrt(np.maximum([position.mean(), rotation.mean()], 0.0))  # rounding may leave less than 0
    return Expected(float(sizes[0]), float(sizes[1]))


def _unseen(fit: Fit) -> Float[np.ndarray, "p p"]:
    """Covariance of what the rows did not show: as large as arms are made badly (ARIA 2.4), not zero.

    A coefficient then bends the arm by as much as a length is off.
    """
    open_ones = fit.factor.vt[~fit.factor.seen]
    made = np.array([MADE_ANGLE if p.unit == "rad" else MADE_LENGTH for p in fit.parameters])
    projector = fit.factor.units[:, None] * (open_ones.T @ open_ones)
    return (projector * made**2) @ projector.T


def transfer(fit: Fit, *, rng: np.random.Generator) -> Transfer:
    """Expected errors near the fitted rows and at random joint positions within the limits.

    What drives effects (load, temperature …) is as in the rows.
    """
    limits = fit.problem.robot.search_limits
    near = Motion.of(fit.problem.data)
    anywhere = near.take(rng.integers(0, len(near), ELSEWHERE))
    anywhere = replace(anywhere, q=rng.uniform(limits[:, 0], limits[:, 1], (ELSEWHERE, len(limits))))
    return Transfer(expected_error(fit, near), expected_error(fit, anywhere))


def transfer_note(found: Transfer, sees_rotation: bool) -> str:
    """One sentence on where the calibrated model can be trusted."""

    def size(expected: Expected) -> str:
        turned = f" / {np.rad2deg(expected.rotation):.3f}°" if sees_rotation else ""
        return f"{1e3 * expected.position:.3f} mm{turned}"

    return (
        f"the uncertainty of the constants alone moves the tool by {size(found.near)} at poses like the "
        f"measured ones, but by {size(found.anywhere)} anywhere within the joint limits; measure in other "
        "branches and orientations too before trusting the model there"
    )
