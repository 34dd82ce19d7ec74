"""Expected error of a calibrated arm, at poses like the measured ones and elsewhere.

The covariance of the identified constants gives J Σ Jᵀ at the tool. If all rows share one elbow branch or one
region, some combination of constants may be so uncertain that the model is good only near them; comparing
the two numbers shows this.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from workbench.arm.calibration_record import Expected
from workbench.arm.motion import Motion
from workbench.identification.fit import Fit
from workbench.identification.tool_observability import fit_twists

JOINT_SPACE_POSES = 400
"""Number of random poses that represent the whole joint space."""
MADE_ANGLE, MADE_LENGTH = np.deg2rad(5.0) / np.sqrt(3.0), 5e-3 / np.sqrt(3.0)
"""Standard deviation of manufacturing errors uniform within ±5° and ±5 mm [rad], [m]."""


class Transfer(NamedTuple):
    """Expected errors at poses like the measured ones, and anywhere within the joint limits."""

    near: Expected
    anywhere: Expected

    @property
    def ratio(self) -> float:
        """Error anywhere relative to that near the measured poses."""
        return self.anywhere.position / max(self.near.position, 1e-15)


def expected_error(fit: Fit, motion: Motion) -> Expected:
    """Expected error of a fit's arm at some joint positions.

    Args:
        fit: Constants of the arm with their covariance; base and tool, those of the first session, are part
            of the arm.
        motion: Joint positions, and what drives the arm's effects.
    """
    _, twists, places = fit_twists(fit, motion)
    covariance = (fit.covariance + _unseen(fit))[np.ix_(places, places)]
    spread = ((twists @ covariance) * twists).sum(2)
    position, rotation = spread[:, :3].sum(1), spread[:, 3:].sum(1)
    sizes = np.sqrt(np.maximum([position.mean(), rotation.mean()], 0.0))  # rounding may leave less than 0
    return Expected(float(sizes[0]), float(sizes[1]))


def _unseen(fit: Fit) -> Float[np.ndarray, "p p"]:
    """Covariance along unobservable directions: that of poor manufacturing (ARIA 2.4), not zero.

    Coefficients of effects are scaled to the deflection that an error in a length would make.
    """
    open_ones = fit.factor.vt[~fit.factor.seen]
    made = np.array([MADE_ANGLE if p.unit == "rad" else MADE_LENGTH for p in fit.parameters])
    projector = fit.factor.units[:, None] * (open_ones.T @ open_ones)
    return (projector * made**2) @ projector.T


def transfer(fit: Fit, *, rng: np.random.Generator) -> Transfer:
    """Expected errors near the fitted rows and at random joint positions within the limits.

    Drivers of effects (load, temperature …) are those of the rows.
    """
    limits = fit.problem.robot.search_limits
    near = Motion.of(fit.problem.data)
    anywhere = near.take(rng.integers(0, len(near), JOINT_SPACE_POSES))
    anywhere = replace(anywhere, q=rng.uniform(limits[:, 0], limits[:, 1], (JOINT_SPACE_POSES, len(limits))))
    return Transfer(expected_error(fit, near), expected_error(fit, anywhere))


def transfer_note(found: Transfer, sees_rotation: bool) -> str:
    """Expected errors near the measured poses and anywhere, as a warning."""

    def size(expected: Expected) -> str:
        turned = f" / {np.rad2deg(expected.rotation):.3f}°" if sees_rotation else ""
        return f"{1e3 * expected.position:.3f} mm{turned}"

    return (
        f"expected tool error from uncertain constants: {size(found.near)} near the measured poses, but "
        f"{size(found.anywhere)} elsewhere within the joint limits; to use the arm there, measure in other "
        "branches and orientations too"
    )
