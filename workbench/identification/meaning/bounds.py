"""Lower bounds of a reading's misfit in closed form, for many candidates at once.

For the right joints the arm's p + R z, with the unknown point z of the tool, is an affine image of the
measured points, whatever the base. Project [P, 1] out of all rows once; one 3 × 3 solve a candidate then
gives z and what is left. The affine image itself shows the unit of length (its singular values) and
left-handed axes (its determinant). For orientations the Gram matrix ⟨R_i, R_j⟩ = 1 + 2 cos θ_ij knows
neither base nor tool, so that joints and conventions separate: all pairs of both meet in one product of
matrices.
"""

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag

from workbench.arm import chain as chains
from workbench.arm.robot import Robot
from workbench.base import se3

Flanges = Float[np.ndarray, "s m 4 4"]
Points = Float[np.ndarray, "m 3"]
Grams = Float[np.ndarray, "c k"]
WEIGHT = 0.3
"""Weight of an angle of 1 rad against a length of one reach."""
ROUNDING = 1e-9


def flange_poses(robot: Robot, q: np.ndarray, *, inverse: bool = False) -> np.ndarray:
    """Poses of a bare arm's flange in its base for joints (…, n), or of the base in the flange."""
    poses = chains.poses(robot.chain, np.ascontiguousarray(q.reshape(-1, q.shape[-1])))
    poses = se3.inverse(poses) if inverse else poses
    return poses.reshape(*q.shape[:-1], 4, 4)


def point_bounds(flange: Flanges, points: Points, sessions: int = 1) -> Float[np.ndarray, " s"]:
    """Root mean square distance [m] of points from the nearest affine images of sessions, per candidate."""
    rows, far = len(points), max(np.ptp(points), ROUNDING)
    each = ((p - p.mean(0), np.full(len(p), far)) for p in points.reshape(sessions, -1, 3))
    known = block_diag(*map(np.column_stack, each))
    u, size, _ = np.linalg.svd(known, full_matrices=False)
    u = u[:, size > 1e-6 * size[0]]
    flat = flange[:, :, :3].reshape(len(flange), rows, 12)
    flat = flat - u @ (u.T @ flat)
    each = flat.reshape(len(flange), 3 * rows, 4)
    square = np.swapaxes(each, 1, 2) @ each
    inner = square[:, :3, :3] + ROUNDING * rows * np.eye(3)
    along = square[:, :3, 3:]
    left = square[:, 3, 3] - (along * np.linalg.solve(inner, along)).sum((1, 2))
    freedom = max(rows - u.shape[1] - 1, 1)
    return np.sqrt(np.maximum(left, 0.0) / freedom)


def held_bounds(flange: Flanges, points: Points, axis: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, " s"]:
    """Root mean square distance [m] of flanges from points, turned about the z axis of a frame as suits best.

    That leaves the zero of the first joint open; turning the flange, which moves it nowhere, leaves that of
    the last one. Where there are more than three rows the farthest doesn't count.
    """
    own, seen = ((p - axis[:3, 3]) @ axis[:3, :3] for p in (flange[..., :3, 3], points))
    (own_turn, own_z), (turn, z) = ((p[..., 0] + 1j * p[..., 1], p[..., 2]) for p in (own, seen))
    along = (own_turn.conj() * turn).sum(1)
    best = own_turn * (along / np.maximum(np.abs(along), ROUNDING))[:, None]
    square = np.abs(best - turn) ** 2 + (own_z - z) ** 2
    if square.shape[1] > 3:
        square = np.sort(square, axis=1)[:, :-1]
    return np.sqrt(square.mean(1))


def grams(rotations: Float[np.ndarray, "c m 3 3"], sessions: int = 1) -> Grams:
    """Gram matrices ⟨R_i, R_j⟩ of the rotations of each session's rows, their upper triangles."""
    i, j = np.triu_indices(rotations.shape[1], 1)
    size = rotations.shape[1] // sessions
    i, j = (k[i // size == j // size] for k in (i, j))
    flat = rotations.reshape(*rotations.shape[:2], 9)
    return (flat @ np.swapaxes(flat, 1, 2))[:, i, j]


def turn_bounds(poses: Flanges, conventions: Grams, sessions: int = 1) -> Float[np.ndarray, "s c"]:
    """Root mean square difference of Gram matrices as an angle [rad], for each convention."""
    own = grams(poses[:, :, :3, :3], sessions)
    cross = own @ conventions.T / own.shape[1]
    square = (own**2).mean(1)[:, None] - 2.0 * cross + (conventions**2).mean(1)
    return np.sqrt(np.maximum(square, 0.0)) / 1.5


def affine_map(
    flange: Float[np.ndarray, "m 4 4"], points: Float[np.ndarray, "m 3"]
) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]]:
    """The linear part of the affine image measured → arm, and the point of the tool."""
    known = np.column_stack([points, np.ones(len(points))])
    inverse = np.linalg.pinv(known, rcond=1e-7)
    flat = flange[:, :3].reshape(len(points), 12)
    left = (flat - known @ (inverse @ flat)).reshape(-1, 4)
    square = left.T @ left
    tool = -np.linalg.solve(square[:3, :3] + ROUNDING * len(points) * np.eye(3), square[:3, 3])
    return (inverse @ (flange[:, :3, 3] + flange[:, :3, :3] @ tool))[:3].T, tool


def nearest_turn(
    expected: Float[np.ndarray, "m 3 3"], rotations: Float[np.ndarray, "c m 3 3"]
) -> Float[np.ndarray, " c"]:
    """Root mean square angle [rad] that the best constant tool rotation leaves, per convention."""
    summed = np.einsum("mji,cmjk->cik", expected, rotations) / len(expected)
    size = np.linalg.svd(summed, compute_uv=False)
    size[:, 2] *= np.sign(np.linalg.det(summed))
    return np.sqrt(np.maximum(3.0 - size.sum(1), 0.0))
