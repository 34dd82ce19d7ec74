"""Pictures of printed boards, rendered by other code than the package's: rays from pixels to the paper."""

from functools import lru_cache

import numpy as np
from generator import four
from scipy.ndimage import gaussian_filter

COARSE = 8
"""Every such ray is asked whether it may meet the sheet."""


def undistorted(uv, intrinsics):
    """X/Z, Y/Z of pixels, by Newton's method on the radial and tangential law."""
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = intrinsics
    seen = (uv - [cx, cy]) / [fx, fy]
    x, y = seen[..., 0].copy(), seen[..., 1].copy()
    for _ in range(8):
        r2 = x * x + y * y
        radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
        dx = 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        dy = p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        x, y = (seen[..., 0] - dx) / radial, (seen[..., 1] - dy) / radial
    return x, y


@lru_cache(maxsize=2)
def _rays(intrinsics, size, fine):
    """Direction of each ray (X/Z, Y/Z, 1): the costly part, and the same for every picture of a camera."""
    steps = (np.arange(fine) + 0.5) / fine - 0.5
    uv = np.stack(np.meshgrid(*((np.arange(n)[:, None] + steps).ravel() for n in size)), axis=-1)
    x, y = undistorted(uv, intrinsics)
    return np.stack([x, y, np.ones_like(x)], axis=-1)


def render(paper, metres, target_in_camera, intrinsics, size, *, rng, blur=0.6, noise=2.0, fine=2):
    """A picture of a sheet.

    Args:
        paper: Grey values of the sheet, its first dot at the target's origin.
        metres: Size of a dot [m].
        target_in_camera: 4×4 pose; the sheet is the plane z = 0, x along its rows, y down.
        intrinsics: fx fy cx cy k1 k2 p1 p2 k3.
        size: Width and height [px].
        rng: Source of the noise.
        blur: Standard deviation of the blur [px].
        noise: Standard deviation of the noise [grey values].
        fine: Rays a pixel and direction.
    """
    width, height = size
    r, t = target_in_camera[:3, :3], target_in_camera[:3, 3]
    rays = _rays(tuple(intrinsics), size, fine)
    grey = np.full(rays.shape[:2], 120.0)
    part = _around(rays, target_in_camera, metres * np.array(paper.shape))
    ahead = rays[part] @ r
    far = (t @ r[:, 2]) / ahead[..., 2]
    place = (ahead[..., :2] * far[..., None] - t @ r[:, :2]) / metres
    column, row = np.floor(place).astype(int).transpose(2, 0, 1)
    on = (far > 0) & (column >= 0) & (row >= 0) & (column < paper.shape[1]) & (row < paper.shape[0])
    grey[part][on] = paper[row[on], column[on]] * 0.8 + 25.0
    grey = grey.reshape(height, fine, width, fine).mean((1, 3))
    grey = gaussian_filter(grey, blur)
    return np.clip(grey + rng.normal(0, noise, grey.shape), 0, 255).astype(np.uint8)


def _around(rays, pose, edge):
    """Rows and columns of rays that may meet a sheet so high and wide; all, where that is not plain."""
    corners = edge[::-1] * [[0, 0], [0, 1], [1, 0], [1, 1]] @ pose[:3, :2].T + pose[:3, 3]
    seen, few = corners[:, :2] / corners[:, 2:], rays[::COARSE, ::COARSE, :2]
    inside = ((few > seen.min(0)) & (few < seen.max(0))).all(-1)
    if not inside.any() or (corners[:, 2] < 1e-3).any():
        return slice(None), slice(None)
    ends = (np.flatnonzero(inside.any(axis))[[0, -1]] for axis in (1, 0))
    return tuple(slice(max(COARSE * (low - 1), 0), COARSE * (high + 1) + 1) for low, high in ends)


def looking_at(eye, middle, roll=0.0):
    """Pose of a target in a camera that stands at `eye` (in the target's frame) and looks at `middle`."""
    z = (middle - eye) / np.linalg.norm(middle - eye)
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    c, s = np.cos(roll), np.sin(roll)
    axes = np.stack([c * x + s * y, c * y - s * x, z])
    return four(axes, -axes @ eye)
