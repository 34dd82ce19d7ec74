"""A reading: one hypothesis about what the rows of a file mean, and how well it fits."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.arm.conventions import ORDERS
from workbench.arm.joint_units import sliding
from workbench.arm.robot import Robot
from workbench.arm.signs_and_offsets import with_couplings, with_signs_and_offsets
from workbench.base.wording import in_mm
from workbench.data.dataset import Dataset
from workbench.identification.meaning.bounds import WEIGHT, flange_poses
from workbench.identification.meaning.conventions import Convention

FITS, FITS_TURN = 0.02, float(np.radians(5.0))
"""Misfit as a share of the reach, and of orientations [rad], beyond which rows don't belong to an arm."""
OTHER_FITS = 0.01
"""The same for an arm that isn't said to have moved."""
FOREIGN_MISFIT = 0.12
"""Share of the reach beyond which rows that no reading explains are of no such arm."""
NARROW = 0.05
"""Maximum misfit of a changed reading as a share of how far the rows move the arm."""
GOOD, EXOTIC = 0.006, 3.5
"""Readings more complex than the second must leave less than the first share of the reach."""
LENGTHS = {1e-3: "mm read as m", 1e3: "m read as mm", 0.0254: "inch read as m", 1e-2: "cm read as m",
           25.4: "inch read as mm", 10.0: "cm read as mm", 0.1: "mm read as cm"}  # fmt: skip
LEFT_HANDED = -np.eye(3)
"""Axes of which no more is known."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RowReading:
    """What rows mean: joints = w q + zero, positions, orientations, and whose.

    Args:
        robot: The arm that moved, without effects, base and tool.
        other: Name by which it is loaded where it isn't the one that is said to have moved.
        unit: Factor of the columns of joints that turn.
        w: Columns of q to joints.
        zero: Zeros [rad or m].
        scale: Factor of positions.
        axes: Axes of positions, which are columns x, y, z times this: exchanged or inverted ones.
        inverse: Whether poses are of the base in the tool.
        convention: Of the orientation columns; None without orientations.
        cost: Complexity of the changes.
        base: Pose of its base that fits the rows best.
        tool: Likewise of what was measured in its flange.
        position: Root mean square distance of the rows that fit [m].
        rotation: Likewise of orientations [rad]; NaN without.
        motion: Misfit as a share of how far the rows move the arm.
        apart: Indices of rows that stand off.
    """

    robot: Robot
    other: str = ""
    unit: float = 1.0
    w: Float[np.ndarray, "n m"]
    zero: Float[np.ndarray, " n"]
    scale: float = 1.0
    axes: Float[np.ndarray, "3 3"] = field(default_factory=lambda: np.eye(3))
    inverse: bool = False
    convention: Convention | None = None
    cost: float = 0.0
    base: Float[np.ndarray, "4 4"] = field(default_factory=lambda: np.eye(4))
    tool: Float[np.ndarray, "4 4"] = field(default_factory=lambda: np.eye(4))
    position: float = np.inf
    rotation: float = np.nan
    motion: float = np.inf
    apart: tuple[int, ...] = ()

    @classmethod
    def plain(cls, robot: Robot) -> "RowReading":
        """The rows as their headings say."""
        return cls(robot=robot.bare, w=np.eye(robot.dof), zero=np.zeros(robot.dof))

    @property
    def score(self) -> float:
        """Misfit as a share of the reach, angles weighted."""
        return float(np.hypot(self.position / self.robot.reach, WEIGHT * np.nan_to_num(self.rotation)))

    @cached_property
    def mirrored(self) -> bool:
        """Whether x, y, z are left-handed."""
        return bool(np.linalg.det(self.axes) < 0.0)

    @property
    def columns_as_given(self) -> bool:
        """Whether each column is its joint, but for its unit and zero."""
        return np.array_equal(self.w, np.eye(*self.w.shape))

    @property
    def moves_otherwise(self) -> bool:
        """Whether joints or frames are read otherwise than the headings say, beyond a unit."""
        return self.inverse or self.mirrored or bool(self.zero.any()) or not self.columns_as_given

    @property
    def only_zeros(self) -> bool:
        """Whether nothing but zeros of joints is read otherwise."""
        return replace(self, zero=np.zeros_like(self.zero)).is_plain

    @cached_property
    def changes(self) -> tuple[str, ...]:
        """What is read otherwise of joints, units and handedness, in words."""
        found = [f"the arm is {self.robot.name}"] if self.other else []
        if self.unit != 1.0:
            unit = "degrees labelled rad (q1[deg]" if self.unit < 1.0 else "rad labelled degrees (q1[rad]"
            found.append(f"the joints are {unit} …)")
        if self.mirrored and np.array_equal(self.axes, LEFT_HANDED):
            turned = "" if self.convention is None else ", and orientations with them"
            found.append(f"left-handed axes (two of x, y, z exchanged, or one inverted){turned}")
        elif self.mirrored:
            changed = ["xyz"[k] for k in range(3) if self.axes[k, k] != 1.0]
            text = "is inverted" if len(changed) == 1 else "are exchanged"
            found.append(f"{' and '.join(changed)} {text}")
        if self.zero.any() or not self.columns_as_given:
            found += _joint_texts(self.w, self.zero, np.array(sliding(self.robot), bool))
        if self.inverse:
            found.append("poses are of the base in the tool")
        if self.scale != 1.0:
            found.append(f"the positions are {LENGTHS[self.scale]}")
        return tuple(found)

    @property
    def orientation(self) -> str:
        """Convention of the orientation columns, in words; empty as declared."""
        return "" if self.convention is None else self.convention.text

    @property
    def is_plain(self) -> bool:
        """Whether nothing is changed but, perhaps, the convention of orientations."""
        return not self.changes

    @property
    def fits(self) -> bool:
        """Whether the rows can be the arm's when read so."""
        limit = OTHER_FITS if self.other else FITS
        if not self.position < limit * self.robot.reach or self.rotation > FITS_TURN:
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
    def name(self) -> str:
        """All that is changed, as a person would repeat it."""
        return "; ".join(change.partition(" (")[0] for change in self.changes)

    @property
    def text(self) -> str:
        return "; ".join([*self.changes, *([self.orientation] if self.orientation else [])]) or "as given"

    def joints(self, q: Float[np.ndarray, "... m"]) -> Float[np.ndarray, "... n"]:
        return self.in_units(q) @ self.w.T + self.zero

    def in_units(self, q: Float[np.ndarray, "... m"]) -> Float[np.ndarray, "... m"]:
        """Columns in rad or m."""
        return q if self.unit == 1.0 else q * units(self.robot, q.shape[-1], self.unit)

    def flange(self, q: Float[np.ndarray, "*s m"]) -> Float[np.ndarray, "*s 4 4"]:
        """Poses of the bare flange in its base, or of that in the flange where poses are inverse."""
        return flange_poses(self.robot, self.joints(q), inverse=self.inverse)

    def apply(self, data: Dataset, *, joints: bool = True) -> Dataset:
        """The rows of a file, read so; their own base and tool are to be found.

        Args:
            joints: Whether joints are read so, beyond their unit; not where the arm counts them so.
        """
        position, rotation = self.poses(data)
        seen: dict[str, Any] = {"position": position, "rotation": rotation, "q": self.in_units(data.q)}
        if self.convention is not None:
            seen["written"] = None
        if joints:
            seen["q"] = self.joints(data.q)
            if data.torque is not None:
                seen["torque"] = data.torque @ np.linalg.pinv(self.w)
            if data.direction is not None:
                seen["direction"] = np.sign(data.direction @ self.w.T)
            if data.joint_units:
                seen["joint_units"] = tuple(data.joint_units[k] for k in np.abs(self.w).argmax(1))
        return replace(data, **seen)

    def poses(self, data: Dataset) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Positions and orientations of a file's rows, read so."""
        position = None if data.position is None else self.scale * data.position @ self.axes
        rotation = data.rotation if self.convention is None else self.convention.rotations(data)
        if self.inverse and position is not None and rotation is not None:
            rotation = np.swapaxes(rotation, -1, -2)
            position = -(rotation @ position[..., None])[..., 0]
        return position, rotation

    def on(self, robot: Robot) -> Robot | None:
        """An arm that counts its joints as the rows do; None where that can't be said of it.

        That is of columns in another order, and of calibrated arms and effects, which know their joints.
        """
        signs = np.sign(np.diag(self.w)) if self.w.shape == (robot.dof, robot.dof) else np.zeros(1)
        if not signs.all() or robot.effects or robot.calibration is not None:
            return None
        couplings = signs[:, None] * self.w - np.eye(robot.dof)  # w = signs (1 + couplings)
        if len(robot.chain.followers) and (couplings.any() or robot.convention not in ORDERS):
            return None
        return with_couplings(with_signs_and_offsets(robot, signs, self.zero), couplings)


