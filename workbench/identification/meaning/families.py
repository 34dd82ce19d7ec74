"""What joint columns may mean: families of joints = W q + o, each complete, in one ordered table.

W holds signs, order and couplings of the columns in one matrix, o the zeros. A pendant's joint 3 that
counts from the horizontal is a coupling of parallel neighbours, a wrist differential one of the last two.
The zeros of the first and of the last joint belong to base and tool and are never candidates.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from enum import Flag
from functools import cached_property
from itertools import combinations, pairwise, permutations, product
from math import factorial
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm import chain as chains
from workbench.arm.built_in_arms import load_robot
from workbench.arm.joint_units import sliding
from workbench.arm.robot import Robot
from workbench.base.assets import built_in_robots

SIGN, COUPLING, ORDER, ZERO, FREE_ZERO = 0.6, 1.0, 1.5, 0.8, 0.6
"""Complexity of an inverted joint, a coupling, an exchange, a zero off by quarter turns, one by any angle."""
PARALLEL = 0.995
"""Minimum cosine between the axes of parallel neighbours."""
QUARTER, GRID = np.pi / 2, np.pi / 6
"""Steps of zeros: of several joints at a time, and of one."""
SPARE = 3
"""Maximum number of columns that are no joints of the arm."""
SLACK = 0.05
"""Tolerance on the joint limits [rad or m]."""
MOST = 2**17
"""Maximum number of hypotheses that are tried together: of more, as of nine joints, none is, or the usual."""
Cost = Float[np.ndarray, " s"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Hypotheses:
    """Readings of the joint columns of one arm: joints = w q + zero.

    Args:
        robot: The arm, without effects, base and tool.
        other: Name by which it is loaded where it isn't the one that is said to have moved.
        w: Columns to joints.
        zero: Zeros [rad or m].
        cost: Complexity.
        refined: What is refined from these: "zeros", or the "ratio" by which a joint follows a column.
    """

    robot: Robot
    other: str = ""
    w: Float[np.ndarray, "s n m"]
    zero: Float[np.ndarray, "s n"]
    cost: Cost
    refined: str = ""

    def __getitem__(self, some: slice | np.ndarray) -> "Hypotheses":
        return replace(self, w=self.w[some], zero=self.zero[some], cost=self.cost[some])

    def of(self, q: Float[np.ndarray, "rows m"]) -> Float[np.ndarray, "s rows n"]:
        """Joint positions that they make of columns."""
        return np.einsum("snm,rm->srn", self.w, q, optimize=True) + self.zero[:, None]

    def moving(self, still: Bool[np.ndarray, " m"]) -> "Hypotheses":
        """Without those that invert, couple or exchange joints that don't move in the rows."""
        if not still.any() or self.w.shape[1] != self.w.shape[2]:
            return self
        eye = np.eye(len(still))
        rows, columns = self.w[:, still] == eye[still], self.w[:, :, still] == eye[:, still]
        return self[rows.all((1, 2)) & columns.all((1, 2))]


