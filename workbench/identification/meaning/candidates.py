"""What joint columns may mean: families of joints = W q + o, each complete.

W holds signs, order and couplings of the columns in one matrix, o the zeros. A pendant's joint 3 that
counts from the horizontal is a coupling of parallel neighbours, a wrist differential one of the last two.
The zeros of the first and of the last joint belong to base and tool and are never candidates.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, pairwise, permutations, product

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm import chain as chains
from workbench.arm.joint_units import sliding
from workbench.arm.robot import Robot

SIGN, COUPLING, ORDER, ZERO, FREE_ZERO = 0.6, 1.0, 1.5, 0.8, 0.6
"""Complexity of an inverted joint, a coupling, an exchange, a zero off by quarter turns, one by any angle."""
PARALLEL = 0.995
"""Minimum cosine between the axes of parallel neighbours."""
QUARTER, GRID = np.pi / 2, np.pi / 6
"""Steps of zeros: of several joints at a time, and of one."""
TURN = 2.0 * np.pi


@dataclass(frozen=True, eq=False)
class ColumnReadings:
    """Readings of joint columns: joints = w q + zero.

    Args:
        w: Columns to joints.
        zero: Zeros [rad or m].
        cost: Complexity.
        refined: Whether zeros are refined from these.
    """

    w: Float[np.ndarray, "s n m"]
    zero: Float[np.ndarray, "s n"]
    cost: Float[np.ndarray, " s"]
    refined: bool = False

    def __len__(self) -> int:
        return len(self.cost)

    def of(self, q: Float[np.ndarray, "rows m"], some: slice = slice(None)) -> Float[np.ndarray, "s rows n"]:
        """Joint positions that some of them make of columns."""
        return np.einsum("snm,rm->srn", self.w[some], q, optimize=True) + self.zero[some, None]

    def moving(self, still: Bool[np.ndarray, " m"]) -> "ColumnReadings":
        """Without those that invert, couple or exchange joints that don't move in the rows."""
        if not still.any() or self.w.shape[1] != self.w.shape[2]:
            return self
        eye = np.eye(len(still))
        rows, columns = self.w[:, still] == eye[still], self.w[:, :, still] == eye[:, still]
        keep = rows.all((1, 2)) & columns.all((1, 2))
        return replace(self, w=self.w[keep], zero=self.zero[keep], cost=self.cost[keep])


def _flips(signs: Float[np.ndarray, "*s n"]) -> Float[np.ndarray, "*s"]:
    """Complexity of signs of joints."""
    count = (signs < 0.0).sum(-1)
    return SIGN * np.minimum(count, 1.0 + 0.5 * count)


