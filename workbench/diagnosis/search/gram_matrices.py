"""The rows of a problem compressed to inner products, from which all models of effects are evaluated.

Columns are, in this order: the observable directions of the geometry (orthonormal over all rows),
the coefficients of all candidates and the masses, centres and angles of gravity that act through each fitted
effect of load (scaled to unit length), and the residual without any effect, the masses as in the file; last,
in the history alone, what events may change.
Inner products are stored for every fold of the rows, for cross-validation: the cost of fitting, testing and
validating a model depends on its own size, not on the number of rows.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.effect import NO_WRENCHES
from workbench.arm.frame import revised
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.diagnosis.search.candidates import candidate_columns, carriers, known_wrenches
from workbench.identification.column_products import Columns, joined
from workbench.identification.problem import Problem
from workbench.identification.undetermined_combinations import factorise

GEOMETRY_SIGMA = 0.005
"""Prior standard deviation [rad, m] of the geometry about its fit, or about the nominal arm, when effects are
added: a new effect may otherwise move weakly observable constants far away."""
MIN_COLUMN_LENGTH = 1e-12
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
            gravity that act through it. They belong to the effect: without it, masses are unobservable.
        known: Prior standard deviations of these, scaled like the columns.
        reach: Prior standard deviation of each geometric unknown about its fit.
        maximum: Bound of every coefficient, scaled like the columns; unbounded by default.
        history: Inner products of U further columns, which events may change, with all columns and with each
            other, within each piece of time; None unless requested.
        validated: Cache of `evidence.without_each_fold` by model …
        lefts: … of what the last ones explain (`evidence.left_of`) …
        wholes: … and of the last one from which terms were removed (`evidence.left_without`).
    """

    names: tuple[str, ...]
    folds: Float[np.ndarray, "folds gc1 gc1"]
    scale: Float[np.ndarray, " c"]
    basis: Float[np.ndarray, "p g"]
    count: int
    inertia: Mapping[tuple[str, ...], tuple[str, ...]] = field(default_factory=dict)
    known: Mapping[str, float] = field(default_factory=dict)
    reach: Float[np.ndarray, " p"] | float = GEOMETRY_SIGMA
    maximum: Float[np.ndarray, " c"] | None = None
    history: Float[np.ndarray, "pieces u gc1u"] | None = None
    validated: dict[Any, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict, init=False)
    lefts: dict[Any, Float[np.ndarray, "gc1 _"]] = field(default_factory=dict, init=False)
    wholes: dict[Any, Any] = field(default_factory=dict, init=False)

    @property
    def geometry(self) -> int:
        """Number of geometric directions."""
        return self.basis.shape[1]

    @cached_property
    def total(self) -> Float[np.ndarray, "gc1 gc1"]:
        """Over all rows."""
        return self.folds.sum(0) if len(self.folds) > 1 else self.folds[0]

    @cached_property
    def index(self) -> dict[str, int]:
        """Column of every coefficient."""
        return {name: self.geometry + i for i, name in enumerate(self.names)}

    @cached_property
    def without_each(self) -> tuple["Grams", ...]:
        """Sums over all rows except those of each fold; empty for a single fold."""
        count, folds = self.count, len(self.folds)
        parts = (self.total - fold for fold in self.folds if folds > 1)
        return tuple(replace(self, folds=p[None], count=round((folds - 1) / folds * count)) for p in parts)

    def columns(self, names: Sequence[str]) -> np.ndarray:
        return np.array([self.index[n] for n in names], np.int64)

    def scales(self, names: Sequence[str]) -> np.ndarray:
        return self.scale[self.columns(names) - self.geometry]

    def bounds(self, columns: Int[np.ndarray, "*n k"]) -> Float[np.ndarray, "*n k"]:
        """Bounds of some scaled coefficients."""
        if self.maximum is None:
            return np.full(columns.shape, np.inf)
        return self.maximum[columns - self.geometry]


@dataclass(frozen=True, eq=False)
class Coefficients:
    """Coefficients in the order of their columns.

    Args:
        carriers: Effects that may be tried; their coefficients come first.
        loaded: Fitted effects of load, sized.
        inertia: By the names of each of these, the masses, centres and angles of gravity through it.
        values: Values in the fit by name: coefficients of its effects, and inertia relative to the file's
            [SI].
    """

    carriers: Sequence[AbstractEffect]
    loaded: Sequence[AbstractEffect]
    inertia: Mapping[tuple[str, ...], tuple[str, ...]]
    values: Mapping[str, float]

    @classmethod
    def of(
        cls,
        problem: Problem,
        x: Float[np.ndarray, " p"],
        effects: Sequence[AbstractEffect],
        *,
        masses: bool = True,
    ) -> "Coefficients":
        """At a problem's solution, with or without masses, centres and angles of gravity."""
        arm, named = problem.robot_at(x), list(zip(problem.parameters, x.tolist(), strict=True))
        offsets = {p.name: v - p.nominal for p, v in named if p.is_inertia}
        loaded = _loaded(problem, arm) if masses else []
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
        """Value of each in the fit; 0 if absent."""
        return np.array([self.values.get(n, 0.0) for n in self.names])