@dataclass(frozen=True, eq=False)
class JointColumns:
    """What columns may mean for one arm, as many as it has joints, or more."""

    robot: Robot
    q: Float[np.ndarray, "rows m"]

    @property
    def eye(self) -> Float[np.ndarray, "n n"]:
        return np.eye(self.robot.dof)

    @cached_property
    def slides(self) -> Bool[np.ndarray, " n"]:
        return np.array(sliding(self.robot), bool)

    @cached_property
    def signs(self) -> Float[np.ndarray, "s n"]:
        return np.array(list(product((1.0, -1.0), repeat=self.robot.dof)))

    @cached_property
    def parallel(self) -> tuple[tuple[int, int], ...]:
        """Joints that turn, one after the other, about parallel axes, whatever follows or slides between."""
        chain, turning = self.robot.bare.chain, np.flatnonzero(~self.slides).tolist()
        axes = chains.twists(chain, np.zeros((1, self.robot.dof)), chain.driven)[1][0, 3:].T
        return tuple((a, b) for a, b in pairwise(turning) if abs(axes[a] @ axes[b]) > PARALLEL)

    @cached_property
    def couplings(self) -> tuple[Float[np.ndarray, "s n n"], Cost]:
        """None first, then each coupling, with its complexity."""
        n, both = self.robot.dof, (1.0, -1.0)
        found: list[tuple[float, list[tuple[int, int, float]]]] = [(0.0, [])]
        for pair in self.parallel:
            found += [(COUPLING, [(*way, sign)]) for way, sign in product((pair, pair[::-1]), both)]
        for (a, b), (again, c) in pairwise(self.parallel):
            for s, t in product(both, repeat=2) if b == again else ():
                one, other, third = (b, a, s), (c, b, t), (c, a, s * t)
                three = ([one, other], [one, other, third], [(c, a, s), other])
                found += [(1.5 * COUPLING, entries) for entries in three]
        if n > 4 and not self.slides[-3:].any():
            pairs = [(n - 1, n - 2), (n - 2, n - 1), (n - 2, n - 3)]
            lone = [pair for pair in pairs if (min(pair), max(pair)) not in self.parallel]
            found += [(1.5 * COUPLING, [(*p, ratio)]) for p, ratio in product(lone, (1.0, -1.0, 0.5, -0.5))]
            for s, t in product(both, repeat=2):  # a wrist whose joints are driven through each other
                one, other, third = (n - 1, n - 2, s), (n - 2, n - 3, t), (n - 1, n - 3, s * t)
                found += [(2.0 * COUPLING, [one, other]), (2.0 * COUPLING, [one, other, third])]
            for i, share, turn in product((n - 2, n - 3), (0.5, 1.0), both):
                turned = [(i + 1, i, turn * share), (i + 1, i + 1, -turn * share)]  # with all signs: all
                found.append((2.0 * COUPLING, [(i, i, share), (i, i + 1, share), *turned]))  # differentials
        w = np.tile(self.eye, (len(found), 1, 1))
        for matrix, (_, entries) in zip(w, found, strict=True):
            for row, column, value in entries:
                matrix[row, column] = value
        return w, np.array([cost for cost, _ in found])

    @cached_property
    def orders(self) -> tuple[Float[np.ndarray, "s n n"], Int[np.ndarray, " s"]]:
        """Other orders of the columns, with how many are moved; what slides stays among its like."""
        n = self.robot.dof
        few = ([{a: b, b: a}.get(k, k) for k in range(n)] for a, b in ((0, 0), *combinations(range(n), 2)))
        every = permutations(range(n)) if factorial(n) <= MOST else few
        orders = np.array([o for o in every if (self.slides[list(o)] == self.slides).all()])
        moved = (orders != orders[0]).sum(1)
        return self.eye[orders[1:]], moved[1:]

    @property
    def inner(self) -> list[int]:
        """Joints whose zero is neither base nor tool."""
        return [k for k in range(1, self.robot.dof - 1) if not self.slides[k]]

    def every(
        self, w: np.ndarray, costs: Cost | float = 0.0, *, zeros: np.ndarray | None = None, signs: bool = True
    ) -> Hypotheses:
        """Each of some matrices, with all signs of the columns, and with each of some zeros."""
        cost = np.broadcast_to(costs, w.shape[:-2]).ravel()
        if len(cost) * (len(self.signs) if signs else 1) * (1 if zeros is None else len(zeros)) > MOST:
            w, cost = self.eye[None][:0], cost[:0]
        if signs:
            w = w[..., None, :, :] * self.signs[:, None]
            cost = np.add.outer(cost, flips(self.signs)).ravel()
        w, zero = w.reshape(-1, *w.shape[-2:]), np.zeros((1, self.robot.dof)) if zeros is None else zeros
        return Hypotheses(
            robot=self.robot,
            w=np.tile(w, (len(zero), 1, 1)),
            zero=np.repeat(zero, len(w), axis=0),
            cost=np.add.outer(ZERO * (zero != 0.0).sum(1), cost).ravel(),
            refined="" if zeros is None else "zeros",
        )

    @property
    def choices(self) -> Iterator[Hypotheses]:
        """Of more columns than joints each choice in their order."""
        eye, n = np.eye(self.q.shape[1]), self.robot.dof
        if n < len(eye) <= n + SPARE:
            chosen = [eye[list(columns)] for columns in combinations(range(len(eye)), n)]
            yield self.every(np.array(chosen), ORDER, signs=False)

    def with_other_signs(self, w: np.ndarray, zero: np.ndarray, cost: float) -> Hypotheses:
        """A reading of this complexity with all other signs of its joints."""
        own = np.sign(np.take_along_axis(w, np.abs(w).argmax(1)[:, None], 1))[:, 0]
        costs = cost - flips(own[None]) + flips(own * self.signs)
        return Hypotheses(robot=self.robot, w=self.signs[:, :, None] * w, zero=self.signs * zero, cost=costs)

    @property
    def following(self) -> Iterator[Hypotheses]:
        """One joint follows another's column, by ratios on a grid, of a slide in shares of the reach."""
        n, grid = self.robot.dof, np.geomspace(2e-3, 2.0, 20)
        size = np.where(self.slides, self.robot.reach, 1.0)[:, None] / (self.q.std(0) + 1e-9)
        ways = [size * np.outer(self.eye[i], self.eye[j]) for i, j in permutations(range(n), 2)]
        w = self.eye + np.multiply.outer([*grid, *-grid], np.reshape(ways, (-1, n, n)))
        yield replace(self.every(w, 2.0 * COUPLING, signs=False), refined="ratio")

    @property
    def exchanged(self) -> Iterator[Hypotheses]:
        """Two columns exchanged, without signs."""
        orders, moved = self.orders
        yield self.every(orders[moved == 2], ORDER, signs=False)

    @property
    def ordered(self) -> Iterator[Hypotheses]:
        """Exchanges of two columns, shifts and the reversal with all signs; every other order without."""
        orders, moved = self.orders
        usual = np.array([np.roll(self.eye, 1, 0), np.roll(self.eye, -1, 0), self.eye[::-1]])
        few = (moved == 2) | (orders[:, None] == usual).all((2, 3)).any(1)
        yield self.every(orders[few], ORDER)
        yield self.every(orders, ORDER + 0.4 * (moved - 2), signs=False)

    def zeros(self, *, signs: bool) -> Iterator[Hypotheses]:
        """One zero on a grid, or two by quarter turns; with all signs also none."""
        one = [a * GRID * self.eye[k] for k in self.inner for a in range(1, 12)]
        pairs = product(combinations(self.eye[self.inner], 2), product((1, 2, 3), repeat=2))
        two = [QUARTER * (a * j + b * k) for (j, k), (a, b) in pairs]
        none = [0.0 * self.eye[0]] * signs
        zeros = np.reshape([*none, *one, *two], (-1, self.robot.dof))
        yield self.every(self.eye, zeros=zeros, signs=signs)

    @property
    def coupled_zeros(self) -> Iterator[Hypotheses]:
        """One simple coupling with all signs and one quarter turn, of a joint or of its column."""
        turns = QUARTER * np.arange(1, 4)[:, None, None] * self.eye[self.inner]
        turns = turns.reshape(-1, self.robot.dof)
        w, cost = self.couplings
        for matrix in w[cost == COUPLING]:
            found = self.every(matrix, COUPLING, zeros=np.unique([*turns, *turns @ matrix.T], axis=0))
            yield replace(found, cost=found.cost - ZERO * ((found.zero != 0.0).sum(1) - 1.0))

    @property
    def quarters(self) -> Iterator[Hypotheses]:
        """Quarter turns of all inner joints, with all signs."""
        if 4 ** len(self.inner) <= MOST:
            turns = np.zeros((4 ** len(self.inner), self.robot.dof))
            turns[:, self.inner] = QUARTER * np.array(list(product(range(4), repeat=len(self.inner))))
            yield self.every(self.eye, zeros=turns)

    @property
    def of_other_arms(self) -> Iterator[Hypotheses]:
        """Built-in arms, read plainly; of those that differ in limits alone, within which more rows lie."""
        for name in built_in_robots():
            arm = load_robot(name)
            if arm.dof == self.q.shape[1] and arm.name.split(",")[0] != self.robot.name.split(",")[0]:
                low, high = arm.limits.T
                outside = ((self.q < low - SLACK) | (self.q > high + SLACK)).any(1).mean()
                own = JointColumns(arm.bare, self.q)
                yield replace(own.every(own.eye, outside, signs=False), other=name)


