"""Poses of a camera and of a board from all pictures at once, where none of them shows enough by itself or
some contradict the others.

The arm carries the board's points past the camera (or the camera past them), and so makes one large body of
points of all pictures. Seen from far away the board is a single point c in what carries it: every c of a grid
gives the camera by SQPnP. The best are refined with c free, then with the board turned in each of the 24
ways of a cube. Pictures with a board's pose of their own give others: by hand–eye from any three of them, so
that wrong pictures spoil some only. What suits most corners holds.

Source: Fischler, Bolles, Random sample consensus, Comm. ACM 24(6), 1981.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from workbench.base import se3
from workbench.base.hand_eye import base_and_tool
from workbench.extras.camera.camera import Camera, Mount
from workbench.extras.camera.opencv import opencv

MAX_CORNERS = 150
"""Corners that take part; more add nothing to a first guess."""
GRID, TRIED = 5, 4
"""Places of the board along each axis, and those of them that are refined."""
BESIDE_TOOL = 0.3
"""Distance of a board from the tool that carries it, along each axis, at most [m]."""
ROUGH = 20.0
"""Errors [px] that count less and less in a first guess."""
SAMPLES, MIN_POSES = 60, 3
"""Draws of so many pictures with a pose of their own, from which camera and board are placed."""


@dataclass(frozen=True, eq=False)
class StartInput:
    """What a joint start is found from; equal by numbers, as fits of the same pictures ask for it again.

    Args:
        camera: Its intrinsics.
        points: Of the board, in its own frame [m].
        seen: Where they were seen [px]; NaN where they were not.
        tool: Poses of the tool in the base.
        sight: Pose of the board in the camera by each picture alone; NaN where unknown.
        known: Pose of the camera, if known.
    """

    camera: Camera
    points: Float[np.ndarray, "points 3"]
    seen: Float[np.ndarray, "rows points 2"]
    tool: Float[np.ndarray, "rows 4 4"]
    sight: Float[np.ndarray, "rows 4 4"]
    known: Float[np.ndarray, "4 4"] | None = None

    @cached_property
    def _key(self) -> tuple[bytes, ...]:
        arrays = (self.camera.intrinsics, self.points, self.seen, self.tool, self.sight)
        known = b"" if self.known is None else self.known.tobytes()
        return (*(np.ascontiguousarray(a).tobytes() for a in arrays), self.camera.mounted.encode(), known)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, StartInput) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    @cached_property
    def carried(self) -> Float[np.ndarray, "rows 4 4"]:
        """What carries the board past the camera."""
        return self.camera.carried(self.tool)

    @cached_property
    def corners(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What carries the board past the camera, number of the point, and pixels, corner by corner."""
        row, spot = np.nonzero(np.isfinite(self.seen[..., 0]))
        return self.carried[row], spot, self.seen[row, spot]

    def are_all_near(self, eye: Float[np.ndarray, "4 4"], board: Float[np.ndarray, "4 4"]) -> bool:
        """Whether every picture suits these poses of camera and board."""
        at = se3.inverse(eye) @ self.carried @ board
        off = np.linalg.norm(
            self.camera.project(se3.apply(at[:, None], self.points)).pixel - self.seen, axis=2
        )
        each = np.nanmean(off[np.isfinite(off).any(1)], axis=1)
        return bool(each.max() <= ROUGH)

    def by_sights(self) -> Iterator[tuple[Float[np.ndarray, "4 4"], Float[np.ndarray, "4 4"]]]:
        """Poses of camera and board by single pictures where the camera is known, else by three of them."""
        rows = np.flatnonzero(np.isfinite(self.sight[:, 0, 0]))
        if self.known is not None:
            yield from ((self.known, se3.inverse(self.carried[i]) @ self.known @ self.sight[i]) for i in rows)
            return
        if len(rows) < MIN_POSES:
            return
        draw = np.random.default_rng(0)
        some = [rows, *(draw.choice(rows, MIN_POSES, replace=False) for _ in range(SAMPLES))]
        for mine in some:
            yield placed_by_sights(self.camera, self.tool[mine], self.sight[mine])


def placed_by_sights(
    camera: Camera, tool: Float[np.ndarray, "n 4 4"], sight: Float[np.ndarray, "n 4 4"]
) -> tuple[Float[np.ndarray, "4 4"], Float[np.ndarray, "4 4"]]:
    """Poses of camera and board in closed form, from the board's pose in each picture."""
    is_fixed = camera.mounted is Mount.WORLD
    seen = sight if is_fixed else se3.inverse(sight)
    base, z = base_and_tool(tool, seen)
    x = se3.inverse(base)
    return (x, z) if is_fixed else (z, x)


