"""The rows of a problem compressed to inner products, from which every model of effects is judged.

Columns are, in this order: the directions of the geometry that the rows show (orthonormal over all rows),
the coefficients of all candidates (scaled to unit length), the masses, centres and angles of gravity that act
through each fitted effect of load, and the residual without any effect, the masses as in the file.
Inner products are kept for every fold of the rows, so that models can be cross-validated too: fitting,
testing and validating a model is linear algebra of its own size, whatever the number of rows.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.law import NO_WRENCHES
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.diagnosis.candidate_columns import candidate_columns, carriers, known_wrenches
from workbench.identification.columns import Columns, joined
from workbench.identification.problem import Problem
from workbench.identification.undetermined_combinations import factorise

TETHER = 0.005
"""How far [rad, m] a model of effects may be expected to move the geometry from where it was fitted, or else
back to the nominal arm: what rows hardly show, an effect that was not there yet takes far away."""
SHORTEST = 1e-12
"""Columns shorter than this [whitened residual per unit] are zero."""


@dataclass(frozen=True, eq=False)
class Grams:
    """Inner products of columns.

    Args:
        names: Names of the coefficients, C of them, those of masses among them.
        folds: Inner products within each fold; G geometric directions.
        scale: Length of every coefficient's column: scaled coefficients are SI ones times this.
        basis: The geometric directions in the unknowns that are no coefficients [rad, m].
        count: Number of measured components.
        inertia: By the coefficients of a fitted effect of load, columns of the masses, centres and angles of
            gravity that act through it. They go with the effect: without it, no mass is seen.
        known: Standard deviations of these, scaled as the columns are.
        reach: How far a model may be expected to move each of the unknowns that are no coefficients.
        maximum: Largest credible size of every coefficient, scaled as the columns are; any by default.
        history: Inner products of U further columns, which events may change, with all columns and among
            themselves, within each piece of the time; None where nobody asked.
    """

    names: tuple[str, ...]
    folds: Float[np.ndarray, "folds gc1 gc1"]
    scale: Float[np.ndarray, " c"]
    basis: Float[np.ndarray, "p g"]
    count: int
    inertia: Mapping[tuple[str, ...], tuple[str, ...]] = field(default_factory=dict)
    known: Mapping[str, float] = field(default_factory=dict)
    reach: Float[np.ndarray, " p"] | float = TETHER
    maximum: Float[np.ndarray, " c"] | None = None
    history: Float[np.ndarray, "pieces u gc1u"] | None = None

    @cached_property
    def tether(self) -> Float[np.ndarray, "g g"]:
        """Precision that keeps geometry near the fit where effects leave it open."""
        held = self.basis.T / self.reach
        return held @ held.T

    @property
    def geometry(self) -> int:
        """Number of geometric directions."""
        return self.basis.shape[1]

    @cached_property
    def total(self) -> Float[np.ndarray, "gc1 gc1"]:
        """Over all rows."""
        return self.folds.sum(0)

    @cached_property
    def running(self) -> Float[np.ndarray, "pieces u gc1u"]:
        """The history's sums from the first piece up to each."""
        assert self.history is not None, "the history was asked for"
        return self.history.cumsum(0)

    @cached_property
    def index(self) -> dict[str, int]:
        """Column of every coefficient."""
        return {name: self.geometry + i for i, name in enumerate(self.names)}

    @cached_property
    def validated(self) -> dict[tuple[Any, ...], Float[np.ndarray, " folds"]]:
        """What `evidence.validated` found of models."""
        return {}

    @cached_property
    def lefts(self) -> dict[tuple[Any, ...], Float[np.ndarray, "gc1 gc1"]]:
        """Inner products that the last models leave (`one_less.left_of`)."""
        return {}

    @cached_property
    def wholes(self) -> dict[tuple[Any, ...], Any]:
        """The last model of which terms were taken away (`one_less.left_without`)."""
        return {}

    @cached_property
    def without_each(self) -> tuple["Grams", ...]:
        """Of all rows but those of each fold; none of a single fold."""
        count, folds = self.count, len(self.folds)
        parts = (self.total - fold for fold in self.folds if folds > 1)
        return tuple(replace(self, folds=p[None], count=round((folds - 1) / folds * count)) for p in parts)

    def columns(self, names: Sequence[str]) -> np.ndarray:
        return np.array([self.index[n] for n in names], np.int64)

    def scales(self, names: Sequence[str]) -> np.ndarray:
        return self.scale[self.columns(names) - self.geometry]

    def bounds(self, names: Sequence[str]) -> np.ndarray:
        """Largest credible sizes of some scaled coefficients."""
        if self.maximum is None:
            return np.full(len(names), np.inf)
        return self.maximum[self.columns(names) - self.geometry]