def flips(signs: Float[np.ndarray, "s n"]) -> Cost:
    """Complexity of signs of joints."""
    count = (signs < 0.0).sum(-1)
    return SIGN * np.minimum(count, 1.0 + 0.5 * count)


class Rows(Flag):
    """Kinds of rows: of the arm; such that nearly fit it as given; of an arm that is known to be this one; of
    sessions with few each; of a flange in the arm's base; with more columns than joints, or fewer."""

    OWN, NEAR, KNOWN, SESSIONS, HELD, COLUMNS = (1 << k for k in range(6))


class Family(NamedTuple):
    """Hypotheses that are tried together.

    Args:
        name: In what was tried.
        rows: Those of which it is tried.
        of: Hypotheses of an arm's columns; those of one arm compete.
        inverse: Whether poses may be inverse, too.
        is_asked: Whether it is left out where what was found before is clear enough.
    """

    name: str
    rows: Rows
    of: Callable[[JointColumns], Iterable[Hypotheses]]
    inverse: bool = False
    is_asked: bool = True


_ANY = Rows.OWN | Rows.NEAR
FOLLOWING = Family("joints that follow", Rows.NEAR, lambda c: c.following, is_asked=False)
OTHER_ARMS = Family("other arms", _ANY | Rows.SESSIONS | Rows.COLUMNS, lambda c: c.of_other_arms)
FAMILIES = (
    Family("choices of columns", Rows.COLUMNS, lambda c: c.choices, inverse=True),
    Family("signs and couplings", ~Rows.COLUMNS, lambda c: [c.every(*c.couplings)], inverse=True),
    Family("exchanges", Rows.NEAR | Rows.KNOWN, lambda c: c.exchanged, inverse=True, is_asked=False),
    Family("zeros", Rows.NEAR | Rows.KNOWN, lambda c: c.zeros(signs=False), is_asked=False),
    FOLLOWING,
    OTHER_ARMS,
    Family("orders", _ANY | Rows.SESSIONS, lambda c: c.ordered, inverse=True),
    Family("zeros with signs", _ANY | Rows.KNOWN | Rows.HELD, lambda c: c.zeros(signs=True)),
    Family("couplings with zeros", _ANY | Rows.HELD, lambda c: c.coupled_zeros),
    Family("quarter turns with signs", _ANY | Rows.HELD, lambda c: c.quarters),
    FOLLOWING._replace(rows=Rows.OWN),
)
"""All in their order, each complete before anything is said."""
