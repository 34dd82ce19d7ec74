"""Blocks that stand on a plate and locate the tool, as numbers that a search can vary.

A block has six numbers on its plate: position of its face's centre (u, v from the plate's centre, h above its
top), inclination of the face (tilt) and its direction (azimuth), and rotation of the tool about the face's
normal (spin). With a = azimuth, t = tilt, s = spin the tool's rotation in the plate's frame is

    R = Rz(a) Ry(t) Rz(s) Rx(π),

so that the tool's z axis points into the face along −Rz(a) Ry(t) e_z.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float

from workbench.base import se3
from workbench.base.arguments import Angle, Length, admit
from workbench.base.errors import OptionError
from workbench.base.types import Matrix4, Poses
from workbench.plate.plate import SQUARE, Plate

SIDE = 0.046
"""Side of the square bar from which blocks are cut [m]."""
STEEPEST = float(np.deg2rad(65.0))
"""Maximum tilt of a block on the plate [rad]."""
FOOT = 0.012
"""Minimum height of a block's lower edge: thread and dowels need it [m]."""
APART = float(np.sqrt(2.0)) * SIDE
"""Blocks at this distance don't overlap, however they are turned [m]."""
Places = Float[np.ndarray, "_ 6"]
"""u, v, h [m], tilt, azimuth, spin [rad] of each block."""


@dataclass(frozen=True, kw_only=True)
class Blocks:
    """What blocks a plate may carry.

    Args:
        heights: Minimum and maximum height of a face's centre above the plate [m].
        max_tilt: Maximum angle between a face and the plate [rad]; flat blocks if 0.
    """

    heights: tuple[Length, Length] = (0.04, 0.12)
    max_tilt: Angle = float(np.deg2rad(45.0))

    def __post_init__(self):
        admit(self)
        low, high = self.heights
        if not 0.0 < low <= high:
            raise OptionError(f"block heights must be positive and in order, got {low:g} to {high:g} m")
        if self.max_tilt > STEEPEST:
            limit, found = np.rad2deg([STEEPEST, self.max_tilt])
            raise OptionError(f"max_tilt must be 0 to {limit:.0f}°, got {found:g}°", option="max_tilt")

    def draw(self, rows: int, half: Float[np.ndarray, "2"], *, rng: np.random.Generator) -> Places:
        """Random blocks whose faces' centres lie within ±half of the plate's centre [m]."""
        places = np.empty((rows, 6))
        places[:, :2] = rng.uniform(-half, half, (rows, 2))
        places[:, 2] = rng.uniform(*self.heights, rows)
        places[:, 3] = np.arccos(rng.uniform(np.cos(self.max_tilt), 1.0, rows))
        places[:, 4:] = rng.uniform(-np.pi, np.pi, (rows, 2))
        return self.makeable(places, half)

    def makeable(self, places: Places, half: Float[np.ndarray, "2"]) -> Places:
        """The nearest blocks that can be made."""
        made = places.copy()
        made[:, :2] = np.clip(made[:, :2], -half, half)
        made[:, 2] = np.clip(made[:, 2], *self.heights)
        made[:, 3] = np.clip(made[:, 3], 0.0, self.max_tilt)
        made[:, 4:] = np.arctan2(np.sin(made[:, 4:]), np.cos(made[:, 4:]))
        made[:, 2] = np.maximum(made[:, 2], 0.5 * SIDE * np.tan(made[:, 3]) + FOOT)
        return made

    def fit(self, places: Places, half: Float[np.ndarray, "2"]) -> Bool[np.ndarray, " rows"]:
        """Which of some blocks may be made as they are."""
        return np.isclose(self.makeable(places, half), places, atol=1e-6).all(1)


