"""A lens from nothing: cameras that no file describes, started from their pictures.

The size of the pictures gives the lens's centre. The best of several fields of view is taken, by how well the
target's points, picture by picture, lie where they were seen. fx, fy, cx, cy, k1 and k2 are then refined
together with the target's pose in each picture. That is a start: the bundle identifies the lens again, with
the arm.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from workbench.base.errors import DataError
from workbench.base.types import frozen
from workbench.base.wording import plural
from workbench.extras.camera.camera import DISTORTION_SIGMA, Camera, Mount, as_opencv, opencv
from workbench.extras.camera.resection import FAR_OFF, placed_alone
from workbench.extras.camera.rig import Rig

FOCAL_SIGMA = 0.5
"""How well a focal length is known from nothing, relative to it."""
LENSES = ((0.5, 0.0), (0.7, -0.2), (1.0, 0.0), (1.8, 0.0), (3.2, 0.0))
"""Focal lengths that are tried, per width of the picture (fields of view from 90° to 18°), with k1."""
REFINED, VIEWS = 3, 16
"""Lenses that are refined, and pictures of each board that take part."""
WRONG, MIN_VIEW = 6.0, 6
"""Times the median of a picture beyond which its corners are left out, and corners that it must have left."""
SPARE = 24
"""Numbers that the pictures must have beyond the target's pose in each."""


def with_assumed(rig: Rig, names: Iterable[str], size: tuple[int, int], centre: float) -> Rig:
    """The rig with cameras on what does not carry the target, where no file describes any.

    Args:
        names: Of the cameras; "" for the only one.
        size: Of their pictures [px].
        centre: How well the lens's centre is known, per width.
    """
    f, height = map(float, size)
    start = frozen(np.array([f, f, 0.5 * (f - 1.0), 0.5 * (height - 1), *np.zeros(5)]))
    sigma = frozen(np.array([FOCAL_SIGMA * f, FOCAL_SIGMA * f, *[centre * f] * 2, *DISTORTION_SIGMA]))
    other = Mount.WORLD if rig.mounted is Mount.TOOL else Mount.TOOL
    one = Camera(name="camera", size=size, intrinsics=start, mounted=other, sigma=sigma, is_assumed=True)
    return replace(rig, cameras=tuple(replace(one, name=n or one.name) for n in dict.fromkeys(names)))


def with_lenses(rig: Rig, pixels: Float[np.ndarray, "rows cameras points 2"]) -> tuple[Rig, list[str]]:
    """The rig with the lens of every assumed camera as its pictures start it, and what was assumed."""
    cameras, notes = list(rig.cameras), []
    for c, camera in enumerate(cameras):
        if camera.is_assumed:
            cameras[c] = _started(camera, rig, pixels[:, c])
            at = "in the cell, the target on the tool" if camera.mounted is Mount.WORLD else "on the tool"
            size = "{} x {} px".format(*camera.size)
            text = f"no camera.toml: camera '{camera.name}' is assumed {at}, its pictures {size}"
            start = f"starting at a focal length of {cameras[c].intrinsics[0]:.0f} px"
            notes.append(f"{text}; the lens is identified from them, {start}")
    return replace(rig, cameras=tuple(cameras)), notes


def _started(camera: Camera, rig: Rig, pixels: Float[np.ndarray, "rows points 2"]) -> Camera:
    """A camera with the lens that suits what it saw."""
    boards, spare = [], 0
    for target, part in rig.parts:
        seen = np.where(target.placing[:, None], pixels[:, part], np.nan)
        seen = seen[np.isfinite(seen[..., 0]).sum(1) >= 4]
        seen = seen[np.unique(np.linspace(0, max(len(seen) - 1, 0), VIEWS).astype(int))[: len(seen)]]
        spare += 2 * int(np.isfinite(seen[..., 0]).sum()) - 6 * len(seen)
        boards.append((target, seen))
    if spare < SPARE:
        few = f"{plural(sum(len(seen) for _, seen in boards), 'picture')} of camera '{camera.name}'"
        few += " with four or more points of the target are too few to identify its lens"
        raise DataError(f"{few}; take more, or give a camera.toml")
    lenses = ((part * camera.size[0], k1) for part, k1 in LENSES)
    tried = sorted((_tried(camera, f, k1, boards) for f, k1 in lenses), key=lambda each: each[0])
    found = min((_refined(*each) for each in tried[:REFINED]), key=lambda each: each[0])[1]
    return replace(camera, intrinsics=frozen(found), is_assumed=False)


def _tried(camera: Camera, focal: float, k1: float, boards: list) -> tuple[float, Camera, list]:
    """Mean distance of corners [px] by a lens, large ones clipped; the lens; points and pixels of each view
    near to it."""
    lens = [focal, focal, *camera.intrinsics[2:4], k1, 0.0, 0.0, 0.0, 0.0]
    camera = replace(camera, intrinsics=frozen(np.array(lens)))
    views, off = [], [np.array([FAR_OFF])]
    for target, seen in boards:
        rows, _, far = placed_alone(seen, camera, target)
        off.append(np.minimum(far[np.isfinite(far)], FAR_OFF))
        for row, each in zip(rows, far, strict=True):
            near = each <= max(WRONG * float(np.nanmedian(each)), 2.0)
            if near.sum() >= MIN_VIEW:
                views.append((target.points[near], seen[row, near]))
    return float(np.concatenate(off).mean()), camera, views


def _refined(off: float, camera: Camera, views: list) -> tuple[float, Float[np.ndarray, "9"]]:
    """Error [px] and intrinsics after OpenCV's search in fx, fy, cx, cy, k1, k2 and the poses."""
    cv2 = opencv()
    points, pixels = ([part[k].astype(np.float32) for part in views] for k in (0, 1))
    flags = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3
    until = cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-12
    given = points, pixels, camera.size, *as_opencv(camera.intrinsics)
    try:
        off, k, more, *_ = cv2.calibrateCamera(*given, flags=flags, criteria=until)
    except cv2.error:
        return off, camera.intrinsics
    return off, np.array([k[0, 0], k[1, 1], k[0, 2], k[1, 2], *more.ravel()[:2], 0.0, 0.0, 0.0])
