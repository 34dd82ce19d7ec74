"""Blocks that stand on a plate and locate the tool, as numbers that a search can vary.

A block has six numbers on its plate: position of its face's centre (u, v from the plate's centre, h above its
top), inclination of the face (tilt) and its direction (azimuth), and rotation of the tool about the face's
normal (spin). With a = azimuth, t = tilt, s = spin the tool's rotation in the plate's frame is

    R = Rz(a) Ry(t) Rz(s) Rx(π),

so that the tool's z axis points into the face along −Rz(a) Ry(t) e_z. Flat blocks have t = 0 and one
height, stepped ones t = 0 and any height, tilted ones any tilt up to the maximum.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from jaxtyping import Bool, Float

from workbench.base import se3
from workbench.base.arguments import Angle, Length, admit
from workbench.base.errors import OptionError
from workbench.base.types import Matrix4, Poses
from workbench.plate.exchange import Exchange
from workbench.plate.plate import SQUARE, Plate

SIDE = 0.046
"""Side of the square bar from which blocks are cut [m]."""
STEEPEST = float(np.deg2rad(65.0))
"""Maximum tilt of a block on the plate [rad]."""
FOOT = 0.012
"""Minimum height of a block's lower edge: thread and dowels need it [m]."""
FLAT_HEIGHT = 0.05
"""Height of flat blocks [m]."""
IN_THE_AIR = (0.05, 0.35)
"""Heights above the plate of targets without blocks, which a ball-bar reads [m]."""

SHAPE = [2, 3, 5]
"""Columns of a block's numbers that determine its drawing: height, tilt, spin."""
UNLIKE = np.array([0.03, np.deg2rad(12.0), np.deg2rad(40.0)])
"""Differences of them with equal weight [m], [rad]."""
SAME_SHAPE = 1e-4
"""Distance below which two shapes count as the same."""

Places = Float[np.ndarray, "_ 6"]
"""u, v, h [m], tilt, azimuth, spin [rad] of each block."""


class BlockStyle(StrEnum):
    """Style of the blocks."""

    FLAT = "flat"
    STEPPED = "stepped"
    TILTED = "tilted"


@dataclass(frozen=True, kw_only=True)
class Blocks:
    """What blocks a plate may carry.

    Args:
        style: Flat, stepped or tilted.
        heights: Minimum and maximum height of a face's centre above the plate [m].
        max_tilt: Of a face [rad].
        tilts: The only tilts allowed, to reduce cost; any up to the maximum if empty [rad].
        turn: Azimuths and spins are multiples of this [rad]; any if 0.
        shapes: The only blocks that may be made, as height [m], tilt and spin [rad]; any if empty. Blocks of
            one shape differ in where they stand and which way they face, and need one drawing.
    """

    style: BlockStyle = BlockStyle.TILTED
    heights: tuple[Length, Length] = (0.04, 0.12)
    max_tilt: Angle = float(np.deg2rad(45.0))
    tilts: tuple[Angle, ...] = ()
    turn: Angle = 0.0
    shapes: tuple[tuple[Length, Angle, Angle], ...] = ()

    def __post_init__(self):
        admit(self)
        low, high = self.heights
        if not 0.0 < low <= high:
            raise OptionError(f"block heights must be positive and in order, got {low:g} to {high:g} m")
        if not all(0.0 <= t <= STEEPEST for t in (self.max_tilt, *self.tilts)):
            raise OptionError(
                f"the tilt of a block must be 0 to {np.rad2deg(STEEPEST):.0f}°, got "
                f"{np.rad2deg(max((self.max_tilt, *self.tilts), key=abs)):g}°"
            )
        if self.turn < 0.0:
            turn = f"{np.rad2deg(self.turn):g}°"
            raise OptionError(f"the step of block angles must not be negative, got {turn}")

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
        if self.style is BlockStyle.TILTED:
            made[:, 3] = np.clip(made[:, 3], 0.0, self.max_tilt)
            if self.tilts:
                allowed = np.array(self.tilts)
                made[:, 3] = allowed[np.abs(made[:, 3, None] - allowed).argmin(1)]
        else:
            made[:, 3:5] = 0.0
        if self.style is BlockStyle.FLAT:
            made[:, 2] = np.clip(FLAT_HEIGHT, *self.heights)
        if self.turn > 0.0:
            made[:, 4:] = np.round(made[:, 4:] / self.turn) * self.turn
        made[:, 4:] = np.arctan2(np.sin(made[:, 4:]), np.cos(made[:, 4:]))
        made[:, 2] = np.maximum(made[:, 2], 0.5 * SIDE * np.tan(made[:, 3]) + FOOT)
        if self.shapes:
            shapes = np.array(self.shapes)
            made[:, SHAPE] = shapes[shape_distances(made[:, SHAPE], shapes).argmin(1)]
        return made

    def fit(self, places: Places, half: Float[np.ndarray, "2"]) -> Bool[np.ndarray, " rows"]:
        """Which of some blocks may be made as they are."""
        return np.isclose(self.makeable(places, half), places, atol=1e-6).all(1)