@dataclass(frozen=True, eq=False)
class Coefficients:
    """Coefficients in the order of their columns.

    Args:
        carriers: Effects that may be tried; their coefficients come first.
        loaded: Fitted effects of load, sized.
        inertia: By the names of each of these, the masses, centres and angles of gravity through it.
        values: What the fit holds, by name: those of its effects, and inertia beside the file's [SI].
    """

    carriers: Sequence[AbstractEffect]
    loaded: Sequence[AbstractEffect]
    inertia: Mapping[tuple[str, ...], tuple[str, ...]]
    values: Mapping[str, float]

    @classmethod
    def of(
        cls, problem: Problem, x: Float[np.ndarray, " p"], effects: Sequence[AbstractEffect]
    ) -> "Coefficients":
        """At a problem's answer."""
        arm, named = problem.robot_at(x), list(zip(problem.parameters, x.tolist(), strict=True))
        offsets = {p.name: v - p.nominal for p, v in named if p.is_inertia}
        loaded = _loaded(problem, arm)
        inertia = {e.names: tuple(f"{n} by {' '.join(e.names)}" for n in offsets) for e in loaded}
        values = {p.name: v for p, v in named if p.is_coefficient}
        for each in (e.names for e in loaded if e in arm.effects):
            values |= zip(inertia[each], offsets.values(), strict=True)
        return cls(carriers(effects), loaded, inertia, values)

    @cached_property
    def of_effects(self) -> tuple[str, ...]:
        return tuple(name for e in self.carriers for name in e.names)

    @cached_property
    def names(self) -> tuple[str, ...]:
        return (*self.of_effects, *(n for each in self.inertia.values() for n in each))

    @property
    def present(self) -> Float[np.ndarray, " c"]:
        """What the fit holds of each; 0 of what it lacks."""
        return np.array([self.values.get(n, 0.0) for n in self.names])