@dataclass(frozen=True, eq=False)
class Families:
    """Families of one arm, for as many columns as it has joints, or more."""

    robot: Robot
    columns: int

    @cached_property
    def slides(self) -> Bool[np.ndarray, " n"]:
        return np.array(sliding(self.robot), bool)

    @cached_property
    def parallel(self) -> tuple[tuple[int, int], ...]:
        """Joints that turn, one after the other, about parallel axes, whatever follows or slides between."""
        chain, turning = self.robot.bare.chain, np.flatnonzero(~self.slides).tolist()
        axes = chains.twists(chain, np.zeros((1, self.robot.dof)), chain.driven)[1][0, 3:].T
        return tuple((a, b) for a, b in pairwise(turning) if abs(axes[a] @ axes[b]) > PARALLEL)

    @cached_property
    def _signs(self) -> tuple[Float[np.ndarray, "s n n"], Float[np.ndarray, " s"]]:
        """All signs, as diagonal matrices, with their complexity."""
        signs = np.array(list(product((1.0, -1.0), repeat=self.robot.dof)))
        return signs[:, :, None] * np.eye(self.robot.dof), _flips(signs)

    @cached_property
    def couplings(self) -> list[tuple[float, np.ndarray]]:
        """Complexity and matrix of each coupling."""
        n, found = self.robot.dof, list[tuple[float, np.ndarray]]()

        def add(cost: float, *entries: tuple[int, int, float]) -> None:
            matrix = np.eye(n)
            for row, column, value in entries:
                matrix[row, column] = value
            found.append((cost, matrix))

        for a, b in self.parallel:
            for one, other, sign in product((a, b), (a, b), (1.0, -1.0)):
                if one != other:
                    add(COUPLING, (one, other, sign))
        for (a, b), (again, c) in pairwise(self.parallel):
            if b == again:
                for s, t in product((1.0, -1.0), repeat=2):
                    add(1.5 * COUPLING, (b, a, s), (c, b, t))
                    add(1.5 * COUPLING, (b, a, s), (c, b, t), (c, a, s * t))
                    add(1.5 * COUPLING, (c, a, s), (c, b, t))
        if n > 4 and not self.slides[-3:].any():
            for k, j in ((n - 1, n - 2), (n - 2, n - 1), (n - 2, n - 3)):
                if (min(j, k), max(j, k)) not in self.parallel:
                    for ratio in (1.0, -1.0, 0.5, -0.5):
                        add(1.5 * COUPLING, (k, j, ratio))
            for i, share, turn in product((n - 2, n - 3), (0.5, 1.0), (1.0, -1.0)):
                both = [(i, i, share), (i, i + 1, share)]  # with all signs of the columns: all differentials
                add(2.0 * COUPLING, *both, (i + 1, i, turn * share), (i + 1, i + 1, -turn * share))
        return found

    @property
    def plain(self) -> ColumnReadings:
        """The columns as they stand; of more columns than joints each choice in their order."""
        chosen = [np.eye(self.columns)[list(c)] for c in combinations(range(self.columns), self.robot.dof)]
        cost = np.full(len(chosen), 0.0 if len(chosen) == 1 else ORDER)
        return ColumnReadings(np.array(chosen), np.zeros((len(chosen), self.robot.dof)), cost)

    @property
    def signs(self) -> ColumnReadings:
        """All signs, alone and with each coupling."""
        diagonal, flips = self._signs
        parts = [(0.0, np.eye(self.robot.dof)), *self.couplings]
        w = np.concatenate([coupling @ diagonal for _, coupling in parts])
        return ColumnReadings(w, np.zeros(w.shape[:2]), np.concatenate([cost + flips for cost, _ in parts]))

    def with_other_signs(self, w: np.ndarray, zero: np.ndarray, cost: float) -> ColumnReadings:
        """A reading of this complexity with all other signs of its joints."""
        diagonal, _ = self._signs
        own = np.sign(np.take_along_axis(w, np.abs(w).argmax(1)[:, None], 1))[:, 0]
        costs = cost - _flips(own) + _flips(own * np.diagonal(diagonal, axis1=1, axis2=2))
        return ColumnReadings(diagonal @ w, diagonal @ zero, costs)

    @property
    def orders(self) -> ColumnReadings:
        """Exchanges of two columns, shifts and the reversal with all signs; every other order without."""
        n, (diagonal, flips) = self.robot.dof, self._signs
        orders = [o for o in permutations(range(n)) if (self.slides[list(o)] == self.slides).all()]
        moved = np.array([sum(a != b for a, b in enumerate(o)) for o in orders])
        usual = [tuple(np.roll(range(n), 1)), tuple(np.roll(range(n), -1)), tuple(range(n))[::-1]]
        few = np.array([m == 2 or o in usual for m, o in zip(moved, orders, strict=True)])
        matrices = np.eye(n)[orders]
        signed = (diagonal[None] @ matrices[few][:, None]).reshape(-1, n, n)
        w = np.concatenate([signed, matrices[moved > 0]])
        cost = np.concatenate([np.tile(ORDER + flips, few.sum()), ORDER + 0.4 * (moved[moved > 0] - 2)])
        return ColumnReadings(w, np.zeros(w.shape[:2]), cost)

    @property
    def _inner(self) -> list[int]:
        """Joints whose zero is neither base nor tool."""
        return [k for k in range(1, self.robot.dof - 1) if not self.slides[k]]

    @property
    def _some_zeros(self) -> Float[np.ndarray, "s n"]:
        """One zero on a grid, or two by quarter turns."""
        one = [a * GRID * np.eye(self.robot.dof)[k] for k in self._inner for a in range(1, 12)]
        pairs = product(combinations(np.eye(self.robot.dof)[self._inner], 2), product((1, 2, 3), repeat=2))
        two = [QUARTER * (a * j + b * k) for (j, k), (a, b) in pairs]
        return np.array([*one, *two]).reshape(-1, self.robot.dof)

    def _with_zeros(self, w: np.ndarray, cost: np.ndarray, zeros: np.ndarray) -> ColumnReadings:
        """Each of some matrices with each of some zeros."""
        costs = np.tile(cost, len(zeros)) + ZERO * (np.repeat(zeros, len(w), axis=0) != 0.0).sum(1)
        w, zeros = np.tile(w, (len(zeros), 1, 1)), np.repeat(zeros, len(w), axis=0)
        return ColumnReadings(w, zeros, costs, refined=True)

    @property
    def exchanges(self) -> ColumnReadings:
        """Two columns exchanged, without signs."""
        n = self.robot.dof
        orders = [[{a: b, b: a}.get(k, k) for k in range(n)] for a, b in combinations(range(n), 2)]
        w = np.eye(n)[[o for o in orders if (self.slides[o] == self.slides).all()]].reshape(-1, n, n)
        return ColumnReadings(w, np.zeros(w.shape[:2]), np.full(len(w), ORDER))

    @property
    def zeros(self) -> ColumnReadings:
        """One or two zeros, without signs."""
        return self._with_zeros(np.eye(self.robot.dof)[None], np.zeros(1), self._some_zeros)

    @property
    def signed_zeros(self) -> ColumnReadings:
        """The same with all signs."""
        return self._with_zeros(*self._signs, np.vstack([np.zeros((1, self.robot.dof)), self._some_zeros]))

    @property
    def coupled_zeros(self) -> ColumnReadings:
        """One simple coupling with all signs and one quarter turn, of a joint or of its column."""
        (diagonal, flips), n = self._signs, self.robot.dof
        turns = np.reshape([QUARTER * a * np.eye(n)[k] for k in self._inner for a in (1, 2, 3)], (-1, n))
        simple = [c for cost, c in self.couplings if cost == COUPLING]
        some = [(c, zero) for c in simple for zero in np.unique([*turns, *turns @ c.T], axis=0)]
        w = np.reshape([c @ diagonal for c, _ in some], (-1, n, n))
        zeros = np.repeat(np.reshape([zero for _, zero in some], (-1, n)), len(diagonal), axis=0)
        return ColumnReadings(w, zeros, np.tile(COUPLING + ZERO + flips, len(some)), refined=True)

    @property
    def quarters(self) -> ColumnReadings:
        """Quarter turns of all inner joints, with all signs."""
        turns = np.zeros((4 ** len(self._inner), self.robot.dof))
        turns[:, self._inner] = QUARTER * np.array(list(product(range(4), repeat=len(self._inner))))
        return self._with_zeros(*self._signs, turns)