@lru_cache(maxsize=8)
def joint_start(given: StartInput) -> tuple[Float[np.ndarray, "4 4"], Float[np.ndarray, "4 4"]]:
    """Poses of camera and board, each in what carries it."""
    camera, points, known = given.camera, given.points, given.known
    carried, spot, pixels = given.corners
    some = np.unique(np.linspace(0, len(spot) - 1, MAX_CORNERS).astype(int))
    carried, spot, pixels = carried[some], spot[some], pixels[some]
    places = _grid(given.tool, is_fixed=camera.mounted is Mount.WORLD)
    middle = points[np.unique(spot)].mean(0)
    arms = points[spot] - middle

    def off(values: np.ndarray, turn: Rotation | None = None) -> np.ndarray:
        """Errors [px] for the camera's inverse pose, the board's middle and, with `turn`, its rotation."""
        held = values[6:9] + np.zeros(arms.shape)
        if turn is not None:
            held = held + (Rotation.from_rotvec(values[9:]) * turn).apply(arms)
        base = np.einsum("nij,nj->ni", carried[:, :3, :3], held) + carried[:, :3, 3]
        before = Rotation.from_rotvec(values[:3]).apply(base) + values[3:6]
        return np.clip((camera.project(before).pixel - pixels).ravel(), -1e6, 1e6)

    is_held = known is not None
    by_sights = [_values(*poses, middle) for poses in given.by_sights()]
    by_sights = sorted(by_sights, key=lambda each: _cost(off(*each)))[:TRIED]
    found = [(_refined(off, values, is_held, turn), turn) for values, turn in by_sights]
    if not by_sights:
        firsts = _by_points(camera, carried, pixels, places, known)
        firsts = sorted(firsts, key=lambda values: _cost(off(values)))[:TRIED]
        found = [(_refined(off, values, is_held), Rotation.identity()) for values in firsts]
    if not by_sights and len(np.unique(spot)) > 1:
        best = min(found, key=lambda each: _cost(off(each[0])))[0]
        turned = [np.append(best, np.zeros(3))] * 24
        found = [
            (_refined(off, values, is_held, turn), turn)
            for values, turn in zip(turned, Rotation.create_group("O"), strict=True)
        ]
    values, turn = min(found, key=lambda each: _cost(off(*each) if len(each[0]) > 9 else off(each[0])))
    if len(values) > 9:
        turn = Rotation.from_rotvec(values[9:]) * turn
    board = se3.pose(turn.as_matrix(), values[6:9] - turn.apply(middle))
    eye = se3.inverse(se3.pose(Rotation.from_rotvec(values[:3]).as_matrix(), values[3:6]))
    return eye if known is None else known, board


def _values(
    eye: Float[np.ndarray, "4 4"], board: Float[np.ndarray, "4 4"], middle: Float[np.ndarray, "3"]
) -> tuple[Float[np.ndarray, "12"], Rotation]:
    """Poses of camera and board as a search begins with them."""
    inverse = se3.inverse(eye)
    six = [se3.matrix_to_rotvec(inverse[:3, :3]), inverse[:3, 3]]
    return np.concatenate([*six, se3.apply(board, middle), np.zeros(3)]), Rotation.from_matrix(board[:3, :3])


def placed_camera(given: StartInput, board: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "4 4"]:
    """The pose of a camera that sees a board whose pose is known."""
    carried, spot, pixels = given.corners
    body = se3.apply(carried, se3.apply(board, given.points)[spot])
    found = _solved(body, given.camera.normalised(pixels))
    return np.eye(4) if found is None else se3.inverse(se3.pose(se3.rotvec_to_matrix(found[:3]), found[3:]))


def _solved(body: np.ndarray, rays: np.ndarray) -> Float[np.ndarray, "6"] | None:
    """Rotation vector and translation of points before a camera; None where there is no answer."""
    cv2 = opencv()
    is_placed, turn, shift = cv2.solvePnP(body, rays, np.eye(3), None, flags=cv2.SOLVEPNP_SQPNP)
    found = np.concatenate([np.ravel(turn), np.ravel(shift)]) if is_placed else np.full(6, np.nan)
    return found if np.isfinite(found).all() else None


def _cost(off: np.ndarray) -> float:
    return float(np.log1p((off / ROUGH) ** 2).sum())


def _refined(
    off: Callable[..., np.ndarray], values: np.ndarray, is_held: bool, *turn: Rotation
) -> np.ndarray:
    """The values after robust steps; the camera's six are held where they are known."""
    begin = 6 if is_held else 0

    def rest(free: np.ndarray) -> np.ndarray:
        return off(np.concatenate([values[:begin], free]), *turn)

    steps = least_squares(rest, values[begin:], loss="cauchy", f_scale=ROUGH, x_scale="jac", max_nfev=40)
    return np.concatenate([values[:begin], steps.x])


def _grid(tool: np.ndarray, *, is_fixed: bool) -> Float[np.ndarray, "places 3"]:
    """Where a board may be: near the tool that carries it, or within the arm's reach."""
    middle, half = np.zeros(3), np.full(3, BESIDE_TOOL)
    if not is_fixed:
        places = tool[:, :3, 3]
        middle, half = places.mean(0), np.maximum(np.ptp(places, axis=0), 2.0 * BESIDE_TOOL)
    steps = np.linspace(-1.0, 1.0, GRID)
    return middle + half * np.array(list(product(steps, steps, steps)))


def _by_points(
    camera: Camera, carried: np.ndarray, pixels: np.ndarray, places: np.ndarray, known: np.ndarray | None
) -> list[Float[np.ndarray, "9"]]:
    """The camera for every place of the board's middle, which comes last."""
    if known is not None:
        return [_values(known, se3.pose(np.eye(3), at), np.zeros(3))[0][:9] for at in places]
    rays, found = camera.normalised(pixels), []
    for at in places:
        placed = _solved(carried[:, :3, :3] @ at + carried[:, :3, 3], rays)
        if placed is not None:
            found.append(np.append(placed, at))
    return found
