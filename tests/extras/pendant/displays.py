"""A controller with a hidden model and its display: saved arms in plain numpy, digits cut as shown."""

from pathlib import Path

import numpy as np
from checks import with_errors
from round_trip import placed, read_arm, rows_of
from scipy.spatial.transform import Rotation

import workbench as wb

TOOL = placed([0.03, -0.02, 0.15], [0.3, -1.0, 0.2])
"""A tool that is set on the controller."""
STYLES = {
    "rotation vector": (lambda r: r.as_rotvec(), 4),
    "x y z": (lambda r: r.as_euler("xyz", degrees=True), 2),
    "z y' x''": (lambda r: r.as_euler("ZYX", degrees=True), 2),
    "z y' z''": (lambda r: r.as_euler("ZYZ", degrees=True), 2),
    "w, x, y, z": (lambda r: r.as_quat(scalar_first=True), 5),
    "x, y, z, w": (lambda r: r.as_quat(), 5),
}
"""Numbers of an orientation, and how many decimals are shown."""


def hidden(name: str, path: Path, *, seed: int = 0, length: float = 1e-3, angle: float = 2e-3, effects=()):
    """A built-in arm as its controller knows it, in a file."""
    arm = wb.load_robot(name).bare
    rng = np.random.default_rng(seed)
    sizes = np.array([length if e.unit == "m" else angle for e in arm.elements if e.free])
    with_errors(arm, sizes * rng.normal(size=len(sizes))).with_effects(*effects).save(path)
    return path


def poses(path: Path, q: np.ndarray, tool=None) -> np.ndarray:
    """Poses of the tool of a saved arm, in the frame of its file."""
    return read_arm(path)(rows_of(q))[1] @ (np.eye(4) if tool is None else tool)


def lines(
    path: Path, q, *, style: str = "rotation vector", tool=None, millimetres: int = 1
) -> list[list[str]]:
    """What is typed from the display: joints, positions, orientation."""
    numbers, decimals = STYLES[style]
    found = []
    for at, pose in zip(q, poses(path, q, tool), strict=True):
        turn = numbers(Rotation.from_matrix(pose[:3, :3]))
        parts = (np.rad2deg(at), 2), (1e3 * pose[:3, 3], millimetres), (turn, decimals)
        found.append([f"{v:.{d}f}" for part, d in parts for v in part])
    return found


def random_joints(name: str, count: int, *, seed: int = 7) -> np.ndarray:
    """Joint positions anywhere within the limits [rad]."""
    low, high = wb.load_robot(name).search_limits.T
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


def model_error(found: Path, actual: Path, q: np.ndarray, tool=None) -> np.ndarray:
    """Distances between the tools of two saved arms [m]; the first has its tool in its file."""
    return np.linalg.norm(poses(found, q)[:, :3, 3] - poses(actual, q, tool)[:, :3, 3], axis=1)
