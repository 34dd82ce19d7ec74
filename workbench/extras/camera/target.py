"""Camera targets: a ChArUco board or points at known positions, or several of these, and `target.toml`.

Each of several boards has its own pose, and their relative poses need not be known. Their markers
and corners are told apart by their numbers: those of a ChArUco board go on where the boards before it end.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Annotated, Any, final

import numpy as np
import tomli_w
from jaxtyping import Bool, Float, Int

from workbench.arm.conventions import Bounded
from workbench.arm.joint import NotNegative
from workbench.base.arguments import Reads, admit
from workbench.base.errors import OptionError
from workbench.base.toml import AbstractTableReader
from workbench.base.types import frozen
from workbench.base.wording import listed
from workbench.extras.camera.camera import Mount

BOARD_SCALE, POINT_SCALE = 0.002, 0.0005
"""Prior knowledge of the scale of a printed board (relative) and of points that were measured …"""
BOARD_FLATNESS = 3e-4
"""… and of how far a board's edges bend out of its plane [m]."""
MAX_SQUARES = 10_000
"""Of a board; the largest dictionaries have markers for a fifth of them."""
KNOWLEDGE = ("scale_sigma", "flatness_sigma")


def _across_down(value: Any, given: Any) -> Any:
    return [*map(int, re.split("[xX×]", value))] if isinstance(value, str) else value


