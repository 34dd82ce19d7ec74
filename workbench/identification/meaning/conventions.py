"""What the orientation columns of a file may mean."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from jaxtyping import Float

from workbench.base import se3
from workbench.base.hand_eye import base_and_tool, base_and_tool_by_places
from workbench.data.dataset import Dataset
from workbench.data.orientations import ORIENTATIONS, USUAL_ORIENTATIONS, Orientation

INVERSE, MIXED, UNIT, USUAL, RARE = 1.0, 1.2, 0.5, 0.3, 0.8
"""Complexity of an inverse, of columns in another order, of a unit, of a usual and of a rare convention."""
Turns = Float[np.ndarray, "rows 3 3"]
DEGREE, TURN = np.pi / 180.0, 2.0 * np.pi
COMPARED, TRIED = 40, 16
"""Rows by which turns are compared, and conventions in which they agree of which places are."""
CLEAR, SMALL, ROUNDING = 2.5, np.deg2rad(5.0), 1e-6
"""How many times better and how well [rad] both agree in a convention that isn't the declared one."""


@dataclass(frozen=True, eq=False)
class Convention:
    """One way to read the orientation columns.

    Args:
        kind: What the numbers are; None: as declared.
        factor: Of the numbers, to rad.
        inverse: Whether the orientation is the inverse.
        order: Of the columns; empty as they stand.
        cost: Complexity.
    """

    kind: Orientation | None = None
    factor: float = 1.0
    inverse: bool = False
    order: tuple[int, ...] = ()
    cost: float = 0.0

    @property
    def text(self) -> str:
        """In words; empty as declared."""
        if self.kind is None:
            return "the orientation is that of the base in the tool (transposed)" if self.inverse else ""
        unit = "degrees, not rad" if self.factor < 1.0 else "rad, not degrees"
        return f"the orientation is {self.name}{'' if self.factor == 1.0 else f' in {unit}'}"

    @property
    def name(self) -> str:
        """What the numbers are."""
        order = f" of its columns {', '.join(str(k + 1) for k in self.order)}" if self.order else ""
        return f"{'the inverse of ' if self.inverse else ''}{self.kind.text if self.kind else ''}{order}"

    def rotations(self, data: Dataset) -> Float[np.ndarray, "rows 3 3"]:
        """Of the rows of a file."""
        assert data.rotation is not None
        found = data.rotation
        if self.kind is not None and data.written is not None:
            numbers = data.written.numbers
            found = self.kind.matrices(self.factor * (numbers[:, self.order] if self.order else numbers))
        return np.swapaxes(found, 1, 2) if self.inverse else found


def conventions(data: Dataset, *, usual: bool = False) -> Iterator[tuple[Convention, Turns]]:
    """All ways to read the orientation columns, with what they give, the declared one first; equal ones once.

    Args:
        usual: Whether only those that makers show are meant, neither inverse nor with columns exchanged.
    """
    if data.rotation is None:
        return
    seen: list[np.ndarray] = []
    for convention in sorted(_of_turns(data, usual), key=lambda c: c.cost):
        turns = convention.rotations(data)
        if np.isfinite(turns).all() and not any(np.abs(turns - other).max() < 1e-6 for other in seen):
            seen.append(turns)
            yield convention, turns


def _of_turns(data: Dataset, usual: bool) -> Iterator[Convention]:
    if (written := data.written) is None or written.name:
        yield Convention()
        yield from [] if usual else [Convention(inverse=True, cost=INVERSE)]
    if written is None:
        return
    count, largest = written.numbers.shape[1], np.nanmax(np.abs(written.numbers), initial=0.0)
    units = [(1.0, 0.0)]
    if count == 3 and largest < TURN * 1.02 * DEGREE:
        units.append((1.0 / DEGREE, UNIT))
    elif count == 3 and largest > TURN:
        units.append((DEGREE, UNIT))
    for factor, more in units:
        for kind in (k for k in (USUAL_ORIENTATIONS if usual else ORIENTATIONS) if k.numbers == count):
            rarity = USUAL if kind in USUAL_ORIENTATIONS else RARE
            cost = more + rarity * (kind.name != written.name)
            yield Convention(kind, factor, cost=cost)
            if usual:
                continue
            yield Convention(kind, factor, inverse=True, cost=cost + INVERSE)
            if kind.name == "wxyz":  # x, y, z, w are called so
                yield Convention(kind, factor, order=(1, 2, 3, 0), cost=cost + MIXED)
            if kind.name.islower() and len(set(kind.name)) == 3:
                for order in list(permutations(range(3)))[1:]:
                    yield Convention(kind, factor, order=order, cost=cost + MIXED)


def turning_alike(a: Dataset, b: Dataset) -> tuple[list[tuple[Turns, str]], float]:
    """Orientations of pairs A X B = Z in which both sides turn alike and places fit; what isn't declared;
    how far they turn apart [rad]; by medians: a target half a turn off, or another row's, takes no part."""
    few = [data.take(np.unique(np.linspace(0, len(a) - 1, COMPARED).astype(int))) for data in (a, b)]
    ways = [[(c, turns) for c, turns in conventions(data) if not c.inverse] for data in few]
    if len(a) < 2 or not all(ways):
        return [(np.asarray(data.rotation), "") for data in (a, b)], 0.0
    poses = [[se3.pose(t, np.asarray(d.position)) for _, t in own] for d, own in zip(few, ways, strict=True)]
    turned, others = (_between(np.array([t for _, t in own])) for own in ways)
    rows = np.array([np.median(np.abs(others - each), axis=2) for each in turned])
    off, cost = np.median(rows, axis=2), np.add.outer(*([c.cost for c, _ in own] for own in ways))
    good = np.argwhere(off < min(SMALL, CLEAR * off.min() + ROUNDING))
    tried = sorted(map(tuple, good.tolist()), key=cost.__getitem__)[:TRIED]
    misfit = [_misfit(*(p[k][rows[i] < SMALL] for p, k in zip(poses, i, strict=True))) for i in tried]
    least = CLEAR * min(misfit, default=0.0) + ROUNDING
    best = next((pair for pair, left in zip(tried, misfit, strict=True) if left < least), (0, 0))
    told = [own[k][0] for own, k in zip(ways, best, strict=True)]
    apart = f"as declared: read otherwise, the sides turn apart, too, by {np.rad2deg(off.min()):.2g}° at best"
    how = [f"{c.text}, as the pairs tell" if k else "" for c, k in zip(told, best, strict=True)]
    read = [(c.rotations(d), h if tried else apart) for c, d, h in zip(told, (a, b), how, strict=True)]
    return read, float(off.min())


def _between(turns: Float[np.ndarray, "ways rows 3 3"]) -> Float[np.ndarray, "ways rows others"]:
    """Angles by which each row is turned from the others [rad]."""
    cosine = (np.einsum("wiab,wjab->wij", turns, turns) - 1.0) / 2.0
    others = cosine[:, ~np.eye(turns.shape[1], dtype=bool)].reshape(*turns.shape[:2], -1)
    return np.arccos(np.clip(others, -1.0, 1.0))


def _misfit(a: Float[np.ndarray, "rows 4 4"], b: Float[np.ndarray, "rows 4 4"]) -> float:
    """Root mean square distance [m] that is left in closed form, of the poses or of their inverses."""
    ways = product((a, se3.inverse(a)), (base_and_tool, base_and_tool_by_places))
    fits = ((moved, *fit(moved, b)) for moved, fit in ways)
    return min(float(np.sqrt(((x @ m @ z - b)[:, :3, 3] ** 2).sum(1).mean())) for m, x, z in fits)
