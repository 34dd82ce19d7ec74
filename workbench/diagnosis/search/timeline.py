"""Order in which rows were measured: by time if every row has one, else as in the file."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.data.dataset import Dataset
from workbench.data.measuring_order import clock_of

MAX_PIECES = 160
"""Maximum number of pieces of time for the event search; near events that were found, every row is a
piece."""
SINGLE_ROW_PIECES = 3
"""Number of pieces on either side of a found event in which every row is a separate piece."""


@dataclass(frozen=True, eq=False)
class Timeline:
    """Rows in measuring order, divided into consecutive pieces.

    Args:
        clock: Key that orders the rows: times [s], or numbers in the file.
        is_timed: Whether it is time.
        row: Their numbers in the file.
        piece: Piece of every row, counted from 0.
        session: Session of every row, counted from 0.
    """

    clock: Float[np.ndarray, " rows"]
    is_timed: bool
    row: Int[np.ndarray, " rows"]
    piece: Int[np.ndarray, " rows"]
    session: Int[np.ndarray, " rows"]

    @classmethod
    def of(cls, data: Dataset, near: Sequence[float] = ()) -> "Timeline":
        """Of some rows.

        Args:
            data: The rows.
            near: Clock readings near which every row is a separate piece.
        """
        clock, is_timed = clock_of(data)
        known = np.unique(clock)
        bounds = np.unique(np.linspace(0, len(known), min(len(known), MAX_PIECES) + 1).round().astype(int))
        reach = SINGLE_ROW_PIECES * (len(known) // MAX_PIECES + 1)
        for moment in near if len(known) > MAX_PIECES else ():
            place = int(np.searchsorted(known, moment))
            bounds = np.union1d(bounds, np.arange(max(place - reach, 0), min(place + reach, len(known)) + 1))
        piece = np.searchsorted(bounds, np.searchsorted(known, clock), side="right") - 1
        named = np.zeros(len(data), int) if data.session is None else np.asarray(data.session)
        session = np.unique(named, return_inverse=True)[1].reshape(-1)
        return cls(clock, is_timed, np.asarray(data.row), piece, session)

    @cached_property
    def order(self) -> Int[np.ndarray, " rows"]:
        """Indices of the rows in measuring order."""
        return np.lexsort((self.row, self.clock))

    @cached_property
    def first(self) -> Int[np.ndarray, " pieces"]:
        """Index of the first row of every piece."""
        return self.order[np.flatnonzero(np.diff(self.piece[self.order], prepend=-1))]

    @cached_property
    def middle(self) -> Float[np.ndarray, " pieces"]:
        """Mean clock reading of every piece."""
        return np.bincount(self.piece, self.clock) / np.bincount(self.piece)

    @cached_property
    def before(self) -> Int[np.ndarray, " pieces"]:
        """Number of rows before every piece."""
        return np.concatenate([[0], np.cumsum(np.bincount(self.piece))[:-1]])

    @cached_property
    def sides(self) -> Int[np.ndarray, "pieces 2"]:
        """Number of rows of a piece's first session before it, and from it on."""
        session = self.session[self.order]
        mine = session == self.session[self.first][:, None]
        is_before = np.arange(len(session)) < self.before[:, None]
        return np.column_stack([(mine & is_before).sum(1), (mine & ~is_before).sum(1)])


def crowded(
    marked: Bool[np.ndarray, " rows"], data: Dataset, *, within: int, fewest: int
) -> Bool[np.ndarray, " rows"]:
    """Marked rows of which at least `fewest` lie among `within` consecutive ones."""
    order = np.lexsort((np.asarray(data.row), clock_of(data)[0]))
    places = np.flatnonzero(marked[order])
    out = np.zeros(len(marked), bool)
    for first, last in zip(places, places[fewest - 1 :], strict=False):
        if last - first < within:
            out[order[first : last + 1]] = True
    return out & marked
