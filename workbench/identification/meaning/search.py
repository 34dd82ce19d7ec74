"""One search over what rows mean: B_i = X A(W q_i + o) Z with base X and tool Z free.

Families of hypotheses come in a fixed order, each complete before anything is said. Closed-form bounds rank
all hypotheses of a family; the best are placed. The plain reading stands unless another is clearly better,
and no changed reading is claimed from rows that hardly move the arm.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from itertools import groupby, islice, product
from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.arm import chain as chains
from workbench.arm.inverse.reduced_arm import ONTO_Z
from workbench.arm.joint_units import sliding
from workbench.arm.robot import Robot
from workbench.base.hand_eye import nearest_rotation
from workbench.data.dataset import Dataset
from workbench.identification.meaning.bounds import (
    WEIGHT,
    affine_map,
    flange_poses,
    grams,
    held_bounds,
    nearest_turn,
    point_bounds,
    turn_bounds,
)
from workbench.identification.meaning.conventions import Convention, conventions
from workbench.identification.meaning.families import (
    FREE_ZERO,
    QUARTER,
    ZERO,
    Family,
    Hypotheses,
    JointColumns,
)
from workbench.identification.meaning.placement import PlacedReadings, place
from workbench.identification.meaning.reading import (
    FITS,
    FITS_TURN,
    FOREIGN_MISFIT,
    GOOD,
    LEFT_HANDED,
    LENGTHS,
    NARROW,
    RowReading,
    units,
)
from workbench.identification.meaning.usable_rows import PLACED_ROWS, far_apart

FAST = 0.004
"""Share of the reach below which points read as given need no search; with orientations most of `FITS`."""
SURE, HELD_SURE = 0.7 * FITS, 0.003
"""Score below which a search ends, and where base and tool are held."""
CLEAR = 2.5
"""Ratio of misfits above which a reading is certain."""
EXACT, ROUNDED = 1e-5, 2e-4
"""Scores that count as none: of rows that were measured, and of a few typed numbers."""
BOUND_ROWS, CHUNK = 16, 4096
"""Rows of the bounds; candidates at a time."""
PLACED, HELD_PLACED, LIKELY = 10, 60, 3
"""Readings of a family that are placed, those whose zeros are searched for where base and tool are held, and
conventions that are tried with each."""
SNAP, SNAP_LENGTH, SNAP_RATIO = float(np.radians(4.0)), 0.01, 0.01
"""Zeros nearer to a quarter turn are one; those of sliding joints within a share of the reach are none;
ratios nearer to a half are one."""
FEW_POINTS = 20
"""Points without orientations below which partly right readings fit, too."""
STILL = float(np.radians(0.5))
"""Columns that move less don't move."""
UNIT, HANDED, MIRRORED, INVERSE = 1.0, 1.4, 1.9, 1.5
"""Complexity of a unit, a handedness, also of poses, which no instrument mirrors, and of inverse poses."""


