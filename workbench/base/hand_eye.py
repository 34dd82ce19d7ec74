"""Robot–world and hand–eye: the frames X and Z of poses B_i = X A_i Z, in closed form.

The two rotations come from one singular value decomposition, the translations from linear least squares.

Source: Shah, Solving the robot-world/hand-eye calibration problem using the Kronecker product, J. Mech.
Robot. 5(3), 2013.
"""

import numpy as np
from jaxtyping import Float

from workbench.base import se3

TURNS = 24
"""Turns of the tool that are tried about an axis."""


def hand_eye(
    arm: Float[np.ndarray, "*lead rows 4 4"], measured: Float[np.ndarray, "rows 4 4"]
) -> Float[np.ndarray, "*lead 4 4"]:
    """The tool Z of B_i = X A_i Z, base unknown: A Z = X⁻¹ B solved by one SVD; of several arms at once."""
    a, b = arm[..., :3, :3], measured[:, :3, :3]
    kronecker = np.einsum("...kij,kmn->...jnim", a, b)  # z_jn = Σ a_ij y_im b_mn
    u, _, vt = np.linalg.svd(kronecker.reshape(*arm.shape[:-3], 9, 9))
    z, y = (part.reshape(*arm.shape[:-3], 3, 3) for part in (u[..., 0], vt[..., 0, :]))
    side = np.sign(np.linalg.det(z))[..., None, None]
    z, y = nearest_rotation(side * z), nearest_rotation(side * y)
    return se3.pose(z, _offset(arm, measured, np.swapaxes(y, -1, -2)))


def _offset(arm: np.ndarray, measured: np.ndarray, x: np.ndarray) -> Float[np.ndarray, "*lead 3"]:
    """The place of the tool for a rotation of the base: p_B = X (R_A t_Z + p_A) + t_X."""
    a, x = arm[..., :3, :3], x[..., None, :, :]
    turned = x @ a
    system = np.concatenate([turned, np.broadcast_to(np.eye(3), turned.shape)], axis=-1)
    right = measured[:, :3, 3] - (x @ arm[..., :3, 3, None])[..., 0]
    lead = right.shape[:-2]
    inverse = np.linalg.pinv(system.reshape(*lead, -1, 6), rcond=1e-9)
    return (inverse @ right.reshape(*lead, -1, 1))[..., :3, 0]


def nearest_rotation(matrix: Float[np.ndarray, "*lead 3 3"]) -> Float[np.ndarray, "*lead 3 3"]:
    """The rotation matrix that is nearest in the Frobenius norm."""
    u, _, vt = np.linalg.svd(matrix)
    u[..., 2] *= (np.linalg.det(u) * np.linalg.det(vt))[..., None]
    return u @ vt


def mean_base(
    predicted: Float[np.ndarray, "*lead rows 4 4"], measured: Float[np.ndarray, "rows 4 4"]
) -> Float[np.ndarray, "*lead 4 4"]:
    """The base X of B_i = X P_i, rotations first."""
    rotation = nearest_rotation(np.einsum("kij,...klj->...il", measured[:, :3, :3], predicted[..., :3, :3]))
    offset = measured[:, :3, 3] - (rotation[..., None, :, :] @ predicted[..., :3, 3, None])[..., 0]
    return se3.pose(rotation, offset.mean(-2))


def base_and_tool(
    arm: Float[np.ndarray, "*lead rows 4 4"], measured: Float[np.ndarray, "rows 4 4"]
) -> tuple[Float[np.ndarray, "*lead 4 4"], Float[np.ndarray, "*lead 4 4"]]:
    """Both X and Z of B_i = X A_i Z."""
    tool = hand_eye(arm, measured)
    return mean_base(arm @ tool[..., None, :, :], measured), tool


def base_and_tool_by_places(
    arm: Float[np.ndarray, "rows 4 4"], measured: Float[np.ndarray, "rows 4 4"]
) -> tuple[Float[np.ndarray, "4 4"], Float[np.ndarray, "4 4"]]:
    """The same where all turns are about nearly one axis: the places choose the tool's turn about it."""
    tool = hand_eye(arm, measured)
    turned = se3.matrix_to_rotvec(np.swapaxes(arm[:1, :3, :3], 1, 2) @ arm[1:, :3, :3])
    axis = np.linalg.svd(turned, full_matrices=False)[2][0]
    angles = np.linspace(0.0, 2.0 * np.pi, TURNS, endpoint=False)
    z = se3.rotvec_to_matrix(angles[:, None] * axis) @ tool[:3, :3]
    x = nearest_rotation(np.einsum("kij,tklj->til", measured[:, :3, :3], arm[:, :3, :3] @ z[:, None]))
    tools = se3.pose(z, _offset(arm, measured, x))
    bases = mean_base(arm @ tools[:, None], measured)
    missed = (bases[:, None] @ arm @ tools[:, None])[..., :3, 3] - measured[:, :3, 3]
    best = int(np.argmin((missed**2).sum((1, 2))))
    return bases[best], tools[best]
