"""Mounting of an arm: pose of its base, its tool, and the direction of gravity."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from workbench.arm.frame import Frame, revised
from workbench.arm.gravity import TOLERANCE, tilted
from workbench.arm.joint import NotNegative
from workbench.base.arguments import admit
from workbench.base.types import Matrix4, Vector3, frozen

DOWN = frozen(np.array([0.0, 0.0, -9.81]))
"""Gravity in the base of an upright arm [m/s²]; a session with this value uses the arm's own."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Mounting:
    """The mounting of an arm, in general or in one session of measurements.

    Args:
        base: Pose of the arm's first frame in the measuring frame.
        tool: Pose of the tool in the arm's last frame.
        gravity: Acceleration in the robot's base frame [m/s²].
        gravity_tolerance: Standard deviation of its direction, about each axis perpendicular to it [rad].
    """

    base: Frame = field(default_factory=Frame)
    tool: Frame = field(default_factory=Frame)
    gravity: Vector3 = field(default_factory=lambda: DOWN)
    gravity_tolerance: NotNegative = TOLERANCE

    def __post_init__(self):
        admit(self)

    def at(self, base: Matrix4, tool: Matrix4) -> "Mounting":
        """The same with base and tool at other poses."""
        own, held = Frame.from_pose(base, self.base.free), Frame.from_pose(tool, self.tool.free)
        return revised(self, base=own, tool=held)

    def with_values(self, values: Mapping[str, float], where: str = "") -> "Mounting":
        """`base.x` … and `tool.x` … move the frames, `gravity.x` and `.y` turn gravity (`arm/gravity.py`).

        In a session, such as `where` `[front]`, they are `base[front].x` … instead.
        """
        return revised(
            self,
            base=self.base.with_values(f"base{where}", values),
            tool=self.tool.with_values(f"tool{where}", values),
            gravity=tilted(self.gravity, np.array([values.get(f"gravity{where}.{a}", 0.0) for a in "xy"])),
        )
