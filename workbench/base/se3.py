"""Rigid motions over stacks: rotations, poses, twists.

Conventions of the whole package: a pose T_ab takes coordinates in b to a; a twist is [v; w], linear part
first; roll, pitch, yaw mean R = Rz(yaw) Ry(pitch) Rx(roll); quaternions are [w, x, y, z]. All functions
take stacks: any leading shape, the last one or two axes as named.
"""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation


def _as_matrix(rotation: Rotation, lead: tuple[int, ...]) -> np.ndarray:
    return rotation.as_matrix().reshape(*lead, 3, 3)


def rpy_to_matrix(rpy: Float[np.ndarray, "*lead 3"]) -> Float[np.ndarray, "*lead 3 3"]:
    """R = Rz(yaw) Ry(pitch) Rx(roll) from [roll, pitch, yaw] in rad."""
    return _as_matrix(Rotation.from_euler("xyz", np.reshape(rpy, (-1, 3))), np.shape(rpy)[:-1])


def matrix_to_rpy(rotation: Float[np.ndarray, "*lead 3 3"]) -> Float[np.ndarray, "*lead 3"]:
    """[roll, pitch, yaw] in rad; at pitch = ±90° yaw is 0, as roll and yaw can't be told apart there."""
    r = np.reshape(rotation, (-1, 3, 3))
    locked = np.hypot(r[:, 0, 0], r[:, 1, 0]) < 1e-15
    yaw = np.where(locked, 0.0, np.arctan2(r[:, 1, 0], r[:, 0, 0]))
    c, s = np.cos(yaw), np.sin(yaw)
    # roll and pitch from Rz(-yaw) R, so that the three give R back to machine precision at any pitch
    pitch = np.arctan2(-r[:, 2, 0], c * r[:, 0, 0] + s * r[:, 1, 0])
    roll = np.arctan2(s * r[:, 0, 2] - c * r[:, 1, 2], c * r[:, 1, 1] - s * r[:, 0, 1])
    return np.stack([roll, pitch, yaw], -1).reshape(*np.shape(rotation)[:-2], 3)


def quaternion_to_matrix(wxyz: Float[np.ndarray, "*lead 4"]) -> Float[np.ndarray, "*lead 3 3"]:
    """Rotation of a quaternion [w, x, y, z], which is normalised first."""
    return _as_matrix(Rotation.from_quat(np.reshape(wxyz, (-1, 4)), scalar_first=True), np.shape(wxyz)[:-1])


def matrix_to_quaternion(rotation: Float[np.ndarray, "*lead 3 3"]) -> Float[np.ndarray, "*lead 4"]:
    """Quaternion [w, x, y, z] with w >= 0."""
    quaternion = Rotation.from_matrix(np.reshape(rotation, (-1, 3, 3))).as_quat(
        canonical=True, scalar_first=True
    )
    return quaternion.reshape(*np.shape(rotation)[:-2], 4)


def rotvec_to_matrix(rotvec: Float[np.ndarray, "*lead 3"]) -> Float[np.ndarray, "*lead 3 3"]:
    """Exponential: the rotation by |rotvec| rad about rotvec."""
    return _as_matrix(Rotation.from_rotvec(np.reshape(rotvec, (-1, 3))), np.shape(rotvec)[:-1])


def matrix_to_rotvec(rotation: Float[np.ndarray, "*lead 3 3"]) -> Float[np.ndarray, "*lead 3"]:
    """Logarithm: rotation vector [rad] of length at most pi."""
    r = np.reshape(np.asarray(rotation, float), (-1, 3, 3))
    # by the quaternion times 4 w; scipy does the same with checks that take far longer than a fit's rows
    w, v = 1.0 + np.einsum("kii->k", r), np.empty((len(r), 3))
    v[:, 0], v[:, 1], v[:, 2] = r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]
    if (turned := w < 1.0).any():
        quaternion = matrix_to_quaternion(r[turned])
        w[turned], v[turned] = quaternion[:, 0], quaternion[:, 1:]
    sine = np.maximum(np.sqrt(np.einsum("ki,ki->k", v, v)), 1e-300)
    v *= (2.0 * np.arctan2(sine, w) / sine)[:, None]
    return v.reshape(*np.shape(rotation)[:-2], 3)


