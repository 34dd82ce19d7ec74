"""What numbers on a pendant may mean: units, kinds of orientation, poses typed as text."""

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.data.orientations import ORIENTATIONS, Orientation

SIZES = {"m": 1.0, "mm": 1e-3, "rad": 1.0, "deg": float(np.deg2rad(1.0)), "": 1.0}
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


class DisplayedPoses(NamedTuple):
    """One meaning of what a pendant shows.

    Args:
        q: Joint positions [rad or m].
        poses: Of the tool, as displayed.
        units: Of joints, positions and angles; no unit for what are no angles.
        orientation: Kind of the orientation.
    """

    q: Float[np.ndarray, "rows n"]
    poses: Float[np.ndarray, "rows 4 4"]
    units: tuple[str, str, str]
    orientation: Orientation

    @property
    def assumptions(self) -> tuple[str, str, str]:
        """`joints in deg`, `positions in mm`, `rotation vector (UR) in rad`."""
        joints, lengths, angles = self.units
        turned = f" in {angles}" if angles else ""
        return f"joints in {joints}", f"positions in {lengths}", f"{self.orientation.text}{turned}"

    @property
    def text(self) -> str:
        return ", ".join(self.assumptions)


def meanings(
    joints: Float[np.ndarray, "rows n"],
    xyz: Float[np.ndarray, "rows 3"],
    turn: Float[np.ndarray, "rows k"],
    slides: Sequence[bool] | Bool[np.ndarray, " n"],
    *,
    units: tuple[str, str, str] = ("", "", ""),
    kinds: Sequence[Orientation] = ORIENTATIONS,
) -> Iterator[DisplayedPoses]:
    """What numbers may mean.

    Args:
        joints: Joint positions as shown.
        xyz: Position of the tool.
        turn: Its orientation: three numbers, a quaternion, or a matrix row by row.
        slides: Which joints slide.
        units: Of joints, positions and orientations, where they are known.
        kinds: Of orientations that may be meant.
    """
    sliding = np.array(slides, bool)
    in_joints = [units[0]] if units[0] else possible(("deg", "rad"), joints[:, ~sliding])
    in_xyz = [units[1]] if units[1] else possible(("mm", "m"), xyz)
    in_turn = [units[2]] if units[2] else possible(("deg", "rad"), turn)
    for joint, length in product(in_joints, in_xyz):
        q = joints * np.where(sliding, SIZES[length], SIZES[joint])
        for kind in (kind for kind in kinds if kind.numbers == turn.shape[1]):
            for angle in in_turn if kind.has_units else ("",):
                poses = se3.pose(kind.matrices(turn * SIZES[angle]), xyz * SIZES[length])
                yield DisplayedPoses(q, poses, (joint, length, angle), kind)


def possible(units: Sequence[str], values) -> Sequence[str]:
    """Those of two units in which some numbers make sense; both where either does."""
    largest = float(np.abs(values).max()) if np.size(values) else 0.0
    bounds = {"m": (0.0, 20.0), "mm": (5.0, np.inf), "rad": (0.0, 2.1 * np.pi), "deg": (0.0, np.inf)}
    kept = [u for u in units if bounds[u][0] <= largest <= bounds[u][1]]
    return kept or units


def typed_cells(texts: Iterable[str], joints: int) -> list[tuple[list[str], list[str], list[str]]]:
    """Joints, position and orientation of poses `q1,…,qn = x,y,z,a,b,c`, as they were typed."""
    rows: list[tuple[list[str], list[str], list[str]]] = []
    for text in texts:
        left, _, right = text.replace("\u2212", "-").partition("=")
        q, pose = (re.split(r"[,;\s]+", part.strip()) for part in (left, right))
        is_right = len(q) == joints and len(pose) in (6, 7) and all(map(NUMBER.fullmatch, q + pose))
        if not is_right or (rows and len(pose) != 3 + len(rows[0][2])):
            raise OptionError(
                f"the pose '{text}' must be {joints} joint positions, =, x, y, z and three angles or a "
                "quaternion, with commas"
            )
        rows.append((q, pose[:3], pose[3:]))
    return rows
