"""Joint coordinates as people read them: degrees, and millimetres of joints that slide."""

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.robot import JointKind, Robot


def sliding(robot: Robot) -> Bool[np.ndarray, " n"]:
    """Moving joints whose coordinate is a length [m]; that of all others is an angle [rad]."""
    return np.array([joint.kind is JointKind.PRISMATIC for joint in robot.moving], bool)


def sliding_numbers(robot: Robot) -> list[int]:
    """Their numbers, counted from 0."""
    return np.flatnonzero(sliding(robot)).tolist()


def shown_joints(robot: Robot, q: Float[np.ndarray, "*rows n"]) -> Float[np.ndarray, "*rows n"]:
    """Joint coordinates [rad or m] in degrees or millimetres."""
    return np.where(sliding(robot), 1e3 * q, np.rad2deg(q))


def shown_units(robot: Robot) -> tuple[str, ...]:
    """The unit of each, as it stands behind a number."""
    return tuple(" mm" if slides else "°" for slides in sliding(robot))


def joint_words(robot: Robot, q: Float[np.ndarray, " n"]) -> str:
    """`−12.5°, 30.0°, 250.0 mm`."""
    shown = shown_joints(robot, q).round(1) + 0.0
    parts = (f"{v:.1f}{unit}" for v, unit in zip(shown, shown_units(robot), strict=True))
    return ", ".join(parts).replace("-", "−")
