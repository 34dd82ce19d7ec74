"""Cameras and the target that they see, as one instrument, and what they saw as the rows of a `Dataset`."""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import final

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.types import frozen
from workbench.data.dataset import Dataset, Labels
from workbench.data.observation import AbstractReadings
from workbench.extras.camera.camera import Camera, Mount, read_cameras
from workbench.extras.camera.target import PictureTarget, read_targets


def read_rig(camera: Path | str | None, target: Path | str) -> "Rig":
    """Cameras and target, or boards, of their files; without that of cameras the pictures tell of theirs."""
    return Rig(() if camera is None else read_cameras(camera), read_targets(target))


def owner_in(part: Camera | PictureTarget, session: str) -> str:
    """How the names of the unknowns of a camera's or board's pose in a session begin."""
    return f"{part.owner}[{session}]" if part.per_session and session else part.owner


@dataclass(frozen=True)
class RejectedCorner:
    """A corner that was set apart: where it was seen and how far off [px]."""

    image: str
    camera: str
    id: int
    corner: int
    off: float

    def __str__(self) -> str:
        return f"image {self.image} id {self.id} corner {self.corner} ({self.off:.3g} px)"


@dataclass(frozen=True, eq=False)
class Rig:
    """Cameras and what they see, with the arm in between.

    Args:
        cameras: One or more; none where no file describes them, until pictures are read.
        targets: One, or boards of which each has its own pose in what carries them all.
        rejected: Corners that contradict their pictures and are not used, the worst first.
        tool_poses: Whether poses of the tool were given in place of joints: the arm is `posed_arm`.
    """

    cameras: tuple[Camera, ...]
    targets: tuple[PictureTarget, ...]
    rejected: tuple[RejectedCorner, ...] = ()
    tool_poses: bool = False

    def __post_init__(self):
        for camera in self.cameras:
            if camera.mounted is self.mounted:
                both = f"camera '{camera.name}' and the target are both mounted = \"{camera.mounted}\""
                text = f"{both}, so that the arm moves neither; mount one on the tool and one in the world"
                raise DataError(text, column="mounted", found=camera.mounted)

    @property
    def posed(self) -> tuple[Camera | PictureTarget, ...]:
        return (*self.cameras, *self.targets)

    @property
    def mounted(self) -> Mount:
        """What carries the target."""
        return self.targets[0].mounted

    @cached_property
    def names(self) -> Int[np.ndarray, "points 2"]:
        """Id and corner of every point."""
        return np.concatenate([np.stack([t.ids, t.corners], axis=1) for t in self.targets])

    @cached_property
    def parts(self) -> tuple[tuple[PictureTarget, slice], ...]:
        """Every board, and where its points are among all."""
        ends = np.cumsum([len(target) for target in self.targets]).tolist()
        return tuple((t, slice(end - len(t), end)) for t, end in zip(self.targets, ends, strict=True))

    def points_named(
        self, ids: Int[np.ndarray, " n"], corners: Int[np.ndarray, " n"]
    ) -> Int[np.ndarray, " n"]:
        """Number of each named point among all; -1 for those that no board has."""
        place = {tuple(name): k for k, name in enumerate(self.names.tolist())}
        return np.array([place.get(p, -1) for p in zip(ids.tolist(), corners.tolist(), strict=True)], int)

    @property
    def text(self) -> str:
        return ", ".join(f"{t.name}: {t.text}" if t.name else t.text for t in self.targets)


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
        vars(self).update(pixels=frozen(self.pixels), sight=frozen(self.sight))

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
        if not isinstance(other, PictureReadings) or self.pixels.shape[1:] != other.pixels.shape[1:]:
            return None
        parts = ([getattr(each, name) for each in (self, other)] for name in ("pixels", "image", "sight"))
        pixels, image, sight = map(np.concatenate, parts)
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
