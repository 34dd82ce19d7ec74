"""A camera: from points in its frame [m] to pixels and their derivatives by OpenCV; `camera.toml`.

The camera looks along its z axis, x to the right and y down; the first pixel's centre is (0, 0).
"""

from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, final

import numpy as np
from jaxtyping import Float

from workbench.base import se3
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
PER_SESSION = "per_session"
"""Key of a camera, and of a board, that may have another pose in every session."""
KEYS = ("name", "size", *INTRINSICS[:4], "distortion", "mounted", "free", "sigma", PER_SESSION)
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


@final
class _CameraReader(AbstractTableReader):
    wanted = "a camera TOML with [[camera]] tables"
    otherwise = "a camera TOML (size, fx, fy, cx, cy, distortion, mounted, free)"

    def camera(self, table: dict[str, Any], number: int) -> Camera:
        what = f"[[camera]] {number + 1}"
        self.keys(table, {*KEYS}, what)
        if missing := [key for key in ("size", *INTRINSICS[:4]) if key not in table]:
            wanted = "size = [width, height], fx, fy, cx and cy in px"
            raise self.fail(f"{what} has no {missing[0]}; give {wanted}")
        size = self.numbers(table["size"], 2, f"{what} size")
        if (size < 1).any():
            raise self.fail(f"{what} size must be positive, got {table['size']}")
        pinhole = [self.number(table[key], f"{what} {key}") for key in INTRINSICS[:4]]
        if min(pinhole[:2]) <= 0.0:
            raise self.fail(f"{what} fx and fy must be positive, got {pinhole[0]:g} and {pinhole[1]:g}")
        bent = table.get("distortion", [0.0] * 5)
        distortion = self.numbers(bent, 5, f"{what} distortion (k1 k2 p1 p2 k3)")
        if (mounted := table.get("mounted", "world")) not in tuple(Mount):
            raise self.fail(f'{what} mounted must be "world" or "tool", not {mounted!r}')
        free = table.get("free", "auto")
        if not (isinstance(free, bool) or free == "auto"):
            raise self.fail(f'{what} free must be true, false or "auto", not {free!r}')
        return Camera(
            name=str(table.get("name", "camera" if number == 0 else f"camera{number + 1}")),
            size=(int(size[0]), int(size[1])),
            intrinsics=frozen(np.concatenate([pinhole, distortion])),
            mounted=Mount(mounted),
            free=FREE[free],
            sigma=self.sigma(table.get("sigma"), pinhole, size, what),
            per_session=self.flag(table.get(PER_SESSION, False), f"{what} {PER_SESSION}"),
        )

    def sigma(self, value: Any, pinhole: list[float], size: np.ndarray, what: str) -> np.ndarray:
        """Nine standard deviations: the file's, or the first four in px, or one for these, else ours."""
        usual = np.array(
            [*(FOCAL_SIGMA * f for f in pinhole[:2]), *[CENTRE_SIGMA * size[0]] * 2, *DISTORTION_SIGMA]
        )
        if value is not None:
            given = self.numbers(value if isinstance(value, list) else [value] * 4, None, f"{what} sigma")
            if len(given) not in (4, 9) or (given <= 0.0).any():
                raise self.fail(
                    f"{what} sigma must be one, 4 (fx fy cx cy) or 9 positive numbers, not {value!r}"
                )
            usual[: len(given)] = given
        return frozen(usual)


def read_cameras(path: Path | str) -> tuple[Camera, ...]:
    reader = _CameraReader(path)
    data = reader.load()
    reader.keys(data, {"camera"}, "the file")
    cameras = tuple(reader.camera(table, i) for i, table in enumerate(reader.tables(data, "camera")))
    if not cameras:
        raise reader.fail("has no [[camera]] table")
    names = [camera.name for camera in cameras]
    if twice := {name for name in names if names.count(name) > 1}:
        raise reader.fail(f"has two cameras named '{min(twice)}'; names must differ")
    return cameras
