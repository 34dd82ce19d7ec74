"""What cameras saw, as the rows of a `Dataset` carry it."""

from dataclasses import dataclass, replace
from typing import final

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.types import frozen
from workbench.data.dataset import Dataset, Labels
from workbench.data.readings import AbstractReadings
from workbench.extras.camera.camera import Mount
from workbench.extras.camera.rig import Rig


@final
@dataclass(frozen=True, eq=False)
class PictureReadings(AbstractReadings):
    """Corners in pictures; a row is one picture, or those that several cameras took at once.

    Args:
        pixels: Where each camera saw each point of its target [px]; NaN where it did not.
        image: Name of the row's picture.
        rig: The cameras and their target.
        sight: Pose of each board in each camera, from that camera's pixels alone; NaN where unknown.
    """

    pixels: Float[np.ndarray, "rows cameras points 2"]
    image: Labels
    rig: Rig
    sight: Float[np.ndarray, "rows cameras boards 4 4"]
    frames = ("camera", "target")

    def __post_init__(self):
        for name in ("pixels", "sight"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @classmethod
    def of(cls, data: Dataset) -> "PictureReadings":
        """Those of a dataset."""
        if not isinstance(data.readings, cls):
            raise DataError(f"{data.source}: no pictures; give --camera and --target")
        return data.readings

    def __len__(self) -> int:
        return len(self.pixels)

    @property
    def has_tool_poses(self) -> bool:
        return self.rig.tool_poses

    @property
    def numbers(self) -> Float[np.ndarray, "rows k"]:
        return self.pixels.reshape(len(self), -1)

    def take(self, rows: Int[np.ndarray, " k"] | Bool[np.ndarray, " rows"]) -> "PictureReadings":
        return replace(self, pixels=self.pixels[rows], image=self.image[rows], sight=self.sight[rows])

    def joined(self, other: AbstractReadings | None) -> "PictureReadings | None":
        """Few pictures alone don't tell how far a tool is off: those of the same rig are judged together."""
        if not isinstance(other, PictureReadings) or self.rig.owners != other.rig.owners:
            return None
        pixels, image, sight = (
            np.concatenate([getattr(each, name) for each in (self, other)])
            for name in ("pixels", "image", "sight")
        )
        return PictureReadings(pixels, image, self.rig, sight)

    @property
    def sights(self) -> Float[np.ndarray, "rows 4 4"]:
        """Of the board and the camera that see each other most often."""
        often = np.isfinite(self.sight[..., 0, 0]).sum(0)
        camera, board = np.unravel_index(int(np.argmax(often)), often.shape)
        seen = self.sight[:, camera, board]
        return seen if self.rig.cameras[camera].mounted is Mount.WORLD else se3.inverse(seen)

    @property
    def seen(self) -> Bool[np.ndarray, "rows cameras points"]:
        return np.isfinite(self.pixels).all(3)


def rig_of(data: Dataset) -> Rig:
    """The cameras of a dataset of pictures."""
    return PictureReadings.of(data).rig


def with_rig(data: Dataset, rig: Rig) -> Dataset:
    """The same pictures with other properties of cameras or target."""
    return replace(data, readings=replace(PictureReadings.of(data), rig=rig))
