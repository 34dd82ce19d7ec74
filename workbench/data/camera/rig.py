"""Cameras and the target that they see, as one instrument."""

from dataclasses import dataclass, replace

import numpy as np

from workbench.base.errors import DataError
from workbench.base.types import Freedom
from workbench.data.camera.camera import Camera
from workbench.data.camera.target import Target


@dataclass(frozen=True, eq=False)
class Rig:
    """Cameras and their target, with the arm in between.

    Args:
        cameras: One or more.
        target: What they all see.

    Raises:
        DataError: camera and target are carried by the same thing, so that the arm moves neither.
    """

    cameras: tuple[Camera, ...]
    target: Target

    def __post_init__(self):
        for camera in self.cameras:
            if camera.mounted is self.target.mounted:
                raise DataError(
                    f"camera '{camera.name}' and the target are both mounted = \"{camera.mounted}\", so the "
                    "arm moves neither against the other; mount one on the tool and one in the world"
                )

    def place(self, name: str) -> int | None:
        """Number of the camera of that name; None for none. With one camera, no name means that one."""
        names = [camera.name for camera in self.cameras]
        if not name and len(names) == 1:
            return 0
        return names.index(name) if name in names else None

    def with_intrinsics(self, free: Freedom) -> "Rig":
        """The same with the intrinsics of every camera fixed, free or with a prior."""
        return Rig(tuple(replace(camera, free=free) for camera in self.cameras), self.target)

    @property
    def intrinsics(self) -> np.ndarray:
        """Of every camera, a row each."""
        return np.stack([camera.intrinsics for camera in self.cameras])
