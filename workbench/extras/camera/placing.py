"""Poses of a camera and of a board, each in what carries it, from all pictures at once.

Where pictures have a board's pose of their own, hand–eye in closed form gives both; if some contradict that,
hand–eye from any three of them, so that wrong pictures spoil some only. Where none has, the arm carries the
board's points past the camera and so makes one large body of points of all pictures. Seen from far away the
board is a single point c in what carries it: every c of a grid gives the camera by SQPnP. The best are
refined with c free, then with the board turned in each of the 24 ways of a cube. What suits most corners
holds.

Source: Fischler, Bolles, Random sample consensus, Comm. ACM 24(6), 1981.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import product

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from workbench.base import se3
from workbench.base.hand_eye import base_and_tool, nearest_rotation
from workbench.extras.camera.camera import Camera, Mount
from workbench.extras.camera.opencv import opencv

MAX_CORNERS = 150
"""Corners that take part in a search; more add nothing to a first guess."""
GRID, TRIED = 5, 4
"""Places of the board along each axis, and those of them that are refined."""
BESIDE_TOOL = 0.3
"""Distance of a board from the tool that carries it, along each axis, at most [m]."""
ROUGH = 20.0
"""Errors [px] that count less and less in a first guess."""
SAMPLES, MIN_POSES = 60, 3
"""Draws of so many pictures with a pose of their own, from which camera and board are placed."""

Pose = Float[np.ndarray, "4 4"]
Poses = Float[np.ndarray, "rows 4 4"]


@dataclass(frozen=True, eq=False)
class Views:
    """Pictures of a board by a camera; equal by numbers, as fits of the same pictures ask again.

    Args:
        camera: Its intrinsics.
        points: Of the board, in its own frame [m].
        seen: Where they were seen [px]; NaN where they were not.
        tool: Poses of the tool in the base.
        sight: Pose of the board in the camera by each picture alone; NaN where unknown.
        eye: Pose of the camera, if known; else NaN …
        board: … and of the board.
    """

    camera: Camera
    points: Float[np.ndarray, "points 3"]
    seen: Float[np.ndarray, "rows points 2"]
    tool: Poses
    sight: Poses
    eye: Pose
    board: Pose

    @cached_property
    def _key(self) -> tuple[bytes, ...]:
        arrays = (self.points, self.seen, self.tool, self.sight, self.eye, self.board, self.camera.intrinsics)
        return (self.camera.mounted.encode(), *(np.ascontiguousarray(a).tobytes() for a in arrays))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Views) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    @cached_property
    def carried(self) -> Poses:
        """What carries the board past the camera."""
        return self.camera.carried(self.tool)

    @property
    def is_known(self) -> tuple[bool, bool]:
        """Whether the poses of camera and board are known."""
        return bool(np.isfinite(self.eye).all()), bool(np.isfinite(self.board).all())

    @property
    def placing(self) -> np.ndarray:
        """Rows with a pose of their own, if they are enough to place what is unknown."""
        rows = np.flatnonzero(np.isfinite(self.sight[:, 0, 0]))
        return rows if len(rows) >= (1 if any(self.is_known) else MIN_POSES) else rows[:0]

    def by_sights(self, rows: np.ndarray) -> tuple[Pose, Pose]:
        """Poses of camera and board in closed form, from the board's pose in some pictures."""
        carried, sight = self.carried[rows], self.sight[rows]
        eye, board = self.eye, self.board
        if not any(self.is_known):
            _, board = base_and_tool(carried, sight)
        if not self.is_known[0]:
            eye = _mean(carried @ board @ se3.inverse(sight))
        return eye, board if np.isfinite(board).all() else _mean(se3.inverse(carried) @ eye @ sight)

    def suit(self, eye: Pose, board: Pose) -> bool:
        """Whether every picture suits these poses of camera and board."""
        at = se3.inverse(eye) @ self.carried @ board
        predicted = self.camera.project(se3.apply(at[:, None], self.points)).pixel
        off = np.linalg.norm(predicted - self.seen, axis=2)
        return bool(np.nanmean(off[np.isfinite(off).any(1)], axis=1).max() <= ROUGH)


def _mean(poses: Float[np.ndarray, "n 4 4"]) -> Pose:
    """One pose of many that should be the same: of the better half of them in rotation."""
    turns = poses[:, :3, :3]
    off = np.linalg.norm(turns - nearest_rotation(turns.sum(0)), axis=(1, 2))
    turn = nearest_rotation(turns[off <= np.median(off)].sum(0))
    return se3.pose(turn, np.median(poses[:, :3, 3], axis=0))


def placed(views: Views) -> tuple[Pose, Pose]:
    """Poses of camera and board."""
    if len(views.placing):
        found = views.by_sights(views.placing)
        if views.suit(*found):
            return found
    return _searched(views)


