"""What a camera looks at: a ChArUco board or points at known places, and `target.toml`."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, final

import numpy as np
import tomli_w
from jaxtyping import Float, Int

from workbench.base.errors import DataError
from workbench.base.files import write_text
from workbench.base.toml import AbstractTableReader
from workbench.base.types import frozen
from workbench.base.wording import listed
from workbench.data.camera.camera import Mount

BOARD_SCALE, POINT_SCALE = 0.002, 0.0005
"""Prior knowledge of the scale of a printed board (relative) and of points that were measured …"""
BOARD_FLATNESS = 3e-4
"""… and of how far a board's edges bend out of its plane [m]."""


@dataclass(frozen=True)
class Charuco:
    """A ChArUco board: a chessboard with a marker in every white square.

    Args:
        squares: How many across (columns) and down (rows).
        square: Side of a square [m].
        marker: Side of a marker [m].
        dictionary: Name of the markers' dictionary, such as `DICT_6X6_250`.
    """

    squares: tuple[int, int]
    square: float
    marker: float
    dictionary: str


@dataclass(frozen=True, eq=False, kw_only=True)
class Target:
    """Points that cameras see, in a frame of their own.

    Args:
        mounted: Whether the tool carries it or it stands in the cell.
        ids: Of the tag, or of the board's inner corner counted along its rows.
        corners: Number of a tag's corner; 0 where an id has one point.
        points: Places [m] in the target's frame.
        charuco: The board, where it is one.
        dictionary: Of single tags, such as `DICT_6X6_250`; "" where nobody said.
        scale_sigma: Standard deviation of the target's true size relative to the stated one; 0 for exact.
        flatness_sigma: How far a board's edges bend out of its plane [m, one standard deviation]; 0 for flat.
    """

    mounted: Mount
    ids: Int[np.ndarray, " points"]
    corners: Int[np.ndarray, " points"]
    points: Float[np.ndarray, "points 3"]
    charuco: Charuco | None = None
    dictionary: str = ""
    scale_sigma: float = POINT_SCALE
    flatness_sigma: float = 0.0

    def __len__(self) -> int:
        return len(self.points)

    @cached_property
    def size(self) -> float:
        """Greatest distance of a point from the middle [m]."""
        return float(np.linalg.norm(self.points - self.points.mean(0), axis=1).max())

    @cached_property
    def bends(self) -> Float[np.ndarray, "points 3"]:
        """How far each point leaves the plane z = 0 for a unit of each of three bends: xx, xy, yy."""
        x, y = ((self.points - self.points.mean(0)) / self.size)[:, :2].T
        return np.stack([x * x, x * y, y * y], axis=1)

    def places(self, ids: Int[np.ndarray, " n"], corners: Int[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
        """Number of each named point; -1 for those that the target does not have."""
        place = {pair: k for k, pair in enumerate(zip(self.ids.tolist(), self.corners.tolist(), strict=True))}
        return np.array(
            [place.get(pair, -1) for pair in zip(ids.tolist(), corners.tolist(), strict=True)], int
        )

    @property
    def words(self) -> str:
        """The points that it has."""
        if self.charuco is None:
            return f"{len(self)} points of ids {listed(sorted(set(self.ids.tolist())))}"
        across, down = self.charuco.squares
        return f"{len(self)} inner corners (0 … {len(self) - 1}) of a board of {across} x {down} squares"

    @cached_property
    def planar(self) -> tuple[np.ndarray, ...]:
        """Points that lie in one plane and can place a camera alone, group by group: the board, or each tag
        of four corners or more."""
        groups = [np.flatnonzero(self.ids == k) for k in sorted(set(self.ids.tolist()))]
        groups = [np.arange(len(self)), *(g for g in groups if 4 <= len(g) < len(self))]
        return tuple(g for g in groups if len(g) >= 4 and _is_plane(self.points[g]))


def charuco_target(board: Charuco, mounted: Mount | str, **knowledge: float) -> Target:
    """The inner corners of a board: z = 0, x along its rows and y down, from the corner of its first square.

    Args:
        board: Its squares and markers.
        mounted: What carries it.
        **knowledge: `scale_sigma` and `flatness_sigma` where they are not the usual ones.

    Raises:
        DataError: a board that can't be.
    """
    across, down = board.squares
    if min(across, down) < 2 or board.square <= 0.0 or not 0.0 < board.marker < board.square:
        raise DataError(
            f"a ChArUco board needs 2 x 2 squares or more, and markers smaller than its squares; got "
            f"{across} x {down} squares of {board.square:g} m with markers of {board.marker:g} m"
        )
    y, x = np.divmod(np.arange((across - 1) * (down - 1)), across - 1)
    points = board.square * np.stack([x + 1.0, y + 1.0, np.zeros(len(x))], axis=1)
    known: dict[str, Any] = {"scale_sigma": BOARD_SCALE, "flatness_sigma": BOARD_FLATNESS, **knowledge}
    return Target(
        mounted=Mount(mounted),
        ids=np.arange(len(x)),
        corners=np.zeros(len(x), int),
        points=frozen(points),
        charuco=board,
        **known,
    )


def _is_plane(points: Float[np.ndarray, "n 3"]) -> bool:
    """Whether points lie in a plane but not on a line."""
    s = np.linalg.svd(points - points.mean(0), compute_uv=False)
    return bool(s[1] > 1e-3 * s[0] and s[2] < 1e-6 * s[0])


@final
class _Reader(AbstractTableReader):
    wanted = "a target TOML with [charuco] or [[point]] tables"
    otherwise = "a target TOML (mounted, and [charuco] or [[point]])"

    def charuco(self, value: Any) -> Charuco:
        table = self.table(value, "[charuco]")
        self.keys(table, {"squares", "square", "marker", "dictionary"}, "[charuco]")
        if missing := [key for key in ("squares", "square", "marker") if key not in table]:
            raise self.fail(f"[charuco] has no {missing[0]}")
        squares = self.numbers(table["squares"], 2, "[charuco] squares")
        return Charuco(
            (int(squares[0]), int(squares[1])),
            self.number(table["square"], "[charuco] square"),
            self.number(table["marker"], "[charuco] marker"),
            str(table.get("dictionary", "DICT_6X6_250")),
        )

    def whole(self, value: Any, what: str) -> int:
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.fail(f"{what} must be a whole number, not {value!r}")
        return value

    def points(self, tables: list[dict[str, Any]], mounted: Mount, knowledge: dict[str, Any]) -> Target:
        names, places = [], []
        for i, table in enumerate(tables):
            what = f"[[point]] {i + 1}"
            self.keys(table, {"id", "corner", "xyz"}, what)
            if missing := [key for key in ("id", "xyz") if key not in table]:
                raise self.fail(f"{what} has no {missing[0]}")
            names.append(
                (self.whole(table["id"], f"{what} id"), self.whole(table.get("corner", 0), f"{what} corner"))
            )
            places.append(self.numbers(table["xyz"], 3, f"{what} xyz"))
        if twice := {name for name in names if names.count(name) > 1}:
            raise self.fail("id {} corner {} stands twice; every point needs its own".format(*min(twice)))
        if len(names) < 4:
            raise self.fail(f"has {len(names)} points; a camera needs four or more to be placed")
        ids, corners = np.array(names).T
        points = frozen(np.array(places))
        return Target(mounted=mounted, ids=ids, corners=corners, points=points, **knowledge)


def read_target(path: Path | str) -> Target:
    """A target of a file.

    Raises:
        FileError: names the key that is missing or wrong.
    """
    reader = _Reader(path)
    data = reader.load()
    known = {"mounted", "charuco", "point", "dictionary", "scale_sigma", "flatness_sigma"}
    reader.keys(data, known, "the file")
    if (mounted := data.get("mounted")) not in tuple(Mount):
        raise reader.fail(f'mounted must be "tool" or "world", not {mounted!r}')
    knowledge: dict[str, Any] = {
        key: reader.number(data[key], key) for key in ("scale_sigma", "flatness_sigma") if key in data
    }
    if any(value < 0.0 for value in knowledge.values()):
        raise reader.fail("scale_sigma and flatness_sigma must be at least 0")
    if ("charuco" in data) == ("point" in data):
        raise reader.fail("needs either one [charuco] table or [[point]] tables")
    if "charuco" not in data:
        knowledge["dictionary"] = str(data.get("dictionary", ""))
        return reader.points(reader.tables(data, "point"), Mount(mounted), knowledge)
    try:
        return charuco_target(reader.charuco(data["charuco"]), mounted, **knowledge)
    except DataError as error:
        raise reader.fail(str(error)) from None


def target_toml(target: Target) -> str:
    """A target as `read_target` reads it."""
    table: dict[str, Any] = {
        "mounted": str(target.mounted),
        "scale_sigma": target.scale_sigma,
        "flatness_sigma": target.flatness_sigma,
    }
    if (board := target.charuco) is not None:
        table["charuco"] = {
            "squares": list(board.squares),
            "square": board.square,
            "marker": board.marker,
            "dictionary": board.dictionary,
        }
    else:
        table |= {"dictionary": target.dictionary} if target.dictionary else {}
        rows = zip(target.ids.tolist(), target.corners.tolist(), target.points.tolist(), strict=True)
        table["point"] = [{"id": i, "corner": c, "xyz": xyz} for i, c, xyz in rows]
    return tomli_w.dumps(table)


def write_target(target: Target, path: Path | str) -> Path:
    """Write a target as `read_target` reads it."""
    return write_text(path, target_toml(target))
