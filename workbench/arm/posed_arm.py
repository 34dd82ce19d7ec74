"""A substitute arm if only tool poses are known: three prismatic and three revolute joints."""

from functools import cache

import numpy as np

from workbench.arm.chain import Axis, Element
from workbench.arm.robot import Joint, JointKind, Robot

ORDER = (Axis.TX, Axis.TY, Axis.TZ, Axis.RZ, Axis.RY, Axis.RX)
"""Its joints: x y z [m], yaw pitch roll [rad]."""


@cache
def posed_arm() -> Robot:
    """The arm whose joints are x y z yaw pitch roll of the tool in the robot's base, none of it free."""
    kinds = [JointKind.REVOLUTE if axis.turns else JointKind.PRISMATIC for axis in ORDER]
    return Robot(
        name="tool poses",
        convention="elementary",
        elements=tuple(
            Element(axis, f"pose.{axis.name.lower()}", joint=k, link=k) for k, axis in enumerate(ORDER)
        ),
        joints=tuple(Joint(name=f"joint{k + 1}", kind=kind) for k, kind in enumerate(kinds)),
        link_ends=tuple(range(len(ORDER))),
        gravity=np.array([0.0, 0.0, -9.81]),
    )
