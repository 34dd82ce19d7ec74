"""Expected error of a calibrated arm, at poses like the measured ones and elsewhere.

The covariance of the identified constants gives J Σ Jᵀ at the tool. If all rows share one elbow branch or one
region, some combination of constants may be so uncertain that the model is good only near them; comparing
the two numbers shows this. Where rows show no base, like touches of places that nobody measured, both numbers
are those after the best constant motion of base and tool: the rest, such as the arm's scale, stays.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from workbench.arm.calibration_record import Expected
from workbench.arm.motion import Motion
from workbench.base.wording import in_mm
from workbench.identification.fit import Fit
from workbench.identification.tool_observability import expected_error

JOINT_SPACE_POSES = 400
"""Number of random poses that represent the whole joint space."""


class Transfer(NamedTuple):
    """Expected errors at poses like the measured ones, and anywhere within the joint limits."""

    near: Expected
    anywhere: Expected


def transfer(fit: Fit, *, rng: np.random.Generator) -> Transfer:
    """Expected errors near the fitted rows and at random joint positions within the limits.

    Drivers of effects (load, temperature …) are those of the rows.
    """
    limits = fit.problem.robot.search_limits
    near = Motion.of(fit.problem.data)
    anywhere = near.take(rng.integers(0, len(near), JOINT_SPACE_POSES))
    anywhere = replace(anywhere, q=rng.uniform(limits[:, 0], limits[:, 1], (JOINT_SPACE_POSES, len(limits))))
    is_aligned = not fit.problem.sees_base
    return Transfer(*(expected_error(fit, rows, is_aligned=is_aligned) for rows in (near, anywhere)))


def transfer_note(found: Transfer, sees_rotation: bool, shown: float) -> str:
    """Expected errors near the measured poses and anywhere, as a warning.

    Args:
        shown: Mean position error of the judging rows [m].
    """

    def size(expected: Expected) -> str:
        turned = f" / {np.rad2deg(expected.rotation):.3f}°" if sees_rotation else ""
        return f"{1e3 * expected.position:.3f} mm{turned}"

    how = "to use the arm there, measure in other branches and orientations too"
    if shown < found.near.position:
        how = f"rows of places that nobody measured show {in_mm(shown)} of it; measure positions, too"
    return (
        f"expected tool error from uncertain constants: {size(found.near)} near the measured poses, but "
        f"{size(found.anywhere)} elsewhere within the joint limits; {how}"
    )
