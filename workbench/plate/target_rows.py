"""What a plate's targets measure: rows of a linearisation with the kind and the accuracy of each target.

A seat holds the full pose, a socket or point its position alone. How well the target itself is known (its
`sigma`) adds to the noise of the instrument, as both move the tool away from where the plate says.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.linearisation import Linearisation, linearise
from workbench.arm.robot import Robot
from workbench.base.types import frozen
from workbench.plate.plate import Kind, Plate

SIGMA_POSITION = 1e-4
"""Standard deviation of a target's position where nothing else is said [m]."""
SIGMA_ROTATION = float(np.deg2rad(0.02))
"""And of its rotation about an axis [rad]."""


def linearise_targets(
    robot: Robot,
    plate: Plate,
    q: Float[np.ndarray, "rows n"],
    *,
    slots: Int[np.ndarray, " rows"] | None = None,
    names: tuple[str, ...] | None = None,
    sigma_position: float = SIGMA_POSITION,
    sigma_rotation: float = SIGMA_ROTATION,
) -> Linearisation:
    """Linearisation of measurements at a plate's targets.

    Args:
        robot: Geometry with base and tool.
        plate: The targets.
        q: Joint positions at targets [rad or m].
        slots: Target of each row; all in order if None.
        names: Constants to identify; the robot's default free ones if None.
        sigma_position: Standard deviation of the instrument's positions [m].
        sigma_rotation: And of its rotations [rad].
    """
    whole = linearise(robot, q, names=names, sigma_position=sigma_position, sigma_rotation=sigma_rotation)
    return rows_of_targets(whole, plate, np.arange(len(plate)) if slots is None else slots)


def rows_of_targets(
    linearisation: Linearisation, plate: Plate, slots: Int[np.ndarray, " measurements"]
) -> Linearisation:
    """Of full poses, six rows each, what each measurement's target holds, as well as it is known.

    Args:
        linearisation: Of full poses.
        plate: The targets.
        slots: Target of each measurement.
    """
    targets = [plate.targets[slot] for slot in slots]
    own = np.array([(0.0, 0.0) if t.sigma is None else t.sigma for t in targets]).reshape(-1, 2)
    sigma = np.hypot(linearisation.sigma, np.repeat(own, 3, axis=1).ravel())
    seats = np.array([t.kind is Kind.SEAT for t in targets], bool)
    held = np.repeat(np.column_stack([np.ones_like(seats), seats]), 3, axis=1).ravel()
    return replace(
        linearisation,
        jacobian=frozen((linearisation.unwhitened / sigma[:, None])[held]),
        sigma=frozen(sigma[held]),
        measurement=frozen(linearisation.measurement[held]),
    )
