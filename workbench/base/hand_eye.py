"""Robot–world and hand–eye: the frames X and Z of poses B_i = X A_i Z, in closed form.

The two rotations come from one singular value decomposition, the translations from linear least squares.

Source: Shah, Solving the robot-world/hand-eye calibration problem using the Kronecker product, J. Mech.
Robot. 5(3), 2013.
"""

import numpy as np
from jaxtyping import Float

from workbench.base import se3


def hand_eye(
    arm: Float[np.ndarray, "rows 4 4"], measured: Float[np.ndarray, "rows 4 4"]
) -> Float[np.ndarray, "4 4"]:
    """The tool Z of B_i = X A_i Z, base unknown: A Z = X⁻¹ B solved by one SVD."""
    a, b = arm[:, :3, :3], measured[:, :3, :3]
    kronecker = np.einsum("kij,kmn->jnim", a, b)  # z_jn = Σ a_ij y_im b_mn
    matrix = kronecker.reshape(9, 9)
    u, _, vt = np.linalg.svd(matrix)
    z, y = u[:, 0].reshape(3, 3), vt[0].reshape(3, 3)
    if np.linalg.det(z) < 0:
        z, y = -z, -y
    z, y = nearest_rotation(z), nearest_rotation(y)
    x = y.T
    # p_B = X (R_A t_Z + p_A) + t_X
    system = np.concatenate([x @ a, np.broadcast_to(np.eye(3), a.shape)], axis=2).reshape(-1, 6)
    right = (measured[:, :3, 3] - (x @ arm[:, :3, 3, None])[..., 0]).ravel()
    translation = np.linalg.lstsq(system, right, rcond=1e-9)[0]
    return se3.pose(z, translation[:3])


def nearest_rotation(matrix: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """The rotation matrix that is nearest in the Frobenius norm."""
    u, _, vt = np.linalg.svd(matrix)
    return u @ np.diag([1.0, 1.0, np.linalg.det(u) * np.linalg.det(vt)]) @ vt


def mean_base(predicted: np.ndarray, measured: np.ndarray) -> Float[np.ndarray, "4 4"]:
    """The base X of B_i = X P_i, rotations first."""
    rotation = nearest_rotation(np.einsum("kij,klj->il", measured[:, :3, :3], predicted[:, :3, :3]))
    offset = measured[:, :3, 3] - (rotation @ predicted[:, :3, 3, None])[..., 0]
    return se3.pose(rotation, offset.mean(0))
