"""Where a calibrated arm was measured, and how well it is known elsewhere, by the covariance on record."""

import numpy as np

from workbench.arm.calibration_record import Calibration
from workbench.arm.joint_units import sliding
from workbench.arm.kinematics.forward import identification_jacobian, tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.usable_arm import sampled
from workbench.base.types import JointRows
from workbench.base.wording import in_mm

WARNING_RATIO = 2.0
"""Ratio of expected errors, elsewhere to near the measured poses, above which the user is warned."""
LEAST = 1e-6
"""Error that counts as none [m]."""
OUTSIDE = float(np.radians(3.0))
"""Distance of a joint from its measured range [rad or m] from which a pose lies outside."""


def region_text(robot: Robot, q: JointRows | None = None) -> tuple[str, ...]:
    """`this path leaves the calibrated region by 46° (joint 1); expect 0.64 mm there`; empty where the arm is
    about as good as near its measured poses, or where its record doesn't tell.

    Args:
        robot: As calibrated.
        q: Joint positions of a path; anywhere within the limits if None.
    """
    found = robot.calibration
    if found is None or (near := _uncertainty(robot, found, found.observed.q)) is None:
        return ()
    measured, known = found.observed.q, 0.0 if found.error is None else np.nan_to_num(found.error.position)

    def size(spread: np.ndarray) -> float:
        return float(np.sqrt((spread**2).mean()))

    asked = sampled(robot) if q is None else q
    away = np.maximum(measured.min(0) - asked, asked - measured.max(0))
    told = max(min(size(near), known or np.inf), LEAST)  # contacts tell no scale
    outside = (away.max(1) > OUTSIDE) | (size(near) > WARNING_RATIO * told)
    arm, learned = robot.in_first_session, [e for e in robot.effects if e.learned is not None]
    own, bare = (tool_poses(arm.with_effects(*some), Motion(measured))[:, :3, 3] for some in (learned, ()))
    spread = _uncertainty(robot, found, asked[outside], np.linalg.norm(own - bare, axis=1))
    if spread is None or not outside.any() or size(spread) < WARNING_RATIO * told:
        return ()
    here, there = (in_mm(float(np.hypot(known, size(each)))) for each in (near, spread))
    if q is not None and size(near) > WARNING_RATIO * told:
        return (f"the calibration's rows are {in_mm(known)} off where they touched; expect {there} here",)
    if q is None:
        whole = f"expect {here} in all (left by the fit, and uncertain constants) near the measured poses"
        return (f"{whole}, but {there} elsewhere within the joint limits",)
    joint = int(np.argmax(away.max(0)))
    farthest = float(away[:, joint].max())
    by = in_mm(farthest) if sliding(robot)[joint] else f"{np.rad2deg(farthest):.0f}°"
    return (f"this path leaves the calibrated region by {by} (joint {joint + 1}); expect {there} there",)


def _uncertainty(robot: Robot, found: Calibration, q: JointRows, faded=0.0) -> np.ndarray | None:
    """Standard deviation of the tool's position [m], by that of the arm's constants, with what corrections
    that hold near the measured poses alone move it there; None if not on record."""
    arm = {e.name for e in robot.elements}
    names = tuple(n for n in found.nominal if n in arm)
    if len(names) != len(found.covariance):
        return None
    twists = identification_jacobian(robot.in_first_session.with_effects(), Motion(q), names)[1][:, :3]
    return np.sqrt(((twists @ found.covariance) * twists).sum((1, 2)).clip(0.0) + np.square(faded).mean())
