"""Whether points are the nominal arm's, all drawn out alike: an instrument whose lengths are wrong."""

import numpy as np

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.advice import beside
from workbench.data.dataset import Dataset
from workbench.identification.meaning.usable_rows import usable

EXPLAINED = 0.5
"""Share of the nominal arm's rms error that a scale must leave at most."""
MIN_ROWS, MIN_SCALE, MIN_SPREAD = 20, 8e-3, 0.05
"""Fewest rows that tell a scale, the smallest one that is named (two long links that err alike by 2 mm make
0.5 %), and the smallest spread of the points as a share of the reach."""


@beside("the instrument's scale", "")
def instrument_scale(aligned: Robot, data: Dataset) -> str:
    """`all lengths are 2 % longer than nominal …`, or empty.

    Manufacturing errors lengthen some links and shorten others, and turn axes; a board that was printed too
    large, or a camera's wrong focal length, does the same to all lengths at once. The nominal arm is aligned
    with the rows, to first order; pictures themselves have checks of their own (`extras/camera`).
    """
    rows = usable(data) if data.position is not None else None
    if rows is None or len(rows) < MIN_ROWS:
        return ""
    arm = aligned if rows.session is None else aligned.in_session(str(rows.session[0]))
    seen = tool_poses(arm, Motion.of(rows))
    points, turned = seen[:, :3, 3] - seen[:, :3, 3].mean(0), seen[:, :3, :3]
    if np.linalg.norm(points.std(0)) < MIN_SPREAD * aligned.reach:
        return ""
    off = (np.asarray(rows.position) - seen[:, :3, 3]).ravel()
    frames = [-se3.skew(points), np.broadcast_to(np.eye(3), turned.shape), turned]
    columns = np.concatenate([*frames, points[:, :, None]], axis=2).reshape(len(off), -1)
    (_, without), (scale, left) = (_left(part, off) for part in (columns[:, :-1], columns))
    if not (left < EXPLAINED * without and MIN_SCALE < abs(scale) < 1.0):
        return ""
    return (
        f"all lengths are {100.0 * abs(scale):.2g} % {'longer' if scale > 0.0 else 'shorter'} than nominal, "
        f"which leaves {1e3 * left:.3g} of {1e3 * without:.3g} mm (rms): rather the instrument's scale (size "
        "of its board, camera calibration, unit) than the arm; measure a known distance with it"
    )


def _left(columns: np.ndarray, off: np.ndarray) -> tuple[float, float]:
    """Factor of the last column, and rms length [m] of what columns leave of differences of points."""
    factors = np.linalg.lstsq(columns, off, rcond=None)[0]
    return float(factors[-1]), float(np.sqrt(((off - columns @ factors) ** 2).sum() / (len(off) / 3)))
