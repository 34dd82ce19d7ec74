"""A reading: one hypothesis about what the rows of a file mean, and how well it fits."""

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from workbench.arm import chain as chains
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.wording import in_mm
from workbench.data.dataset import Dataset
from workbench.identification.meaning.bounds import WEIGHT

FITS, FITS_TURN = 0.02, float(np.radians(5.0))
"""Misfit as a share of the reach, and of orientations [rad], beyond which rows don't belong to an arm."""
FOREIGN_MISFIT = 0.12
"""Share of the reach beyond which rows that no reading explains are of no such arm."""
NARROW = 0.05
"""Maximum misfit of a changed reading as a share of how far the rows move the arm."""
GOOD, EXOTIC = 0.006, 3.5
"""Readings more complex than the second must leave less than the first share of the reach."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Reading:
    """What rows mean: joints = w q + zero, positions, orientations, and whose.

    Args:
        robot: The arm that moved, without effects; base and tool that fit best once it is placed.
        w: Columns of q to joints.
        zero: Zeros [rad or m].
        scale: Factor of positions.
        axes: Axes of positions, which are columns x, y, z times this: exchanged or inverted ones.
        inverse: Whether poses are of the base in the tool.
        orientation: Convention of the orientation columns, in words; empty as declared.
        rotations: Orientations of the rows, read so; None without.
        cost: Complexity of the changes.
        changes: Those of joints, units and handedness, in words.
        position: Root mean square distance of the rows that fit [m].
        rotation: Likewise of orientations [rad]; NaN without.
        motion: Misfit as a share of how far the rows move the arm.
        apart: Indices of rows that stand off.
    """

    robot: Robot
    w: Float[np.ndarray, "n m"]
    zero: Float[np.ndarray, " n"]
    scale: float = 1.0
    axes: Float[np.ndarray, "3 3"] = field(default_factory=lambda: np.eye(3))
    inverse: bool = False
    orientation: str = ""
    rotations: Float[np.ndarray, "rows 3 3"] | None = None
    cost: float = 0.0
    changes: tuple[str, ...] = ()
    position: float = np.inf
    rotation: float = np.nan
    motion: float = np.inf
    apart: tuple[int, ...] = ()

    @classmethod
    def plain(cls, robot: Robot) -> "Reading":
        """The rows as their headings say."""
        return cls(robot=robot.bare, w=np.eye(robot.dof), zero=np.zeros(robot.dof))

    @property
    def score(self) -> float:
        """Misfit as a share of the reach, angles weighted."""
        return float(np.hypot(self.position / self.robot.reach, WEIGHT * np.nan_to_num(self.rotation)))

    @property
    def mirrored(self) -> bool:
        """Whether x, y, z are left-handed."""
        return bool(np.linalg.det(self.axes) < 0.0)

    @property
    def moves_otherwise(self) -> bool:
        """Whether joints or frames are read otherwise than the headings say, beyond a unit."""
        unit = self.w[0, 0] if self.w[0, 0] > 0.0 else 1.0
        other = self.inverse or self.mirrored or bool(self.zero.any())
        return other or not np.allclose(self.w, unit * np.eye(*self.w.shape))

    @property
    def only_zeros(self) -> bool:
        """Whether nothing but zeros of joints is read otherwise."""
        frames = self.inverse or self.mirrored or self.scale != 1.0
        return not frames and np.array_equal(self.w, np.eye(*self.w.shape))

    @property
    def is_plain(self) -> bool:
        """Whether nothing is changed but, perhaps, the convention of orientations."""
        return not self.changes

    @property
    def fits(self) -> bool:
        """Whether the rows can be the arm's when read so."""
        if not self.position < FITS * self.robot.reach or self.rotation > FITS_TURN:
            return False
        if not self.moves_otherwise:
            return True
        narrow = NARROW / (1.0 + max(self.cost - 1.5, 0.0) / 4.0)
        return self.motion < narrow and (self.cost < EXOTIC or self.score < GOOD)

    @property
    def size(self) -> str:
        """`0.03 mm, 0.01°`."""
        turned = "" if np.isnan(self.rotation) else f", {np.degrees(self.rotation):.2g}°"
        return f"{in_mm(self.position)}{turned}"

    @property
    def text(self) -> str:
        return "; ".join([*self.changes, *([self.orientation] if self.orientation else [])]) or "as given"

    def joints(self, q: Float[np.ndarray, "... m"]) -> Float[np.ndarray, "... n"]:
        return q @ self.w.T + self.zero

    def flange(self, q: Float[np.ndarray, "*s m"]) -> Float[np.ndarray, "*s 4 4"]:
        """Poses of the bare flange in its base, or of that in the flange where poses are inverse."""
        return flange_poses(self.robot, self.joints(q), inverse=self.inverse)

    def apply(self, data: Dataset) -> Dataset:
        """The rows of a file, read so; their own base and tool are to be found."""
        position = data.position
        if position is not None:
            position = self.scale * position @ self.axes
        rotation = self.rotations if self.rotations is not None else data.rotation
        if self.inverse and position is not None and rotation is not None:
            rotation = np.swapaxes(rotation, -1, -2)
            position = -(rotation @ position[..., None])[..., 0]
        return replace(data, q=self.joints(data.q), position=position, rotation=rotation, written=None)


def flange_poses(robot: Robot, q: np.ndarray, *, inverse: bool = False) -> np.ndarray:
    """Poses of the flange in the arm's base for joints (…, n), or of the base in the flange."""
    poses = chains.poses(robot.bare.chain, np.ascontiguousarray(q.reshape(-1, q.shape[-1])))
    poses = se3.inverse(poses) if inverse else poses
    return poses.reshape(*q.shape[:-1], 4, 4)
