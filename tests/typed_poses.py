"""What a user types of an arm whose table the program reads wrongly at first."""

import numpy as np

from workbench import Motion, tool_poses
from workbench.arm.robot_toml import robot_to_table
from workbench.base import se3


def pendant(arm, poses: int) -> tuple[str, tuple[str, ...], np.ndarray]:
    """A table in mm and degrees, and typed poses: joint 2 counts the other way, joint 4 from −90°."""
    rows = robot_to_table(arm)["joint"]
    cells = [[np.rad2deg(r["theta"]), 1e3 * r["d"], 1e3 * r["a"], np.rad2deg(r["alpha"])] for r in rows]
    table = "theta,d,a,alpha\n" + "\n".join(",".join(f"{v:.4f}" for v in row) for row in cells)
    shown = np.random.default_rng(3).uniform(-2.0, 2.0, (poses, 6))
    tools = tool_poses(arm, Motion(plural(shown)))
    angles = np.rad2deg(se3.matrix_to_rpy(tools[:, :3, :3]))
    typed = tuple(
        " = ".join(", ".join(f"{v:.3f}" for v in part) for part in (np.rad2deg(q), [*(1e3 * p[:3, 3]), *a]))
        for q, p, a in zip(shown, tools, angles, strict=True)
    )
    return table, typed, shown


def plural(shown: np.ndarray) -> np.ndarray:
    """Joint positions as the table counts them, from what the pendant shows."""
    return shown * [1, -1, 1, 1, 1, 1] + np.deg2rad([0, 0, 0, 90, 0, 0])
