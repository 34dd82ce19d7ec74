"""Poses that were kept while jogging: where the nominal arm believes the tool to be, and where it is.

The thesis's interface captures poses before and after a calibration in the same way (Katana §3.4).
"""

import csv
import io
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import JointKind, Robot
from workbench.base import se3
from workbench.session.state import Session

COORDINATES = ("x[mm]", "y[mm]", "z[mm]", "roll[deg]", "pitch[deg]", "yaw[deg]")


@dataclass(frozen=True, eq=False)
class Captured:
    """The kept poses.

    Args:
        q: Joint positions [rad or m].
        nominal: Tool poses of the nominal arm, robot's base.
        calibrated: Those of the calibrated arm; None before a calibration.
    """

    q: Float[np.ndarray, "poses n"]
    nominal: Float[np.ndarray, "poses 4 4"]
    calibrated: Float[np.ndarray, "poses 4 4"] | None

    @property
    def apart(self) -> Float[np.ndarray, " poses"]:
        """Distance between the two tools [m]; NaN before a calibration."""
        if self.calibrated is None:
            return np.full(len(self.q), np.nan)
        return np.linalg.norm(self.calibrated[:, :3, 3] - self.nominal[:, :3, 3], axis=1)


def captured(session: Session) -> Captured:
    """The kept poses as the present models have them."""
    q = np.array(session.captured).reshape(-1, session.robot.dof)
    found = session.identification
    calibrated = None if found is None else _in_base(found.runs[session.fit].calibrated, q)
    return Captured(q, _in_base(session.robot, q), calibrated)


def captured_table(session: Session) -> str:
    """The kept poses as CSV, with units in the header."""
    poses, out = captured(session), io.StringIO()
    sliding = [joint.kind is JointKind.PRISMATIC for joint in session.robot.moving]
    joints = [f"q{i + 1}[{'mm' if slides else 'deg'}]" for i, slides in enumerate(sliding)]
    models = [("nominal", poses.nominal)]
    if poses.calibrated is not None:
        models.append(("calibrated", poses.calibrated))
    writer = csv.writer(out)
    writer.writerow([*joints, *(f"{name}_{column}" for name, _ in models for column in COORDINATES)])
    positions = poses.q * np.where(sliding, 1e3, np.rad2deg(1.0))
    columns = [positions, *(_coordinates(frames) for _, frames in models)]
    writer.writerows(np.concatenate(columns, axis=1).tolist())
    return out.getvalue()


def _in_base(robot: Robot, q: np.ndarray) -> Float[np.ndarray, "poses 4 4"]:
    """By what joint positions tell: neither time, temperature nor motion is known of a kept pose."""
    known = robot.with_effects(*(effect for effect in robot.effects if not effect.needs))
    return se3.inverse(robot.base.pose) @ tool_poses(known, Motion(q))


def _coordinates(poses: Float[np.ndarray, "poses 4 4"]) -> Float[np.ndarray, "poses 6"]:
    angles = [se3.matrix_to_rpy(pose[:3, :3]) for pose in poses]
    return np.column_stack([1e3 * poses[:, :3, 3], np.rad2deg(angles).reshape(-1, 3)])
