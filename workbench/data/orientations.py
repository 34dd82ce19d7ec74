"""Every usual way to write an orientation with three, four or nine numbers.

Euler angles turn about three axes, one after the other. In `z y' x''` each axis is one of the frame that the
last turn left; in `x y z` all axes stay where they are, so that the matrix of the first number stands last.
There are twelve of either kind. Names of sequences are scipy's: capitals move, small letters stay.
"""

from collections.abc import Callable
from itertools import product
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from workbench.base import se3
from workbench.base.hand_eye import nearest_rotation

MAKERS = {
    "xyz": "roll, pitch, yaw: Fanuc, Yaskawa, xArm",
    "ZYX": "A, B, C: KUKA",
    "ZYZ": "Doosan, Kawasaki, Comau",
    "XYZ": "Stäubli, Mecademic",
}


class Orientation(NamedTuple):
    """One meaning.

    Args:
        name: `rotvec`, a sequence of axes, `wxyz`, `xyzw` or `matrix`.
        text: For people.
        numbers: How many; three are angles [rad].
        matrices: Rotation matrices of rows of them.
    """

    name: str
    text: str
    numbers: int
    matrices: Callable[[np.ndarray], np.ndarray]


class WrittenOrientation(NamedTuple):
    """Convention that headings of orientations name, and the numbers under them [rad or 1; NaN: missing]."""

    name: str
    numbers: Float[np.ndarray, "rows k"]

    def take(self, rows: np.ndarray) -> "WrittenOrientation":
        return self._replace(numbers=self.numbers[rows])


def _euler(axes: str) -> Orientation:
    marks = zip(axes.lower(), ("", "'", "''") if axes.isupper() else ("", "", ""), strict=True)
    maker = f" ({MAKERS[axes]})" if axes in MAKERS else ""
    turns = "moving" if axes.isupper() else "fixed"
    text = f"Euler angles {' '.join(axis + mark for axis, mark in marks)} about {turns} axes{maker}"
    return Orientation(axes, text, 3, lambda v: Rotation.from_euler(axes, v).as_matrix())


_TURNS = (turns for axes in ("xyz", "XYZ") for turns in product(axes, repeat=3))
_SEQUENCES = dict.fromkeys([*MAKERS, *("".join(t) for t in _TURNS if t[0] != t[1] != t[2])])
ORIENTATIONS = (
    Orientation("rotvec", "rotation vector (UR)", 3, se3.rotvec_to_matrix),
    *map(_euler, _SEQUENCES),
    Orientation("wxyz", "quaternion w, x, y, z (ABB)", 4, se3.quaternion_to_matrix),
    Orientation(
        "xyzw", "quaternion x, y, z, w (ROS)", 4, lambda v: se3.quaternion_to_matrix(np.roll(v, 1, 1))
    ),
    Orientation("matrix", "rotation matrix", 9, lambda v: nearest_rotation(v.reshape(-1, 3, 3))),
)
"""All of them, the likeliest first."""
USUAL_ORIENTATIONS = tuple(kind for kind in ORIENTATIONS if kind.text.endswith(")") or kind.name == "matrix")
"""Those that makers show."""