def compress(
    problem: Problem,
    x: Float[np.ndarray, " p"],
    effects: Sequence[AbstractEffect],
    fold: np.ndarray,
    *,
    changed: Sequence[AbstractEffect] = (),
    pieces: Int[np.ndarray, " rows"] | None = None,
) -> Grams:
    """Inner products at a problem's answer.

    Args:
        problem: Geometry, and the effects that were accepted so far.
        x: Its answer.
        effects: All that may be tried, those that were accepted included.
        fold: Fold of every row, counted from 0.
        changed: Effects whose columns make its history.
        pieces: Piece of the time that every row belongs to, counted from 0.
    """
    coefficients = Coefficients.of(problem, x, effects)
    names, own = coefficients.names, len(coefficients.of_effects)
    plain = np.array([p.is_plain for p in problem.parameters], bool)
    parts = [piece for block, piece in problem.pieces(x, only=plain) if block is not None]
    residual, jacobian = (np.concatenate(part) for part in zip(*parts, strict=True))
    basis = factorise(jacobian, residual).root
    size = basis.shape[1] + len(names) + 1
    extra = sum(len(e.names) for e in changed)
    present = np.insert(coefficients.present, own, np.zeros(extra))
    sums = np.zeros((int(fold.max()) + 1, size + extra, size + extra))
    history = np.zeros((0 if pieces is None else int(pieces.max()) + 1, extra, size + extra))
    ahead = basis.shape[1]
    place = np.concatenate(
        [ahead + np.arange(own), size + np.arange(extra), np.arange(ahead + own, size - 1)]
    )
    order = place[:0]

    def tables() -> Iterator[tuple[Int[np.ndarray, " rows"], Columns]]:
        """Columns of each block with those of the geometry and the residual without any effect."""
        for block, columns in candidate_columns(
            problem, x, [*coefficients.carriers, *changed], loaded=coefficients.loaded
        ):
            here, shape = slice(block.start, block.stop), (*columns.shown.shape[:2], -1)
            whole = residual[here].reshape(shape) + columns.times(present)[..., None]
            beside = [columns.plain, (jacobian[here] @ basis).reshape(shape), whole]
            yield block.rows, replace(columns, plain=np.concatenate(beside, axis=2))

    for rows, columns in joined(tables()):
        alone, products = np.split(place[columns.order], [len(columns.order) - columns.laws.shape[1]])
        order = np.concatenate([alone, np.arange(ahead), [size - 1], products])
        for f in np.unique(fold[rows]):
            columns.add_inner(fold[rows] == f, sums[f])
        if pieces is not None:
            for piece, mine in _together(pieces[rows]):
                history[piece] += columns.products(mine, np.flatnonzero(alone >= size))
    given = np.argsort(order)
    history, sums = history[:, :, given], sums[:, given[:size, None], given[:size]]
    length = np.sqrt(np.maximum(np.diagonal(sums.sum(0)), 0.0))[ahead:-1]
    scale = np.where(length > SHORTEST, length, 1.0)
    by = np.concatenate([np.ones(ahead), scale, np.ones(1 + extra)])
    sums /= np.outer(by[:size], by[:size])
    history /= by
    inertia = coefficients.inertia
    tolerances = [problem.inertia_tolerance[p.name] for p in problem.parameters if p.is_inertia]
    widths = np.tile(tolerances, len(inertia)) * scale[own:]
    known = dict(zip(names[own:], widths.tolist(), strict=True))
    moved = np.array([abs(v - p.nominal) for p, v in zip(problem.parameters, x.tolist(), strict=True)])
    return Grams(
        names,
        sums,
        scale,
        basis,
        problem.count,
        inertia,
        known,
        np.maximum(TETHER, moved[plain]),
        np.array([*_bounds(problem, x, coefficients.carriers), *[np.inf] * (len(names) - own)]) * scale,
        None if pieces is None else history,
    )


def among(inner: Float[np.ndarray, "gc1 gc1"], used: Int[np.ndarray, " n"]) -> Float[np.ndarray, "n n"]:
    """Inner products of some columns among themselves."""
    return inner.take(used, 0).take(used, 1)


def _together(labels: Int[np.ndarray, " m"]) -> Iterator[tuple[int, Int[np.ndarray, " k"]]]:
    order = np.argsort(labels, kind="stable")
    starts = np.flatnonzero(np.diff(labels[order], prepend=-1))
    for mine in np.split(order, starts[1:]):
        yield int(labels[mine[0]]), mine


def _bounds(problem: Problem, x: np.ndarray, effects: Sequence[AbstractEffect]) -> list[float]:
    """Largest credible size of every coefficient [SI]."""
    offered, motion, arm = {n for e in effects for n in e.names}, Motion.of(problem.data), problem.robot_at(x)
    chain = arm.with_effects(*effects, *(e for e in arm.effects if not offered & set(e.names))).chain
    wrenches = known_wrenches(arm, motion) if any(e.loads for e in effects) else NO_WRENCHES
    return [maximum for e in effects for maximum in e.bounds(chain, motion, wrenches)]


def _loaded(problem: Problem, arm: Robot) -> list[AbstractEffect]:
    """Effects through which masses are seen: every fitted effect of load, and each of its joints alone."""
    if not problem.inertia_tolerance:
        return []
    fitted = {p.name for p in problem.parameters if p.is_coefficient}
    whole = [
        e for e in arm.effects if e.loads and fitted.issuperset(e.names) and len(e.components(arm.chain))
    ]
    single = [
        replace(e, joints=(j,), coefficients=(c,))
        for e in whole
        if len(e.joints) == len(e.coefficients) > 1
        for j, c in zip(e.joints, e.coefficients, strict=True)
    ]
    return [*whole, *single]