def shape_distances(
    some: Float[np.ndarray, "a 3"], others: Float[np.ndarray, "b 3"]
) -> Float[np.ndarray, "a b"]:
    """Dissimilarity of shapes: heights in units of 3 cm, tilts of 12°, spins of 40°."""
    difference = some[:, None] - others[None]
    difference[..., 2] = np.arctan2(np.sin(difference[..., 2]), np.cos(difference[..., 2]))
    return np.linalg.norm(difference / UNLIKE, axis=2)


def shapes_of(places: Places) -> Float[np.ndarray, "shapes 3"]:
    """The different shapes among blocks: height [m], tilt and spin [rad]."""
    found: list[np.ndarray] = []
    for shape in places[:, SHAPE]:
        if not found or shape_distances(shape[None], np.array(found)).min() > SAME_SHAPE:
            found.append(shape)
    return np.array(found).reshape(-1, 3)


def few_shapes(places: Places, number: int) -> tuple[tuple[float, float, float], ...]:
    """A small number of the blocks' shapes, chosen to be closest to the others."""
    distance = shape_distances(places[:, SHAPE], places[:, SHAPE]) ** 2

    def costs(chosen: list[int], slot: int) -> Float[np.ndarray, " options"]:
        near = distance[:, chosen[:slot] + chosen[slot + 1 :]].min(1, initial=np.inf)
        return np.minimum(distance, near[:, None]).sum(0)

    exchange = Exchange(costs, lambda chosen: float(distance[:, chosen].min(1).sum()))
    chosen = exchange.descend(exchange.fill(min(number, len(places)))).choice
    return tuple((float(h), float(t), float(s)) for h, t, s in places[chosen][:, SHAPE])


def tool_poses_at(plate: Plate, places: Places) -> Float[np.ndarray, "rows 4 4"]:
    """Poses of the tool at the blocks, in the robot's base."""
    tilt, azimuth, spin = places[:, 3], places[:, 4], places[:, 5]
    lean = se3.rpy_to_matrix(np.stack([np.zeros_like(tilt), tilt, azimuth], -1))
    turn = se3.rpy_to_matrix(np.stack([np.full_like(spin, np.pi), np.zeros_like(spin), spin], -1))
    return plate.pose @ se3.pose(lean @ turn, places[:, :3])


def places_of(plate: Plate, poses: Float[np.ndarray, "rows 4 4"]) -> Places:
    """The blocks that hold the tool at the poses (robot's base)."""
    return _places(se3.inverse(plate.pose) @ poses)


def _places(local: Float[np.ndarray, "rows 4 4"]) -> Places:
    """The blocks that hold the tool at poses in the plate's frame."""
    normal = -local[:, :3, 2]
    azimuth = np.arctan2(normal[:, 1], normal[:, 0])
    azimuth = np.where(np.hypot(normal[:, 0], normal[:, 1]) > 1e-9, azimuth, 0.0)
    tilt = np.arccos(np.clip(normal[:, 2], -1.0, 1.0))
    lean = se3.rpy_to_matrix(np.stack([np.zeros_like(tilt), tilt, azimuth], -1))
    own = np.swapaxes(lean, -1, -2) @ local[:, :3, :3]
    spin = np.arctan2(own[:, 1, 0], own[:, 0, 0])
    return np.column_stack([local[:, :3, 3], tilt, azimuth, spin])


def block_corners(place: Matrix4, poses: Poses) -> Float[np.ndarray, "rows 8 3"]:
    """Corners of the mitred square bars that hold the tool at poses (ARIA Fig. 6b), in the robot's base.

    Foot first, anticlockwise from above. A bar stands on the plate, turned by its face's azimuth; where the
    face is too steep, or below the plate, a short bar behind it stands for the block.
    """
    places = _places(se3.inverse(place) @ poses)
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
