"""Poses of a camera and of a board, each in what carries it, from the board's pose in each picture.

Hand–eye in closed form gives both. If some pictures contradict that, it is found from any three of them, so
that wrong pictures spoil some only, and then from all that suit the best of these.

Source: Fischler, Bolles, Random sample consensus, Comm. ACM 24(6), 1981.
"""

import numpy as np
from jaxtyping import Bool, Float

from workbench.base import se3
from workbench.base.hand_eye import base_and_tool, nearest_rotation
from workbench.extras.camera.camera import Camera, project

ROUGH = 20.0
"""Errors [px] beyond which a picture does not suit poses of camera and board."""
SAMPLES, MIN_POSES = 60, 3
"""Draws of so many pictures, from which camera and board are placed."""

Pose = Float[np.ndarray, "4 4"]
Poses = Float[np.ndarray, "rows 4 4"]


def placed(
    camera: Camera,
    points: Float[np.ndarray, "points 3"],
    *,
    seen: Float[np.ndarray, "rows points 2"],
    carried: Poses,
    sight: Poses,
    eye: Pose,
    board: Pose,
) -> tuple[Pose, Pose]:
    """Poses of camera and board that suit most pictures.

    Args:
        camera: Its intrinsics.
        points: Of the board, in its own frame [m].
        seen: Where they were seen [px]; NaN where they were not.
        carried: What carries the board past the camera.
        sight: Pose of the board in the camera by each picture alone.
        eye: Pose of the camera, if known; else NaN …
        board: … and of the board.
    """
    is_known = [np.isfinite(pose).all() for pose in (eye, board)]
    fewest = 1 if any(is_known) else MIN_POSES

    def by(rows: np.ndarray) -> tuple[Pose, Pose]:
        """In closed form by some pictures."""
        past, alone = carried[rows], sight[rows]
        held = board if any(is_known) else base_and_tool(past, alone)[1]
        there = eye if is_known[0] else _mean(past @ held @ se3.inverse(alone))
        return there, held if np.isfinite(held).all() else _mean(se3.inverse(past) @ there @ alone)

    def suiting(there: Pose, held: Pose) -> Bool[np.ndarray, " rows"]:
        """Which pictures suit these poses."""
        at = se3.inverse(there) @ carried @ held
        predicted = project(se3.apply(at[:, None], points), camera.intrinsics).pixel
        return np.nanmean(np.linalg.norm(predicted - seen, axis=2), axis=1) <= ROUGH

    every = np.arange(len(sight))
    found = by(every)
    if (best := suiting(*found)).all() or len(every) < fewest:
        return found
    draw = np.random.default_rng(0)
    for _ in range(SAMPLES):
        tried = suiting(*by(draw.choice(every, fewest, replace=False)))
        best = max(best, tried, key=np.count_nonzero)
    return by(np.flatnonzero(best)) if best.sum() >= fewest else found


def _mean(poses: Float[np.ndarray, "n 4 4"]) -> Pose:
    """One pose of many that should be the same: of the better half of them in rotation."""
    turns = poses[:, :3, :3]
    off = np.linalg.norm(turns - nearest_rotation(turns.sum(0)), axis=(1, 2))
    turn = nearest_rotation(turns[off <= np.median(off)].sum(0))
    return se3.pose(turn, np.median(poses[:, :3, 3], axis=0))