@dataclass(frozen=True)
class Charuco:
    """A ChArUco board: a chessboard with a marker in every white square.

    Args:
        squares: How many across (columns) and down (rows).
        square: Side of a square [m].
        marker: Side of a marker [m].
        dictionary: Name of the markers' dictionary, such as `DICT_6X6_250`.
        first_marker: Number of its first marker.
    """

    squares: Annotated[tuple[int, int], Reads("like 5x7, or two whole numbers", _across_down)]
    square: float
    marker: float
    dictionary: str
    first_marker: int = 0

    def __post_init__(self):
        admit(self)
        across, down = self.squares
        if min(across, down) < 2 or not 0.0 < self.marker < self.square or self.first_marker < 0:
            needs = "2 x 2 squares or more, and markers smaller than its squares, numbered from 0 or more"
            got = f"{across} x {down} squares of {self.square:g} m with markers of {self.marker:g} m from"
            raise OptionError(f"a ChArUco board needs {needs}; got {got} {self.first_marker} on")
        if across * down > MAX_SQUARES:
            raise OptionError(f"a ChArUco board has at most {MAX_SQUARES} squares, got {across} x {down}")

    @property
    def markers(self) -> range:
        return range(self.first_marker, self.first_marker + self.squares[0] * self.squares[1] // 2)


@dataclass(frozen=True, eq=False, kw_only=True)
class PictureTarget:
    """Points that cameras see, in a frame of their own.

    Args:
        name: Of one of several; "" where it is the only one.
        mounted: Whether the tool carries it or it stands in the cell.
        ids: Of the tag, or of the board's inner corner counted along its rows from its first one.
        corners: Number of a tag's corner; 0 where an id has one point.
        points: Places [m] in the target's frame.
        charuco: The board, where it is one.
        dictionary: Of its markers, such as `DICT_6X6_250`; "" where nobody said.
        scale_sigma: Standard deviation of the target's true size relative to the stated one; 0 for exact.
        flatness_sigma: How far a board's edges bend out of its plane [m, one standard deviation]; 0 for flat.
        sigmas: Of single points, how well each place is known [m, each axis]; 0 for exact (and left
            out), inf for free.
        per_session: Whether it may have another pose in every session.
    """

    name: str = ""
    mounted: Mount
    ids: Int[np.ndarray, " points"]
    corners: Int[np.ndarray, " points"]
    points: Float[np.ndarray, "points 3"]
    charuco: Charuco | None = None
    dictionary: str = ""
    scale_sigma: float = POINT_SCALE
    flatness_sigma: float = 0.0
    sigmas: Mapping[int, float] = field(default_factory=dict)
    per_session: bool = False

    def __len__(self) -> int:
        return len(self.points)

    @cached_property
    def shape(self) -> dict[str, tuple[str, float, float, Float[np.ndarray, "points 3"]]]:
        """What of its shape is unknown: unit, standard deviation, start, and how a unit moves each point.

        Its scale; three bends xx, xy, yy out of the plane z = 0; the places of points of its own.
        """
        away = self.points - self.points.mean(0)
        x, y = (away / np.linalg.norm(away, axis=1).max())[:, :2].T
        found = {"scale": ("1", self.scale_sigma, 0.0, self.still)}
        for name, z in {"bend_xx": x * x, "bend_xy": x * y, "bend_yy": y * y}.items():
            found[name] = "m", self.flatness_sigma, 0.0, z[:, None] * np.eye(3)[2]
        for (k, sigma), axis in product(sorted(self.sigmas.items()), range(3)):
            name, moves = f"point{self.ids[k]}_{self.corners[k]}.{'xyz'[axis]}", np.zeros(self.points.shape)
            moves[k, axis] = 1.0
            found[name] = "m", sigma, float(self.points[k, axis]), moves
        return {name: each for name, each in found.items() if each[1] > 0.0}

    @cached_property
    def still(self) -> Float[np.ndarray, "points 3"]:
        """Places of the points, 0 of those that have one of their own."""
        return np.where(np.isin(np.arange(len(self)), list(self.sigmas))[:, None], 0.0, self.points)

    @property
    def placing(self) -> Bool[np.ndarray, " points"]:
        """Which points are known well enough to place a camera by."""
        return np.array([not np.isinf(self.sigmas.get(k, 0.0)) for k in range(len(self))], bool)

    @property
    def owner(self) -> str:
        """How the names of its unknowns begin."""
        return f"target[{self.name}]" if self.name else "target"

    @property
    def markers(self) -> set[int]:
        return set(self.ids.tolist() if self.charuco is None else self.charuco.markers)

    @property
    def text(self) -> str:
        if self.charuco is None:
            return f"{len(self)} points of ids {listed(sorted(set(self.ids.tolist())))}"
        across, down = self.charuco.squares
        numbers = f"{self.ids[0]} … {self.ids[-1]}"
        return f"{len(self)} inner corners ({numbers}) of a board of {across} x {down} squares"


def prints_of(dictionary: str) -> str:
    """What dictionaries have in common that print a number alike: DICT_6X6 of DICT_6X6_50 … DICT_6X6_1000."""
    return re.sub(r"_(50|100|250|1000)$", "", dictionary)


def charuco_target(
    board: Charuco, mounted: Mount | str, *, name: str = "", first: int = 0, **more: float | bool
) -> PictureTarget:
    """The inner corners of a board: z = 0, x along its rows and y down, from the corner of its first square.

    Args:
        board: Its squares and markers.
        mounted: What carries it.
        name: Of one of several.
        first: Number of its first corner.
        **more: `scale_sigma` and `flatness_sigma` where they are not the usual ones, `per_session`.
    """
    across, down = board.squares
    y, x = np.divmod(np.arange((across - 1) * (down - 1)), across - 1)
    points = board.square * np.stack([x + 1.0, y + 1.0, np.zeros(len(x))], axis=1)
    known: dict[str, Any] = {"scale_sigma": BOARD_SCALE, "flatness_sigma": BOARD_FLATNESS, **more}
    known |= {"charuco": board, "dictionary": board.dictionary, "points": frozen(points)}
    known |= {"ids": first + np.arange(len(x)), "corners": np.zeros(len(x), int)}
    return PictureTarget(name=name, mounted=Mount(mounted), **known)


@dataclass(frozen=True, kw_only=True)
class PointEntry:
    """One `[[point]]`; a free one may have a place nearby, where the search for it begins."""

    id: int
    corner: int = 0
    xyz: Annotated[
        tuple[Bounded, ...], Reads("three finite numbers", lambda v, _: v if len(v) == 3 else None)
    ] = ()
    sigma: NotNegative = 0.0
    free: bool = False


@dataclass(frozen=True, kw_only=True)
class BoardEntry:
    """A target's file, or one `[[board]]` of it: either a ChArUco board or points."""

    name: str = ""
    charuco: dict[str, Any] = field(default_factory=dict)
    point: tuple[dict[str, Any], ...] = ()
    dictionary: str = ""
    scale_sigma: NotNegative | None = None
    flatness_sigma: NotNegative | None = None
    per_session: bool = False


@final
class _TargetReader(AbstractTableReader):
    wanted = "a target TOML with [charuco], [[point]] or [[board]] tables"
    otherwise = "a target TOML (mounted, and [charuco] or [[point]], or a [[board]] of either each)"

    def target(
        self, table: dict[str, Any], mounted: Mount, before: Sequence[PictureTarget], what: str
    ) -> PictureTarget:
        """The one that a table describes, behind those before it."""
        entry = self.record(BoardEntry, table, what)
        if ("charuco" in table) == ("point" in table):
            text = "[charuco] or [[point]] tables; several boards: a [[board]] with either for each"
            raise self.fail(f"{what} needs either {text}")
        known: dict[str, Any] = {key: getattr(entry, key) for key in KNOWLEDGE if key in table}
        known |= {"name": entry.name, "per_session": entry.per_session}
        if "charuco" not in table:
            made = self.points(entry, mounted, known)
        else:
            first = max((int(other.ids.max()) + 1 for other in before), default=0)
            given = {"dictionary": entry.dictionary or "DICT_6X6_250", **entry.charuco}
            prints = prints_of(str(given["dictionary"]))
            free = max((max(b.markers) + 1 for b in before if prints_of(b.dictionary) == prints), default=0)
            board = self.record(Charuco, {"first_marker": free, **given}, f"{what} charuco")
            made = charuco_target(board, mounted, first=first, **known)
        prints = prints_of(made.dictionary)
        for other in before:
            points = (zip(each.ids.tolist(), each.corners.tolist(), strict=True) for each in (other, made))
            shared = [f"id {k} corner {c}" for k, c in sorted(set.intersection(*map(set, points)))]
            if prints_of(other.dictionary) == prints != "" and (other.charuco or made.charuco):
                shared = [f"marker {k}" for k in sorted(other.markers & made.markers)] + shared
            twice = [f"{what} is of '{other.name}' and '{made.name}'" for what in shared]
            if twice := twice + [f"has two boards named '{made.name}'"] * (other.name == made.name):
                own = "give each board its own name, markers (first_marker) and ids, tags first"
                raise self.fail(f"{twice[0]}; {own}")
        return made

    def points(self, entry: BoardEntry, mounted: Mount, known: dict[str, Any]) -> PictureTarget:
        entries = [self.record(PointEntry, t, f"[[point]] {i}") for i, t in enumerate(entry.point, 1)]
        if lost := [i for i, each in enumerate(entries, 1) if not (each.free or each.xyz)]:
            raise self.fail(f"[[point]] {lost[0]} has no xyz")
        names = [(each.id, each.corner) for each in entries]
        if twice := {name for name in names if names.count(name) > 1}:
            raise self.fail("id {} corner {} appears twice; each point needs its own".format(*min(twice)))
        is_known = np.array([not each.free for each in entries], bool)
        if not is_known.any():
            raise self.fail("has no point of known position; give at least one without free = true")
        points = np.array([each.xyz or [np.nan] * 3 for each in entries])
        points[np.isnan(points[:, 0])] = points[is_known].mean(0)  # until the pictures place it
        sigmas = {i: np.inf if e.free else e.sigma for i, e in enumerate(entries) if e.free or e.sigma}
        known |= {"sigmas": sigmas, "dictionary": entry.dictionary, "points": frozen(points)}
        ids, corners = np.array(names).T
        return PictureTarget(mounted=mounted, ids=ids, corners=corners, **known)


def read_targets(path: Path | str) -> tuple[PictureTarget, ...]:
    """The target of a file, or the boards that it has in `[[board]]` tables."""
    reader = _TargetReader(path)
    data = reader.load()
    if (mounted := data.pop("mounted", None)) not in tuple(Mount):
        raise reader.fail(f'mounted must be "tool" or "world", not {mounted!r}')
    if not data.get("board"):
        return (reader.target(data, Mount(mounted), (), "the file"),)
    reader.keys(data, {"board", "dictionary", *KNOWLEDGE}, "a file with [[board]] tables")
    shared, boards = {key: data[key] for key in data if key != "board"}, list[PictureTarget]()
    for number, table in enumerate(reader.tables(data, "board"), 1):
        named = {"name": f"board{number}", **shared, **table}
        boards.append(reader.target(named, Mount(mounted), boards, f"[[board]] {number}"))
    return tuple(boards)


def target_toml(target: PictureTarget) -> str:
    """A ChArUco board as `read_targets` reads it."""
    assert target.charuco is not None, "only boards are printed"
    board = {**vars(target.charuco), "squares": list(target.charuco.squares)}
    known = {key: getattr(target, key) for key in KNOWLEDGE}
    return tomli_w.dumps({"mounted": str(target.mounted), **known, "charuco": board})
