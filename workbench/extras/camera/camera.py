"""A camera: from points in its frame [m] to pixels and their derivatives by OpenCV; `camera.toml`.

The camera looks along its z axis, x to the right and y down; the first pixel's centre is (0, 0).
"""

from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, final

import numpy as np
from jaxtyping import Float

from workbench.base import se3
from workbench.base.arguments import Reads, not_below
from workbench.base.errors import MissingExtraError
from workbench.base.toml import AbstractTableReader
from workbench.base.types import Freedom, frozen

INTRINSICS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
"""Names of a camera's constants, in the order of `Camera.intrinsics`."""
FOCAL_SIGMA, CENTRE_SIGMA = 0.01, 0.01
"""Prior knowledge of `free = "auto"`, relative to the focal length and to the picture's width …"""
DISTORTION_SIGMA = (0.2, 0.2, 0.005, 0.005, 0.2)
"""… and of k1 k2 p1 p2 k3."""
NEAREST = 1e-3
"""Points nearer to the camera's plane than this [m] are projected as if they were this far before it."""
FREE = {False: Freedom.FIXED, True: Freedom.FREE, "auto": Freedom.AUTO}


@cache
def opencv() -> Any:
    """OpenCV, if it is installed."""
    try:
        import cv2

        cv2.aruco.CharucoDetector  # noqa: B018
    except (ImportError, AttributeError):
        raise MissingExtraError("working with pictures", extra="camera") from None
    return cv2


class Mount(StrEnum):
    """What carries a camera or a target."""

    WORLD = "world"
    TOOL = "tool"


ON = {Mount.TOOL: "on the tool", Mount.WORLD: "in the cell"}
"""Where that is, for people."""


class Projected(NamedTuple):
    """Pixels of points, and how they change.

    Args:
        pixel: (u, v).
        by_point: Per metre that the point moves in the camera's frame.
        by_intrinsics: Per unit of each of `INTRINSICS`.
    """

    pixel: Float[np.ndarray, "*lead 2"]
    by_point: Float[np.ndarray, "*lead 2 3"]
    by_intrinsics: Float[np.ndarray, "*lead 2 9"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Camera:
    """One camera.

    Args:
        name: As the pixel table calls it.
        size: Width and height of its pictures [px].
        intrinsics: fx fy cx cy [px], k1 k2 p1 p2 k3.
        mounted: Whether it stands in the cell or rides on the tool.
        free: Whether its intrinsics are known, identified, or identified with `sigma` as prior knowledge.
        sigma: Standard deviations of the intrinsics.
        per_session: Whether it may have another pose in every session.
        is_assumed: Whether no file describes it, and its pictures have not yet started its lens.
    """

    name: str
    size: tuple[int, int]
    intrinsics: Float[np.ndarray, "9"]
    mounted: Mount = Mount.WORLD
    free: Freedom = Freedom.AUTO
    sigma: Float[np.ndarray, "9"]
    per_session: bool = False
    is_assumed: bool = False

    @property
    def owner(self) -> str:
        """How the names of its unknowns begin."""
        return f"camera[{self.name}]"

    def carried(self, poses: Float[np.ndarray, "*lead 4 4"]) -> Float[np.ndarray, "*lead 4 4"]:
        """Poses of what carries the target, in what carries the camera, by the tool's."""
        return poses if self.mounted is Mount.WORLD else se3.inverse(poses)


def as_opencv(intrinsics: Float[np.ndarray, "9"]) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "5"]]:
    """Camera matrix and distortion of a camera's constants."""
    fx, fy, cx, cy, *distortion = np.asarray(intrinsics, float).tolist()
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]), np.array(distortion)


def project(points: Float[np.ndarray, "*lead 3"], intrinsics: Float[np.ndarray, "9"]) -> Projected:
    """Pixels of points in a camera's frame."""
    lead = points.shape[:-1]
    flat = np.array(points, float).reshape(-1, 3)
    if not len(flat):
        return Projected(np.zeros((*lead, 2)), np.zeros((*lead, 2, 3)), np.zeros((*lead, 2, 9)))
    flat[:, 2] = np.maximum(flat[:, 2], NEAREST)
    nil = np.zeros(3)
    found, slopes = opencv().projectPoints(flat, nil, nil, *as_opencv(intrinsics))
    slopes = slopes.reshape(*lead, 2, -1)  # by rotation, translation, focal lengths, centre, distortion
    return Projected(found.reshape(*lead, 2), slopes[..., 3:6], slopes[..., 6:15])


Positive = Annotated[float, Reads("a finite positive number", not_below(5e-324))]


@dataclass(frozen=True, kw_only=True)
class CameraEntry:
    """A `[[camera]]` table; `sigma` is one for fx fy cx cy, or four of these, or nine."""

    name: str = ""
    size: Annotated[tuple[int, int], Reads("width and height in px", lambda v, _: v if min(v) > 0 else None)]
    fx: Positive
    fy: Positive
    cx: float
    cy: float
    distortion: Annotated[
        tuple[float, float, float, float, float],
        Reads("k1 k2 p1 p2, or these and k3", lambda v, _: [*v, 0.0] if len(v) == 4 else v),
    ] = (0.0, 0.0, 0.0, 0.0, 0.0)
    mounted: Mount = Mount.WORLD
    free: bool | Literal["auto"] = "auto"
    sigma: Annotated[
        tuple[Positive, ...],
        Reads("1, 4 or 9 positive numbers", lambda v, _: v if np.size(v) in (1, 4, 9) else None),
    ] = ()
    per_session: bool = False

    def camera(self, number: int) -> Camera:
        """The camera, the first, second … of a file."""
        sigma = [FOCAL_SIGMA * self.fx, FOCAL_SIGMA * self.fy, *[CENTRE_SIGMA * self.size[0]] * 2]
        given = self.sigma * (4 if len(self.sigma) == 1 else 1)
        sigma = [*given, *[*sigma, *DISTORTION_SIGMA][len(given) :]]
        lens = np.array([self.fx, self.fy, self.cx, self.cy, *self.distortion], float)
        name = self.name or ("camera" if number == 1 else f"camera{number}")
        known: dict[str, Any] = {"name": name, "size": self.size, "per_session": self.per_session}
        known |= {"mounted": self.mounted, "free": FREE[self.free]}
        return Camera(intrinsics=frozen(lens), sigma=frozen(np.array(sigma, float)), **known)


@final
class _CameraReader(AbstractTableReader):
    wanted = "a camera.toml: [[camera]] with size, fx, fy, cx, cy, distortion = [k1, k2, p1, p2, k3], mounted"
    otherwise = f"{wanted}; without one the pictures tell the lens"


def read_cameras(path: Path | str) -> tuple[Camera, ...]:
    """The cameras of a file."""
    reader = _CameraReader(path)
    data = reader.load()
    reader.keys(data, {"camera"}, "the file")
    tables = enumerate(reader.tables(data, "camera"), 1)
    cameras = tuple(reader.record(CameraEntry, t, f"[[camera]] {k}").camera(k) for k, t in tables)
    if len({camera.name for camera in cameras}) < max(len(cameras), 1):
        raise reader.fail("needs one [[camera]] table or more, each with its own name")
    return cameras
