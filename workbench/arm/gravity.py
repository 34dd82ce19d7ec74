"""Direction of gravity in the frame of an arm's base, and two small angles that correct it.

    g' = R(Lᵀ [a_x, a_y, 0]) g,      L the smallest turn that brings −g onto the z axis

so that for an arm that stands upright the angles are about the axes x and y of its base.
"""

import numpy as np
from jaxtyping import Float

from workbench.base import se3
from workbench.base.types import Matrix3, Vector3, frozen

GRAVITY = ("gravity.x", "gravity.y")
"""The two angles; `gravity[front].x` where every session stands in its own way."""
TOLERANCE = float(np.deg2rad(1.0))
"""Default standard deviation of the direction of gravity in a robot's file [rad]."""
LEVELLING_SIGMA = 1e-4
"""Standard deviation of a levelled measuring frame [rad]."""


def level_axes(gravity: Vector3) -> Matrix3:
    """The smallest rotation that brings z upwards, against gravity; the identity without gravity."""
    size = float(np.linalg.norm(gravity))
    if size == 0.0:
        return np.eye(3)
    up = -np.asarray(gravity) / size
    axis = np.cross(up, [0.0, 0.0, 1.0])
    sine = float(np.linalg.norm(axis))
    if sine == 0.0:
        return np.eye(3) if up[2] > 0 else np.diag([1.0, -1.0, -1.0])
    return se3.rotvec_to_matrix(axis / sine * np.arctan2(sine, up[2]))


def tilting(gravity: Vector3, angles: Float[np.ndarray, "2"]) -> Matrix3:
    """The rotation by the two angles [rad]."""
    return se3.rotvec_to_matrix(angles @ level_axes(gravity)[:2])


def tilted(gravity: Vector3, angles: Float[np.ndarray, "2"]) -> Vector3:
    """Gravity turned by the two angles [rad]."""
    return frozen(tilting(gravity, angles) @ gravity) if np.any(angles) else gravity


def levelled(gravity: Vector3, rotation: Matrix3) -> Vector3:
    """Gravity of equal magnitude in a base with this orientation in a measuring frame whose z axis is up."""
    return frozen(-np.linalg.norm(gravity) * rotation[2])


def angles_between(gravity: Vector3, other: Vector3) -> Float[np.ndarray, "2"]:
    """The two angles [rad] that rotate one gravity into the direction of another."""
    axis = np.cross(gravity, other)
    sine = float(np.linalg.norm(axis))
    angle = np.arctan2(sine, float(np.dot(gravity, other)))
    return level_axes(gravity)[:2] @ axis * (angle / sine if sine else 0.0)