def compress(
    problem: Problem,
    x: Float[np.ndarray, " p"],
    effects: Sequence[AbstractEffect],
    fold: np.ndarray,
    *,
    changed: Sequence[AbstractEffect] = (),
    pieces: Int[np.ndarray, " rows"] | None = None,
    masses: bool = True,
) -> Grams:
    """Inner products at a problem's solution.

    Args:
        problem: Geometry, and the effects accepted so far.
        effects: All candidates, accepted effects included.
        fold: Fold of every row, counted from 0.
        changed: Effects whose columns form its history.
        pieces: Piece of time of every row, counted from 0.
        masses: Whether masses, centres and angles of gravity have columns; else they stay as in the solution.
    """
    coefficients = Coefficients.of(problem, x, effects, masses=masses)
    plain = np.array([p.is_plain for p in problem.parameters], bool)
    parts = [piece for _, piece in problem.pieces(x, only=plain)]
    residual, jacobian = (np.concatenate(part) for part in zip(*parts, strict=True))
    basis = factorise([(residual, jacobian)], np.ones(jacobian.shape[1])).root
    ahead = sum(len(e.names) for e in changed)  # columns of the history come before all others
    first, present = ahead + basis.shape[1], np.concatenate([np.zeros(ahead), coefficients.present])
    size, order = first + len(coefficients.names) + 1, np.zeros(0, np.int64)
    sums = np.zeros((int(fold.max()) + 1, size, size))
    history = np.zeros((0 if pieces is None else int(pieces.max()) + 1, ahead, size))

    def tables() -> Iterator[tuple[Int[np.ndarray, " rows"], Columns]]:
        """Columns of each block with those of the geometry and, last, the residual without any effect."""
        tried = [*changed, *coefficients.carriers]
        for block, columns in candidate_columns(problem, x, tried, loaded=coefficients.loaded):
            here, shape = slice(block.start, block.stop), (*columns.shown.shape[:2], -1)
            whole = residual[here].reshape(shape) + columns.times(present)[..., None]
            before, after = np.split(columns.plain, [ahead], axis=2)
            more = {
                "plain": np.concatenate([before, (jacobian[here] @ basis).reshape(shape), after], axis=2),
                "shown": np.concatenate([columns.shown, whole], axis=2),
                "laws": np.column_stack([columns.laws, np.ones(len(columns.laws))]),
                "element": np.append(columns.element, columns.shown.shape[2]),
            }
            yield block.rows, replace(columns, **more)

    for rows, columns in joined(tables()):
        order = columns.order[ahead:] - ahead
        for f in np.unique(fold[rows]):
            columns.add_inner(fold[rows] == f, sums[f])
        if pieces is not None:
            for piece in np.unique(pieces[rows]):
                some = columns.some(np.flatnonzero(pieces[rows] == piece))
                history[piece] += some[:, :ahead].T @ some
    length = np.sqrt(np.maximum(np.diagonal(sums, axis1=1, axis2=2).sum(0), 0.0))[first:-1]
    scale = np.where(length > MIN_COLUMN_LENGTH, length, 1.0)
    by = np.concatenate([np.ones(first), scale, [1.0]])
    sums /= by
    sums /= by[:, None]
    names, inertia = tuple(coefficients.names[k] for k in order), coefficients.inertia
    tolerances = [problem.inertia_tolerance[p.name] for p in problem.parameters if p.is_inertia]
    own = len(coefficients.of_effects)
    widths = np.concatenate([np.full(own, np.inf), np.tile(tolerances, len(inertia))])[order] * scale
    bounds = [*_bounds(problem, x, coefficients.carriers), *[np.inf] * (len(names) - own)]
    moved = np.array([abs(v - p.nominal) for p, v in zip(problem.parameters, x.tolist(), strict=True)])
    return Grams(
        names,
        sums[:, ahead:, ahead:],
        scale,
        basis,
        problem.count,
        inertia,
        dict(zip(names, widths.tolist(), strict=True)),
        np.maximum(GEOMETRY_SIGMA, moved[plain]),
        np.array(bounds)[order] * scale,
        None if pieces is None else np.roll(history / by, -ahead, axis=2),
    )


def _bounds(problem: Problem, x: np.ndarray, effects: Sequence[AbstractEffect]) -> list[float]:
    """Bound of every coefficient [SI]."""
    offered, motion, arm = {n for e in effects for n in e.names}, Motion.of(problem.data), problem.robot_at(x)
    others = (e for e in arm.effects if not offered & set(e.names))
    chain = revised(arm, effects=(*effects, *others)).chain
    wrenches = known_wrenches(arm, motion) if any(e.loads for e in effects) else NO_WRENCHES
    return [maximum for e in effects for maximum in e.bounds(chain, motion, wrenches)]


def _loaded(problem: Problem, arm: Robot) -> list[AbstractEffect]:
    """Effects through which masses are observable: every fitted effect of load, and each joint of it."""
    if not problem.inertia_tolerance:
        return []
    fitted = {p.name for p in problem.parameters if p.is_coefficient}
    loaded = (e for e in arm.effects if e.loads and len(e.components(arm.chain)))
    whole = [e for e in loaded if fitted.issuperset(e.names)]
    single = [
        replace(e, joints=(j,), coefficients=(c,))
        for e in whole
        if len(e.joints) == len(e.coefficients) > 1
        for j, c in zip(e.joints, e.coefficients, strict=True)
    ]
    return [*whole, *single]
