"""Checks of numbers, rotations and poses that users give."""

from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from workbench.base.errors import DataError, OptionError, ShapeError
from workbench.base.types import Rotations

MAX_DEVIATION = 1e-3
"""Maximum entry of RᵀR − 1 of what is still a rotation: files may round to three digits."""


def numbers(value: Any, what: str) -> np.ndarray:
    """What numpy makes numbers of.

    Raises:
        OptionError: it makes none.
    """
    try:
        return np.asarray(value, float)
    except (TypeError, ValueError) as error:
        raise OptionError(f"{what} must be numbers: {error}", option=what, found=value) from error


def check_rotations(rotations: Rotations, what: str) -> None:
    """Raise unless all are orthonormal and right-handed; those with NaN were not measured.

    Args:
        what: What has them, for messages: "rotation parts of poses".
    """
    product = np.swapaxes(rotations, 1, 2) @ rotations
    deviation = np.abs(product - np.eye(3)).max(axis=(1, 2))
    mirrors = np.einsum("ij,ij->i", np.cross(rotations[:, 0], rotations[:, 1]), rotations[:, 2]) < 0.0
    wrong = (deviation > MAX_DEVIATION) | mirrors
    if wrong.any():
        row = int(np.argmax(wrong))
        off = f"mirrors: swap two axes or change the sign of one (row {row})"
        if not mirrors[row]:
            off = f"has RᵀR off the identity by {deviation[row]:.2g} (row {row})"
        raise DataError(
            f"{what} must be orthonormal and right-handed, got one that {off}", row=row, found=rotations[row]
        )


def as_pose(pose: ArrayLike) -> Float[np.ndarray, "4 4"]:
    """One pose as a 4×4 array, its shape checked."""
    matrix = numbers(pose, "a pose")
    if matrix.shape != (4, 4):
        size = "×".join(map(str, matrix.shape)) or "a single number"
        found = matrix.shape[-1] if matrix.ndim else 1
        raise ShapeError(f"a pose is a 4×4 matrix, got {size}", expected=4, found=found)
    return matrix