class ReadingSearch:
    """Readings of some rows of one session, which are placed once they are likely.

    Args:
        robots: The arm that is said to have moved, or what it may be.
        data: Rows with points, and orientations or none.
        held: Whether rows are of the flange in the arm's base.
        sessions: Number of sessions, each with its own base and tool, that have equally many rows.
        count: Maximum number of rows of a single session that are looked at.
    """

    def __init__(
        self, *robots: Robot, data: Dataset, held: bool = False, sessions: int = 1, count: int = PLACED_ROWS
    ):
        self.robot, self.held, self.sessions = robots[0].bare, held, sessions
        self.floor, self.sure = (ROUNDED, HELD_SURE) if held else (EXACT, GOOD)
        self.data = data if sessions > 1 else data.take(far_apart(data, count))
        self.points = np.asarray(self.data.position)
        self.arms = [JointColumns(robot.bare, self.data.q) for robot in robots]
        self.handed = HANDED if data.rotation is None else MIRRORED
        self.found: list[RowReading] = []
        self.tried: dict[str, int] = {}

    @cached_property
    def few(self) -> np.ndarray:
        """Rows of the bounds."""
        return far_apart(self.data, BOUND_ROWS if self.sessions == 1 else PLACED_ROWS)

    @cached_property
    def conventions(self) -> dict[Convention, np.ndarray]:
        """All conventions of the orientation columns, and what they give."""
        return dict(conventions(self.data, usual=self.held))

    @cached_property
    def turns(self) -> Float[np.ndarray, "c k"] | None:
        """Gram matrices of the conventions; None without orientations."""
        given = [rotations[self.few] for rotations in self.conventions.values()]
        return grams(np.array(given), self.sessions) if given else None

    @cached_property
    def still(self) -> np.ndarray:
        """Columns that don't move, in any unit."""
        factor = max(factor for factor, _ in self.units)
        return np.ptp(self.data.q * units(self.robot, self.data.joints, factor), axis=0) < STILL

    @cached_property
    def units(self) -> list[tuple[float, float]]:
        """Factors of the joint columns that are possible, and their complexity."""
        turns = units(self.robot, self.data.joints, 0.0) == 0.0
        largest, degree = np.abs(self.data.q[:, turns]).max(initial=0.0), np.pi / 180.0
        if self.data.missing_units:
            return [(1.0, 0.0), (degree, UNIT), (1.0 / degree, UNIT)]
        if largest > 4.0 * np.pi:
            return [(degree, UNIT)]
        return [(1.0, 0.0), (1.0 / degree, UNIT)] if largest < 7.0 * degree else [(1.0, 0.0)]

    def place(self, readings: list[RowReading]) -> list[RowReading]:
        """Readings with base, tool, unit of length, handedness and convention, and their misfit."""
        tried = [list(self._variants(reading)) for reading in readings]
        placed = iter(self.aligned([variant for variants in tried for variant in variants]))
        return [min(islice(placed, len(variants)), key=lambda r: r.score) for variants in tried]

    def _variants(self, reading: RowReading) -> Iterator[RowReading]:
        if not self.held:
            reading = self._scaled(reading)
        first = next(iter(self.conventions), None)
        if reading.mirrored and first and reading.columns_as_given:
            exchanged = [np.eye(3)[list(order)] for order in ((1, 0, 2), (2, 1, 0), (0, 2, 1))]
            for axes in (*exchanged, *(np.eye(3) - 2.0 * np.outer(e, e) for e in np.eye(3))):
                yield self._in(replace(reading, axes=axes), first)
        yield from (self._in(reading, c) for c in self._likely(reading)) if first else [reading]

    def _likely(self, reading: RowReading) -> list[Convention]:
        """The conventions that are nearest to a reading: of poses, or with the base that its points have."""
        among = [*self.conventions]
        if self.turns is None or len(among) == 1:
            return among
        if self.held or self.sessions > 1:
            misfit = turn_bounds(reading.flange(self.data.q[self.few])[None], self.turns, self.sessions)[0]
        else:
            flange, points = reading.flange(self.data.q), reading.scale * self.points @ reading.axes
            base = nearest_rotation(affine_map(flange, points)[0].T)
            misfit = nearest_turn(base @ flange[:, :3, :3], np.array([*self.conventions.values()]))
        order = np.argsort(misfit)[:LIKELY]
        near = misfit[order] < 2.0 * misfit[order[0]] + 1e-3
        return [among[k] for k in order[near]]

    def _in(self, reading: RowReading, convention: Convention) -> RowReading:
        return replace(reading, convention=convention, cost=reading.cost + convention.cost)

    def _scaled(self, reading: RowReading) -> RowReading:
        """The reading with the unit of length and the handedness that its affine image shows."""
        first = slice(len(self.data) // self.sessions)
        linear, _ = affine_map(reading.flange(self.data.q[first]), self.points[first])
        size = np.linalg.svd(linear, compute_uv=False)
        scale, spread = float(size[:2].mean()), self.points - self.points.mean(0)
        moved = np.linalg.svd(spread, compute_uv=False)[1] / np.sqrt(len(spread))
        if not np.isfinite(size).all() or moved * scale < 0.03 * self.robot.reach:
            return reading  # visits to one place know neither
        if np.linalg.det(linear) < 0.0 and size[2] > 0.5 * size[0]:
            reading = replace(reading, axes=LEFT_HANDED, cost=reading.cost + self.handed)
        unit = min(LENGTHS, key=lambda s: abs(np.log(s / scale)))
        if abs(np.log(scale)) < 1.0 or abs(np.log(unit / scale)) > 0.3:
            return reading
        return replace(reading, scale=unit, cost=reading.cost + UNIT)

    def aligned(self, readings: list[RowReading], **options: Any) -> list[RowReading]:
        """Readings of one arm, all with orientations or none, with the base and tool that fit best; options
        as of `place`."""
        points, rotations = map(np.array, zip(*(r.poses(self.data) for r in readings), strict=True))
        turned = None if readings[0].convention is None else rotations
        q = np.array([r.joints(self.data.q) for r in readings])
        at = self._placed(readings[0].robot, q, points, turned, **options)
        return [self._measured(reading, at, k) for k, reading in enumerate(readings)]

    def _placed(self, robot: Robot, *rows: Any, **options: Any) -> PlacedReadings:
        """Readings with a base and a tool for each session, of which the first are told."""
        if (count := self.sessions) == 1:
            known = {"given": (np.eye(4), np.eye(4))} if self.held else {}
            return place(robot, *rows, **(known | options))
        size = len(self.data) // count
        each: list[Any] = [None if r is None else r.reshape(-1, size, *r.shape[2:]) for r in rows]
        at = place(robot, *each, robust=False, **options)
        parts = (p.reshape(-1, len(self.data), *p.shape[2:]) for p in (at.error, at.turn, at.flange))
        return PlacedReadings(at.base[::count], at.tool[::count], at.zero[::count], *parts)

    def _measured(self, reading: RowReading, at: PlacedReadings, number: int) -> RowReading:
        flange, kept = at.flange[number], ~at.apart[number]
        position, rotation = (float(np.sqrt((e[number][kept] ** 2).mean())) for e in (at.error, at.turn))
        wide = np.sqrt(((flange[:, :3, 3] - flange[:, :3, 3].mean(0)) ** 2).sum(1).mean()) + 1e-9
        count, summed = len(flange), (flange[:, :3, :3].sum(0) ** 2).sum()  # of all pairs of rotations
        turned = np.sqrt(np.maximum(3.0 - (summed / count - 3.0) / (count - 1.0), 1e-9))
        return replace(
            reading,
            base=at.base[number],
            tool=at.tool[number],
            zero=reading.zero + at.zero[number],
            position=position,
            rotation=rotation,
            motion=float(np.hypot(position / wide, np.nan_to_num(rotation) / turned)),
            apart=tuple(np.flatnonzero(~kept).tolist()),
        )

    def plain(self, **options: Any) -> RowReading:
        """The rows as given, in the declared convention; options as of `place`."""
        first, _ = next(conventions(self.data, usual=self.held), (None, None))
        return self.aligned([replace(RowReading.plain(self.robot), convention=first)], **options)[0]

    @property
    def turned(self) -> RowReading | None:
        """The second reading, plain but for its orientations, if these are clearly better so."""
        if len(self.found) < 2 or not self.found[1].orientation or not self.found[1].is_plain:
            return None
        plain, turned = self.found[:2]
        is_clear = turned.rotation < min(FITS_TURN, plain.rotation / CLEAR)
        return turned if is_clear and turned.position < FOREIGN_MISFIT * self.robot.reach else None

    def suffices(self, reading: RowReading) -> bool:
        """Whether a reading of plain joints fits so well that no other need be tried."""
        limit = SURE if reading.convention and reading.motion < NARROW / 2 else FAST
        return reading.score < limit and reading.fits

    @property
    def bound(self) -> float:
        """Lower bound of the misfit of the rows as given; infinite where they have other joints."""
        has_own, q = self.data.joints == self.robot.dof, self.data.q[self.few]
        return float(self._bounds(self.robot, flange_poses(self.robot, q[None]))[0]) if has_own else np.inf

    def family(self, family: Family, *, most: float = np.inf) -> None:
        """Place the likeliest hypotheses of a family, of each arm by itself, whose bound is below `most`."""
        for own in self.arms:
            for _, parts in groupby(family.of(own), key=lambda part: part.other):
                self._try(family.name, list(parts), inverse=family.inverse and not self.held, most=most)

    def _try(
        self, name: str, parts: list[Hypotheses], *, inverse: bool = False, most: float = np.inf
    ) -> None:
        robot, count = parts[0].robot, HELD_PLACED if self.held else PLACED
        ranked, tried = list[tuple[float, Hypotheses, int, dict[str, Any]]](), 0
        for part in (part.moving(self.still) for part in parts):
            tried += len(part.cost)
            for (factor, more), begin in product(self.units, range(0, len(part.cost), CHUNK)):
                some = part[begin : begin + CHUNK]
                joints = some.of(units(robot, self.data.joints, factor) * self.data.q[self.few])
                for turned in (False, True) if inverse and self.conventions else (False,):
                    cost = some.cost + more + INVERSE * turned
                    bound = self._bounds(robot, flange_poses(robot, joints, inverse=turned)) + 1e-4 * cost
                    way = {"other": some.other, "unit": factor, "inverse": turned}
                    best = np.argsort(bound)[:count].tolist()
                    ranked += [(float(bound[k]), some, k, way | {"cost": float(cost[k])}) for k in best]
        self.tried[name] = self.tried.get(name, 0) + tried
        ranked = sorted(ranked, key=lambda each: each[0])[:count]
        most = most if self.held or not ranked else min(most, max(30.0 * ranked[0][0], 0.08))
        near = [(some, k, way) for bound, some, k, way in ranked if bound < most]
        if readings := [RowReading(robot=robot, w=s.w[k], zero=s.zero[k], **way) for s, k, way in near]:
            refine = {"zeros": self.refined, "ratio": self.with_ratios}.get(parts[0].refined, list)
            self.found += self.place(refine(readings))

    def twins(self) -> None:
        """Place the best reading with all other signs of its joints, some of which change the handedness; or
        with another ratio of its coupling, if that is clearly better."""
        r, n = min(self.found, key=lambda r: r.score), self.robot.dof
        if self.sessions == 1 and self.data.joints == n == np.trace(r.w != 0.0) == np.count_nonzero(r.w) - 1:
            (other,) = self.place(self.with_ratios([replace(r, convention=None)]))
            self.found += [other] if CLEAR * other.score < r.score else []
        if (r := min(self.found, key=lambda r: r.score)).moves_otherwise:
            cost = r.cost - self.handed * r.mirrored
            signs = JointColumns(r.robot, self.data.q).with_other_signs(r.w, r.zero, cost)
            self._try("signs and couplings", [replace(signs, other=r.other)])

    def _bounds(self, robot: Robot, flange: np.ndarray) -> Float[np.ndarray, " s"]:
        """Lower bounds of the misfits of flange poses in the bounds' rows, as shares of the reach."""
        points, first = self.points[self.few], robot.chain.driven[0]
        if self.held:
            axis = chains.poses(robot.chain, np.zeros((1, robot.dof)), part=slice(0, int(first)))[0]
            bound = held_bounds(flange, points, axis @ ONTO_Z[robot.chain.axes[first] % 3])
        else:
            bound = point_bounds(flange, points, self.sessions)
        if self.turns is None:
            return bound / robot.reach
        return np.hypot(bound / robot.reach, WEIGHT * turn_bounds(flange, self.turns, self.sessions).min(1))

    def refined(self, readings: list[RowReading]) -> list[RowReading]:
        """Readings with their zeros fitted, and rounded to quarter turns: of inner joints to points, or of
        all to poses where base and tool are held."""
        robot = readings[0].robot
        if not self.held:
            fitted = self.aligned([self._scaled(r) for r in readings], zeros=range(1, robot.dof - 1))
            return [self._with_zeros(r, f.zero) for r, f in zip(readings, fitted, strict=True)]
        tried = [(r, self._in(r, c)) for r in readings for c in self._likely(r)]
        fitted = self.aligned([r for _, r in tried], zeros=range(robot.dof))
        best = sorted(zip(tried, fitted, strict=True), key=lambda pair: pair[1].score)[:PLACED]
        return [self._with_zeros(r, f.zero, exact=exact) for (r, _), f in best for exact in (False, True)]

    def with_ratios(self, readings: list[RowReading]) -> list[RowReading]:
        """Readings with the ratio fitted by which one joint follows another's column, to points."""
        found = list[RowReading]()
        for r in readings:
            ((joint, column),) = np.argwhere(r.w * (1.0 - np.eye(len(r.w))))
            by = r.in_units(self.data.q)[None, :, column, None]
            (fitted,) = self.aligned([self._scaled(r)], zeros=[joint], by=by)
            w, ratio = r.w.copy(), r.w[joint, column] + fitted.zero[joint] - r.zero[joint]
            near = round(2.0 * ratio) / 2.0
            w[joint, column] = near if near and abs(ratio - near) < SNAP_RATIO else ratio
            found.append(replace(r, w=w))
        return found

    def _with_zeros(self, reading: RowReading, zero: np.ndarray, *, exact: bool = False) -> RowReading:
        """A reading with other zeros; those near quarter turns made exactly these."""
        robot = reading.robot
        slides = np.array(sliding(robot), bool)
        zero = np.where(slides, zero, (zero + np.pi) % (2.0 * np.pi) - np.pi)
        quarter = np.where(slides, 0.0, np.round(zero / QUARTER) * QUARTER)
        near = np.abs(zero - quarter) < np.where(slides, SNAP_LENGTH * robot.reach, SNAP)
        zero = np.where(near & (not exact), quarter, zero)
        zero = np.where(np.isclose(zero, -np.pi), np.pi, zero)
        more = (zero != 0.0).sum() - (reading.zero != 0.0).sum()
        free = len(zero) if exact else (~near).sum()
        return replace(reading, zero=zero, cost=float(reading.cost + ZERO * more + FREE_ZERO * free))