@lru_cache(maxsize=8)
def _searched(views: Views) -> tuple[Pose, Pose]:
    """Poses that suit most corners."""
    search = _Search.of(views)
    if len(rows := views.placing):
        draw = np.random.default_rng(0)
        count = 1 if any(views.is_known) else MIN_POSES
        some = [rows, *(draw.choice(rows, count, replace=False) for _ in range(SAMPLES))]
        best = search.best([search.values(*views.by_sights(mine)) for mine in some])
    else:
        far = replace(search, arms=np.zeros(search.arms.shape))
        best = far.best(list(far.firsts()))
        if search.arms.any():
            turns = Rotation.create_group("O").as_rotvec()
            best = search.best([np.concatenate([best[:9], turn]) for turn in turns], tried=len(turns))
    turn = Rotation.from_rotvec(best[9:]).as_matrix()
    board = se3.pose(turn, best[6:9] - turn @ search.middle)
    eye = se3.inverse(se3.pose(se3.rotvec_to_matrix(best[:3]), best[3:6]))
    is_eye, is_board = views.is_known
    return views.eye if is_eye else eye, views.board if is_board else board


@dataclass(frozen=True, eq=False)
class _Search:
    """A search for twelve values: the camera's inverse pose, the board's middle, and its rotation.

    Args:
        views: The pictures.
        carried: What carries the board past the camera, corner by corner.
        pixels: Where each corner was seen.
        arms: From the board's middle to each corner, in the board's frame.
        middle: Of the corners, in the board's frame.
    """

    views: Views
    carried: Float[np.ndarray, "n 4 4"]
    pixels: Float[np.ndarray, "n 2"]
    arms: Float[np.ndarray, "n 3"]
    middle: Float[np.ndarray, "3"]

    @classmethod
    def of(cls, views: Views) -> "_Search":
        row, spot = np.nonzero(np.isfinite(views.seen[..., 0]))
        some = np.unique(np.linspace(0, len(spot) - 1, MAX_CORNERS).astype(int))
        row, spot = row[some], spot[some]
        middle = views.points[np.unique(spot)].mean(0)
        return cls(views, views.carried[row], views.seen[row, spot], views.points[spot] - middle, middle)

    def values(self, eye: Pose, board: Pose) -> Float[np.ndarray, "12"]:
        """The values of poses of camera and board."""
        inverse = se3.inverse(eye)
        turns = [se3.matrix_to_rotvec(pose[:3, :3]) for pose in (inverse, board)]
        return np.concatenate([turns[0], inverse[:3, 3], se3.apply(board, self.middle), turns[1]])

    def off(self, values: Float[np.ndarray, "12"]) -> Float[np.ndarray, " twice"]:
        """Errors of corners [px]."""
        held = values[6:9] + Rotation.from_rotvec(values[9:]).apply(self.arms)
        base = se3.apply(self.carried, held)
        before = Rotation.from_rotvec(values[:3]).apply(base) + values[3:6]
        return np.clip((self.views.camera.project(before).pixel - self.pixels).ravel(), -1e6, 1e6)

    def best(self, firsts: list[Float[np.ndarray, "12"]], tried: int = TRIED) -> Float[np.ndarray, "12"]:
        """The best of the likeliest first values after robust steps in those that are unknown."""
        likely = sorted(firsts, key=self._cost)[:tried]
        return min(map(self._refined, likely), key=self._cost)

    def _cost(self, values: Float[np.ndarray, "12"]) -> float:
        return float(np.log1p((self.off(values) / ROUGH) ** 2).sum())

    def _refined(self, values: Float[np.ndarray, "12"]) -> Float[np.ndarray, "12"]:
        free = np.repeat(np.logical_not(self.views.is_known), 6)

        def rest(some: np.ndarray) -> np.ndarray:
            every = values.copy()
            every[free] = some
            return self.off(every)

        found = values.copy()
        steps = least_squares(rest, values[free], loss="cauchy", f_scale=ROUGH, x_scale="jac", max_nfev=40)
        found[free] = steps.x
        return found

    def firsts(self) -> Iterator[Float[np.ndarray, "12"]]:
        """The camera for every place of the board's middle, or for its known pose."""
        views, (is_eye, is_board) = self.views, self.views.is_known
        if is_board:
            row, spot = np.nonzero(np.isfinite(views.seen[..., 0]))
            body = se3.apply(views.carried[row] @ views.board, views.points[spot])
            if (eye := self._eye(body, views.seen[row, spot])) is not None:
                yield self.values(eye, views.board)
            return
        for at in self._places():
            eye = views.eye if is_eye else self._eye(se3.apply(self.carried, at), self.pixels)
            if eye is not None:
                yield self.values(eye, se3.pose(np.eye(3), at - self.middle))

    def _eye(self, body: Float[np.ndarray, "n 3"], pixels: Float[np.ndarray, "n 2"]) -> Pose | None:
        """Pose of the camera before points; None where there is no answer."""
        cv2, rays = opencv(), self.views.camera.normalised(pixels)
        is_placed, turn, shift = cv2.solvePnP(body, rays, np.eye(3), None, flags=cv2.SOLVEPNP_SQPNP)
        if not is_placed or not np.isfinite([turn, shift]).all():
            return None
        return se3.inverse(se3.pose(se3.rotvec_to_matrix(turn.ravel()), shift.ravel()))

    def _places(self) -> Float[np.ndarray, "places 3"]:
        """Where a board may be: near the tool that carries it, or within the arm's reach."""
        middle, half = np.zeros(3), np.full(3, BESIDE_TOOL)
        if self.views.camera.mounted is not Mount.WORLD:
            places = self.views.tool[:, :3, 3]
            middle, half = places.mean(0), np.maximum(np.ptp(places, axis=0), 2.0 * BESIDE_TOOL)
        steps = np.linspace(-1.0, 1.0, GRID)
        return middle + half * np.array(list(product(steps, steps, steps)))