def units(robot: Robot, columns: int, factor: float) -> Float[np.ndarray, " m"]:
    """A factor of angles for each column; columns that slide keep their unit."""
    slides = np.array(sliding(robot), bool)
    return np.where(slides, 1.0, factor) if len(slides) == columns else np.full(columns, factor)


def _joint_texts(w: Float[np.ndarray, "n m"], zero: Float[np.ndarray, " n"], slides: np.ndarray) -> list[str]:
    """What each joint is that isn't its own column: `joint 3 = q3 + q2`, `joint 5 = -q5 + 90°`."""
    found, turns = [], np.degrees((zero + np.pi) % (2.0 * np.pi) - np.pi)
    power = np.subtract.outer(1 * slides, 1 * slides) if len(w) == w.shape[1] else np.zeros(w.shape, int)
    unit = np.array(["", "mm/rad ", "rad/mm "])[power]
    for k, (row, own, turn) in enumerate(zip(w * 1e3**power, np.eye(*w.shape), turns, strict=True)):
        columns = sorted(np.flatnonzero(row).tolist(), key=lambda j: (j != k, j))
        sizes = [f"{abs(row[j]):.4g} {unit[k, j]}q{j + 1}".removeprefix("1 ") for j in columns]
        terms = [*zip(row[columns], sizes, strict=True)]
        terms += [] if abs(turn) < 1e-6 else [(turn, f"{abs(turn):.4g}°")]
        if len(terms) > len(columns) or not np.allclose(row, own):
            text = " ".join(f"{'-' if sign < 0 else '+'} {size}" for sign, size in terms)
            found.append(f"joint {k + 1} = {text[0].strip('+')}{text[2:]}")
    return found
