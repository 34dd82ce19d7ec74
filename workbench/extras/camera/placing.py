"""Poses of a camera and of a board, each in what carries it, from the board's pose in each picture.

Hand–eye in closed form gives both. If some pictures contradict that, it is found from any three of them, so
that wrong pictures spoil some only, and then from all that suit the best of these.

Source: Fischler, Bolles, Random sample consensus, Comm. ACM 24(6), 1981.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from workbench.base import se3
from workbench.base.hand_eye import base_and_tool, nearest_rotation
from workbench.extras.camera.camera import Camera

ROUGH = 20.0
"""Errors [px] beyond which a picture does not suit poses of camera and board."""
SAMPLES, MIN_POSES = 60, 3
"""Draws of so many pictures, from which camera and board are placed."""

Pose = Float[np.ndarray, "4 4"]
Poses = Float[np.ndarray, "rows 4 4"]


@dataclass(frozen=True, eq=False)
class Views:
    """Pictures that show a board's pose by themselves.

    Args:
        camera: Its intrinsics.
        points: Of the board, in its own frame [m].
        seen: Where they were seen [px]; NaN where they were not.
        carried: What carries the board past the camera.
        sight: Pose of the board in the camera by each picture alone.
        eye: Pose of the camera, if known; else NaN …
        board: … and of the board.
    """

    camera: Camera
    points: Float[np.ndarray, "points 3"]
    seen: Float[np.ndarray, "rows points 2"]
    carried: Poses
    sight: Poses
    eye: Pose
    board: Pose

    @cached_property
    def fewest(self) -> int:
        """Pictures that place what is unknown."""
        return 1 if np.isfinite(self.eye).all() or np.isfinite(self.board).all() else MIN_POSES

    def placed(self) -> tuple[Pose, Pose]:
        """Poses of camera and board that suit most pictures."""
        every = np.arange(len(self.sight))
        found = self._by(every)
        if (suiting := self._suiting(*found)).all() or len(every) < self.fewest:
            return found
        draw = np.random.default_rng(0)
        for _ in range(SAMPLES):
            tried = self._suiting(*self._by(draw.choice(every, self.fewest, replace=False)))
            suiting = max(suiting, tried, key=np.count_nonzero)
        return self._by(np.flatnonzero(suiting)) if suiting.sum() >= self.fewest else found

    def _by(self, rows: np.ndarray) -> tuple[Pose, Pose]:
        """Poses of camera and board in closed form by some pictures."""
        carried, sight, eye, board = self.carried[rows], self.sight[rows], self.eye, self.board
        if self.fewest > 1:
            _, board = base_and_tool(carried, sight)
        if not np.isfinite(eye).all():
            eye = _mean(carried @ board @ se3.inverse(sight))
        return eye, board if np.isfinite(board).all() else _mean(se3.inverse(carried) @ eye @ sight)

    def _suiting(self, eye: Pose, board: Pose) -> Bool[np.ndarray, " rows"]:
        """Which pictures suit these poses."""
        at = se3.inverse(eye) @ self.carried @ board
        predicted = self.camera.project(se3.apply(at[:, None], self.points)).pixel
        return np.nanmean(np.linalg.norm(predicted - self.seen, axis=2), axis=1) <= ROUGH


def _mean(poses: Float[np.ndarray, "n 4 4"]) -> Pose:
    """One pose of many that should be the same: of the better half of them in rotation."""
    turns = poses[:, :3, :3]
    off = np.linalg.norm(turns - nearest_rotation(turns.sum(0)), axis=(1, 2))
    turn = nearest_rotation(turns[off <= np.median(off)].sum(0))
    return se3.pose(turn, np.median(poses[:, :3, 3], axis=0))
