"""Jacobian columns kept as products, and their inner products without forming the Jacobian.

A coefficient of an effect has a column that is the column of its element times one number per row. Many
coefficients share an element and six numbers are measured per row: inner products take a sixth of the time
this way, and no large matrix is stored.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby, islice, pairwise

import numpy as np
from jaxtyping import Float, Int

from workbench.base.threads import in_order
from workbench.identification.problem import Problem
from workbench.identification.problem_blocks import RowBlock

BLOCKS_AT_ONCE = 8
"""Number of blocks whose inner products are taken together."""


@dataclass(frozen=True, eq=False)
class Columns:
    """Whitened columns of a block's rows: D plain ones, then L products of an element's column with a law.

    Args:
        plain: The plain columns.
        shown: Column of each of E elements.
        laws: Factor of each product column, row by row.
        element: Element of each product column, ascending.
        order: Position of each column in the requested order.
    """

    plain: Float[np.ndarray, "rows m d"]
    shown: Float[np.ndarray, "rows m e"]
    laws: Float[np.ndarray, "rows l"]
    element: Int[np.ndarray, " l"]
    order: Int[np.ndarray, " dl"]

    @classmethod
    def of(
        cls,
        shown: Float[np.ndarray, "rows m e"],
        plain: Sequence[tuple[Int[np.ndarray, " _"], Float[np.ndarray, "rows m _"]]],
        laws: Sequence[tuple[Int[np.ndarray, " _"], Int[np.ndarray, " _"], Float[np.ndarray, "rows _ _"]]],
    ) -> "Columns":
        """Build from plain columns and from laws, each with their elements and positions."""
        beside = list(plain)
        alone: list[tuple[int, np.ndarray, np.ndarray]] = []
        for elements, places, law in laws:
            if len(elements) == 1:
                alone.append((int(elements[0]), places, law[:, 0]))
            else:
                beside.append((places, shown[:, :, elements] @ law))
        alone.sort(key=lambda each: each[0])
        moved, element = np.unique([e for e, mine, _ in alone for _ in mine], return_inverse=True)
        return cls(
            np.concatenate([shown[:, :, :0], *(part for _, part in beside)], axis=2),
            shown[:, :, moved.astype(np.int64)],
            np.concatenate([np.zeros((len(shown), 0)), *(law for *_, law in alone)], axis=1),
            element,
            np.concatenate([np.zeros(0, np.int64), *(p for p, _ in beside), *(p for _, p, _ in alone)]),
        )

    @cached_property
    def table(self) -> Float[np.ndarray, "rm dl"]:
        """All columns as one matrix, in the requested order."""
        return self.some(slice(None))[:, np.argsort(self.order)]

    def some(self, rows: np.ndarray | slice) -> Float[np.ndarray, "rm dl"]:
        """Some rows of all columns as one matrix, the plain ones first."""
        products = self.shown[rows][:, :, self.element] * self.laws[rows][:, None]
        whole = np.concatenate([self.plain[rows], products], axis=2)
        return whole.reshape(whole.shape[0] * whole.shape[1], whole.shape[2])

    def times(self, sizes: Float[np.ndarray, " dl"]) -> Float[np.ndarray, "rows m"]:
        """Their linear combination with these weights."""
        own, more = np.split(sizes[self.order], [self.plain.shape[2]])
        moved = np.zeros((len(self.laws), self.shown.shape[2]))
        for e, mine in self._groups:
            moved[:, e] = self.laws[:, mine] @ more[mine]
        return self.plain @ own + (self.shown @ moved[:, :, None])[:, :, 0]

    @cached_property
    def _groups(self) -> list[tuple[int, slice]]:
        """Elements with product columns, and which columns each has."""
        starts = np.flatnonzero(np.diff(self.element, prepend=-1)).tolist()
        bounds = pairwise([*starts, len(self.element)])
        return [(int(self.element[a]), slice(a, b)) for a, b in bounds]

    @cached_property
    def _by_element(self) -> tuple[Float[np.ndarray, "rows e d"], Float[np.ndarray, "rows e e"]]:
        """Products of element columns with plain columns and with each other, row by row."""
        shown = np.ascontiguousarray(self.shown.transpose(0, 2, 1))
        return shown @ self.plain, shown @ self.shown

    def add_inner(self, rows: np.ndarray | slice, out: Float[np.ndarray, "dl dl"]) -> None:
        """Accumulate the inner products of all columns over some rows."""
        plain, laws, (along, among) = self.plain[rows], self.laws[rows], (a[rows] for a in self._by_element)
        flat, size = plain.reshape(-1, plain.shape[2]), plain.shape[2]
        products = (along[:, e].T @ laws[:, mine] for e, mine in self._groups)
        by_plain = np.concatenate([flat.T @ flat, *products], axis=1)
        out[:size] += by_plain
        out[size:, :size] += by_plain[:, size:].T
        inner = out[size:, size:]
        for e, mine in self._groups:
            rest = slice(mine.start, None)
            found = laws[:, mine].T @ (laws[:, rest] * among[:, e].take(self.element[rest], 1))
            inner[mine, rest] += found
            inner[mine.stop :, mine] += found[:, mine.stop - mine.start :].T


def joined(
    tables: Iterable[tuple[Int[np.ndarray, " rows"], Columns]],
) -> Iterator[tuple[Int[np.ndarray, " rows"], Columns]]:
    """Columns of many rows in one, for blocks with the same components and unknowns."""
    for _, group in groupby(tables, lambda t: (t[1].shown.shape[1:], t[1].order.tobytes())):
        while some := list(islice(group, BLOCKS_AT_ONCE)):
            rows, parts = zip(*some, strict=True)
            kinds = ([getattr(part, name) for part in parts] for name in ("plain", "shown", "laws"))
            plain, shown, laws = map(np.concatenate, kinds)
            yield np.concatenate(rows), Columns(plain, shown, laws, parts[0].element, parts[0].order)


def inner_products(problem: Problem, x: Float[np.ndarray, " p"]) -> Float[np.ndarray, "p1 p1"]:
    """Inner products of a problem's Jacobian columns, the prior's rows included; the residual is last."""

    def columns(block: RowBlock) -> tuple[Int[np.ndarray, " rows"], Columns]:
        part, twists = block.at(x)
        by_twist, mine = problem.whiten(block, part.by_twist), block.unknowns >= 0
        plain = [(block.places, by_twist @ twists.plain)]
        if mine.any():
            plain.append((block.unknowns[mine], problem.whiten(block, part.by_unknown)[:, :, mine]))
        plain.append((np.array([len(x)]), problem.whiten(block, part.residual)[:, :, None]))
        laws = [(elements, block.coefficients[which], law) for elements, which, law in twists.laws]
        return block.rows, Columns.of(by_twist @ twists.moved, plain, laws)

    out = np.zeros((len(x) + 1,) * 2)
    for _, part in joined(in_order(columns, problem.blocks)):
        found = np.zeros((len(part.order),) * 2)
        part.add_inner(slice(None), found)
        out[np.ix_(part.order, part.order)] += found
    known = np.column_stack([problem.prior, -problem.prior @ (x - problem.prior_centre)])
    return out + known.T @ known
