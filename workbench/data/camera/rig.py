"""Cameras and the target that they see, as one instrument."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from workbench.base.errors import DataError
from workbench.base.types import Freedom
from workbench.data.camera.camera import Camera, read_cameras
from workbench.data.camera.target import Target, read_target


def read_rig(camera: Path | str, target: Path | str) -> "Rig":
    """Cameras and target of a `camera.toml` and a `target.toml`."""
    return Rig(read_cameras(camera), read_target(target))


@dataclass(frozen=True)
class Apart:
    """A corner that was set apart: where it was seen and how far off [px]."""

    image: str
    camera: str
    id: int
    corner: int
    off: float

    def __str__(self) -> str:
        return f"image {self.image} id {self.id} corner {self.corner} ({self.off:.1f} px)"


@dataclass(frozen=True, eq=False)
class Rig:
    """Cameras and their target, with the arm in between.

    Args:
        cameras: One or more.
        target: What they all see.
        apart: Corners that contradict their pictures and are not used, the worst first.
        tool_poses: Whether poses of the tool were given in place of joints: the arm is `posed_arm`.

    Raises:
        DataError: camera and target are carried by the same thing, so that the arm moves neither.
    """

    cameras: tuple[Camera, ...]
    target: Target
    apart: tuple[Apart, ...] = ()
    tool_poses: bool = False

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

    @property
    def is_lens_fixed(self) -> bool:
        """Whether some camera's intrinsics count as known."""
        return any(camera.free is Freedom.FIXED for camera in self.cameras)

    def with_intrinsics(self, free: Freedom) -> "Rig":
        """The same with the intrinsics of every camera fixed, free or with a prior."""
        return replace(self, cameras=tuple(replace(camera, free=free) for camera in self.cameras))

    @property
    def intrinsics(self) -> np.ndarray:
        """Of every camera, a row each."""
        return np.stack([camera.intrinsics for camera in self.cameras])