def tool_poses_at(plate: Plate, places: Places) -> Float[np.ndarray, "rows 4 4"]:
    """Poses of the tool at the blocks, in the robot's base."""
    tilt, azimuth, spin = places[:, 3], places[:, 4], places[:, 5]
    lean = se3.rpy_to_matrix(np.stack([np.zeros_like(tilt), tilt, azimuth], -1))
    turn = se3.rpy_to_matrix(np.stack([np.full_like(spin, np.pi), np.zeros_like(spin), spin], -1))
    return plate.pose @ se3.pose(lean @ turn, places[:, :3])


def places_of(place: Matrix4, poses: Poses) -> Places:
    """The blocks that hold the tool at the poses, on a plate at a place (robot's base)."""
    local = se3.inverse(place) @ poses
    normal = -local[:, :3, 2]
    azimuth = np.arctan2(normal[:, 1], normal[:, 0])
    azimuth = np.where(np.hypot(normal[:, 0], normal[:, 1]) > 1e-9, azimuth, 0.0)
    tilt = np.arccos(np.clip(normal[:, 2], -1.0, 1.0))
    lean = se3.rpy_to_matrix(np.stack([np.zeros_like(tilt), tilt, azimuth], -1))
    own = np.swapaxes(lean, -1, -2) @ local[:, :3, :3]
    spin = np.arctan2(own[:, 1, 0], own[:, 0, 0])
    return np.column_stack([local[:, :3, 3], tilt, azimuth, spin])


@lru_cache(maxsize=8)
def overlapping_blocks(plate: Plate) -> str:
    """The first two targets of a plate whose blocks overlap, in words; empty where none do."""
    if plate.size is None:
        return ""
    places = places_of(plate.pose, plate.poses)
    gaps = np.linalg.norm(places[:, None, :2] - places[None, :, :2], axis=2)
    for i, k in np.argwhere(np.triu(gaps < APART, 1)).tolist():
        turn = places[[i, k], 4] + 0.5 * np.pi * np.arange(2)[:, None]
        axes = np.stack([np.cos(turn), np.sin(turn)], -1).reshape(4, 2)  # of the squares' edges
        halves = 0.5 * SIDE * np.abs(axes @ axes.T).sum(1)  # of both shadows on each axis, together
        if (np.abs(axes @ (places[i, :2] - places[k, :2])) < halves).all():
            both = f"the blocks of targets {i + 1} and {k + 1} overlap"
            return f"{both} ({1e3 * gaps[i, k]:.0f} mm apart, bar of {1e3 * SIDE:.0f} mm)"
    return ""


def block_corners(place: Matrix4, poses: Poses) -> Float[np.ndarray, "rows 8 3"]:
    """Corners of the mitred square bars that hold the tool at poses (ARIA Fig. 6b), in the robot's base.

    Foot first, anticlockwise from above. A bar stands on the plate, turned by its face's azimuth; where the
    face is too steep, or below the plate, a short bar behind it stands for the block.
    """
    places = places_of(place, poses)
    tilt, cos, sin = np.minimum(places[:, 3], STEEPEST), np.cos(places[:, 4]), np.sin(places[:, 4])
    square = np.tile(0.5 * SIDE * SQUARE, (len(poses), 1, 1))
    foot = np.concatenate([square, np.zeros((*square.shape[:2], 1))], axis=2)
    top = foot.copy()
    top[:, :, 2] = places[:, None, 2] - square[:, :, 0] * np.tan(tilt)[:, None]
    standing = np.tile(np.eye(4), (len(poses), 1, 1))
    standing[:, :2, :2] = np.moveaxis(np.array([[cos, -sin], [sin, cos]]), 2, 0)
    standing[:, :2, 3] = places[:, :2]
    free = (places[:, 3] > STEEPEST) | (top[:, :, 2].min(1) <= 0.0)
    foot[free] *= [1.0, -1.0, 1.0]
    top[free] = foot[free]
    foot[free, :, 2] = 0.6 * SIDE
    frame = np.where(free[:, None, None], poses, place @ standing)
    return se3.apply(frame[:, None], np.concatenate([foot, top], axis=1))
