"""Base and tool frames: constants of the chain without singularities.

A frame is written as a translation, a constant rotation, and three small rotations about its own axes
(`roll`, `pitch`, `yaw`, zero until identified).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from workbench.arm.chain import Axis, Element
from workbench.base import se3
from workbench.base.arguments import admit
from workbench.base.array_checks import as_pose, check_rotations
from workbench.base.types import Freedom, Matrix3, Matrix4, Vector3, frozen

BASE, TOOL = -1, -2
"""Link numbers of the elements of the base and of the tool."""
FRAME_PARTS = ("x", "y", "z", "roll", "pitch", "yaw")
"""The six constants of a frame, in the order of the chain."""
Record = TypeVar("Record")


def revised(record: Record, **values: Any) -> Record:
    """A copy of a frozen record with other fields: `replace` for values that are computed from checked ones,
    and need no check again."""
    copy = object.__new__(type(record))
    kept, own = vars(record), record.__dataclass_fields__  # type: ignore[attr-defined]
    if len(kept) > len(own):  # what was computed from them
        kept = {name: kept[name] for name in own}
    copy.__dict__.update(kept | values)
    return copy


@dataclass(frozen=True, eq=False)
class Frame:
    """Pose of a frame, and whether it is to be identified.

    Args:
        xyz: Position [m].
        rotation: Rotation matrix.
        free: Fixed, free, or decided from the data.
    """

    xyz: Vector3 = field(default_factory=lambda: np.zeros(3))
    rotation: Matrix3 = field(default_factory=lambda: np.eye(3))
    free: Freedom = Freedom.FIXED

    def __post_init__(self):
        admit(self)
        check_rotations(self.rotation[None], "the rotation of a frame")

    @classmethod
    def from_pose(cls, pose: Matrix4, free: Freedom = Freedom.FIXED) -> "Frame":
        """The frame at a pose, a 4×4 matrix."""
        pose = as_pose(pose)
        return cls(frozen(pose[:3, 3].copy()), frozen(pose[:3, :3].copy()), free)

    @cached_property
    def pose(self) -> Matrix4:
        return frozen(se3.pose(self.rotation, self.xyz))

    @property
    def rpy(self) -> Vector3:
        """Roll, pitch, yaw [rad]."""
        return se3.matrix_to_rpy(self.rotation)

    def elements(self, name: str, link: int) -> tuple[Element, ...]:
        """The frame as elements `name.x` … `name.yaw`."""
        turn = se3.pose(self.rotation, np.zeros(3))
        return (
            *(
                Element(Axis(Axis.TX + i), f"{name}.{part}", float(self.xyz[i]), link=link)
                for i, part in enumerate(FRAME_PARTS[:3])
            ),
            Element(Axis.CONSTANT, f"{name}.rotation", link=link, matrix=frozen(turn)),
            *(Element(Axis(i), f"{name}.{part}", link=link) for i, part in enumerate(FRAME_PARTS[3:])),
        )

    def with_values(self, name: str, values: Mapping[str, float]) -> "Frame":
        """The frame with the constants `name.x` … `name.yaw` that are given; itself if none of them is."""
        keys = [f"{name}.{part}" for part in FRAME_PARTS]
        if values.keys().isdisjoint(keys):
            return self
        own = [*self.xyz.tolist(), 0.0, 0.0, 0.0]
        parts = np.array([values.get(k, v) for k, v in zip(keys, own, strict=True)])
        turn = se3.rpy_to_matrix(-parts[3:]).T  # about x, then the new y, then the new z
        return revised(self, xyz=frozen(parts[:3]), rotation=frozen(self.rotation @ turn))
