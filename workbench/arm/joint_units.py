"""Joint coordinates for people: degrees, and millimetres for prismatic joints."""

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.robot import JointKind, Robot

LIMIT_FACTOR = 3.0
"""Joint positions beyond this multiple of the limit indicate wrong units."""
UNLIMITED = 4.0 * np.pi
"""Bound for joints without limits: two turns each way."""
MIN_COEFFICIENT = 1e-6


def implausible_joint(
    q: Float[np.ndarray, "rows n"], limits: Float[np.ndarray, "n 2"]
) -> tuple[int, str, float] | None:
    """The joint far beyond its limits, its likely unit if any, and its limit; None if there is none."""
    largest = np.nanmax(np.abs(q), axis=0, initial=0.0)
    bound = np.where(np.isfinite(limits).all(1), np.abs(limits).max(1), np.inf)
    if np.isinf(bound).all():
        bound = np.full(len(limits), UNLIMITED)
    bound = np.maximum(bound, MIN_COEFFICIENT)
    beyond = largest > LIMIT_FACTOR * bound
    if not beyond.any():
        return None
    joint = int(np.argmax(np.where(beyond, largest / bound, 0.0)))
    if (np.radians(largest) <= 1.1 * bound)[np.isfinite(bound)].all():
        guess = "degrees"
    else:
        guess = "mm" if (largest / 1000.0 <= 1.1 * bound)[beyond].all() else ""
    return joint, guess, float(bound[joint])


def sliding(robot: Robot) -> Bool[np.ndarray, " n"]:
    """Moving joints whose coordinate is a length [m]; that of all others is an angle [rad]."""
    return np.array([joint.kind is JointKind.PRISMATIC for joint in robot.moving], bool)


def sliding_numbers(robot: Robot) -> list[int]:
    return np.flatnonzero(sliding(robot)).tolist()


def shown_joints(robot: Robot, q: Float[np.ndarray, "*rows n"]) -> Float[np.ndarray, "*rows n"]:
    """Joint coordinates [rad or m] in degrees or millimetres."""
    return np.where(sliding(robot), 1e3 * q, np.rad2deg(q))


def shown_units(robot: Robot) -> tuple[str, ...]:
    """Unit of each, as printed after a number."""
    return tuple(" mm" if slides else "°" for slides in sliding(robot))


def joint_titles(robot: Robot) -> list[str]:
    """Names of the moving joints for people: number, and name in the robot's file."""
    return [f"{k} {joint.label}" if joint.label else f"Joint {k}" for k, joint in enumerate(robot.moving, 1)]
