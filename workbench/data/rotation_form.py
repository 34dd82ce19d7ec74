"""How orientations stand in files of measurements."""

from collections.abc import Callable
from enum import StrEnum

import numpy as np
from jaxtyping import Float

from workbench.base import se3


class RotationForm(StrEnum):
    """How orientations are written."""

    QUATERNION = "quaternion"
    MATRIX = "matrix"
    ROTATION_VECTOR = "rotation vector"
    RPY = "roll, pitch, yaw"
    ZXZ = "ZXZ Euler angles"

    def columns(self, rotation: Float[np.ndarray, "rows 3 3"]) -> tuple[tuple[str, ...], np.ndarray]:
        """Headings and values of orientations, NaN where a row has none."""
        names, convert = _FORMS[self]
        whole = ~np.isnan(rotation).any((1, 2))
        result = np.full((len(rotation), len(names)), np.nan)
        if whole.any():
            result[whole] = convert(rotation[whole])
        return names, result


_FORMS: dict[RotationForm, tuple[tuple[str, ...], Callable[[np.ndarray], np.ndarray]]] = {
    RotationForm.QUATERNION: (("qw", "qx", "qy", "qz"), se3.matrix_to_quaternion),
    RotationForm.MATRIX: (tuple(f"r{i}{j}" for i in "123" for j in "123"), lambda r: r.reshape(-1, 9)),
    RotationForm.ROTATION_VECTOR: (("rx[rad]", "ry[rad]", "rz[rad]"), se3.matrix_to_rotvec),
    RotationForm.RPY: (("roll[rad]", "pitch[rad]", "yaw[rad]"), se3.matrix_to_rpy),
    RotationForm.ZXZ: (("zxz_phi[rad]", "zxz_theta[rad]", "zxz_psi[rad]"), se3.matrix_to_zxz),
}
"""Columns of each form, and what makes them of matrices."""