def cross(a: Float[np.ndarray, "*lead 3"], b: Float[np.ndarray, "*#lead 3"]) -> Float[np.ndarray, "*lead 3"]:
    """a × b, b broadcast to a, in under half the time of `numpy.cross` where the vectors are few."""
    (x, y, z), (u, v, w) = ([part[..., i] for i in range(3)] for part in (a, b))
    result = np.empty(a.shape)
    result[..., 0], result[..., 1], result[..., 2] = y * w - z * v, z * u - x * w, x * v - y * u
    return result


def skew(vector: Float[np.ndarray, "*lead 3"]) -> Float[np.ndarray, "*lead 3 3"]:
    """The matrix [v]x with [v]x u = v × u."""
    matrix = np.zeros((*np.shape(vector), 3))
    matrix[..., 0, 1], matrix[..., 0, 2] = -vector[..., 2], vector[..., 1]
    matrix[..., 1, 0], matrix[..., 1, 2] = vector[..., 2], -vector[..., 0]
    matrix[..., 2, 0], matrix[..., 2, 1] = -vector[..., 1], vector[..., 0]
    return matrix


def left_jacobian_inverse(rotvec: Float[np.ndarray, "*lead 3"]) -> Float[np.ndarray, "*lead 3 3"]:
    """J⁻¹(φ): log(exp(δ) exp(φ)) = φ + J⁻¹(φ) δ to first order in δ.

    J⁻¹ = 1 − ½ [φ]x + (1 − h / tan h) ([φ]x / |φ|)², h = ½ |φ|; for a small φ to machine precision as well.
    Source: Barfoot, State Estimation for Robotics (2017), eq. (7.77b).
    """
    flat = np.asarray(rotvec, float)
    square = np.maximum(np.einsum("...i,...i->...", flat, flat), 1e-300)
    half, crossing = 0.5 * np.sqrt(square), skew(flat)
    share = (1.0 - half / np.tan(half)) / square
    return np.eye(3) - 0.5 * crossing + share[..., None, None] * (crossing @ crossing)


def pose(
    rotation: Float[np.ndarray, "*lead 3 3"], position: Float[np.ndarray, "*lead 3"]
) -> Float[np.ndarray, "*lead 4 4"]:
    """Homogeneous transforms from rotations and positions."""
    result = np.zeros((*np.shape(position)[:-1], 4, 4))
    result[..., :3, :3] = rotation
    result[..., :3, 3] = position
    result[..., 3, 3] = 1.0
    return result


def inverse(transform: Float[np.ndarray, "*lead 4 4"]) -> Float[np.ndarray, "*lead 4 4"]:
    rotation = np.swapaxes(transform[..., :3, :3], -1, -2)
    return pose(rotation, -(rotation @ transform[..., :3, 3, None])[..., 0])


def apply(
    transform: Float[np.ndarray, "*#lead 4 4"], point: Float[np.ndarray, "*#lead 3"]
) -> Float[np.ndarray, "*all 3"]:
    """Coordinates of points after the transform; leading axes broadcast."""
    return (transform[..., :3, :3] @ point[..., None])[..., 0] + transform[..., :3, 3]


def best_fit(
    source: Float[np.ndarray, "points 3"], destination: Float[np.ndarray, "points 3"]
) -> Float[np.ndarray, "4 4"]:
    """The rigid transform that takes source points closest to destination points (least squares).

    Points on one line leave the rotation about it open; one of the solutions is then returned.
    Source: Arun, Huang, Blostein, IEEE PAMI 9(5), 1987, with the reflection guarded as Umeyama (1991).
    """
    mean_s, mean_d = source.mean(0), destination.mean(0)
    u, _, vt = np.linalg.svd((destination - mean_d).T @ (source - mean_s))
    r = u @ np.diag([1.0, 1.0, np.linalg.det(u) * np.linalg.det(vt)]) @ vt
    return pose(r, mean_d - r @ mean_s)


def pose_error(
    measured: Float[np.ndarray, "*lead 4 4"], predicted: Float[np.ndarray, "*lead 4 4"]
) -> Float[np.ndarray, "*lead 6"]:
    """[p − p̂; log(R R̂ᵀ)]: what has to be added to the prediction, in base axes [m, rad]."""
    rotation = measured[..., :3, :3] @ np.swapaxes(predicted[..., :3, :3], -1, -2)
    return np.concatenate([measured[..., :3, 3] - predicted[..., :3, 3], matrix_to_rotvec(rotation)], axis=-1)
