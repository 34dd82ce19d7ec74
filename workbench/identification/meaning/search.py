"""One search over what rows mean: B_i = X A(W q_i + o) Z with base X and tool Z free.

Families of readings come in a fixed order, each complete before anything is said: as given, orientation
conventions, signs and couplings, other built-in arms, orders, zeros, several of these. Closed-form bounds
rank all candidates of a family; the best are placed. The plain reading stands unless another is clearly
better, and no changed reading is claimed from rows that hardly move the arm.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from jaxtyping import Float, Int

from workbench.arm import chain as chains
from workbench.arm.built_in_arms import load_robot
from workbench.arm.frame import FRAME_PARTS, Frame
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.base.hand_eye import hand_eye, mean_base, nearest_rotation
from workbench.data.dataset import Dataset
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.alignment import align
from workbench.identification.meaning.bounds import (
    WEIGHT,
    affine_map,
    grams,
    nearest_turn,
    point_bounds,
    turn_bounds,
)
from workbench.identification.meaning.candidates import TURN, Candidates, Families
from workbench.identification.meaning.conventions import Convention, conventions
from workbench.identification.meaning.reading import (
    FITS,
    FITS_TURN,
    FOREIGN_MISFIT,
    GOOD,
    NARROW,
    Reading,
    flange_poses,
)
from workbench.identification.problem import FrameFreedom, Problem

MIN_ROWS = 6
"""Minimum number of rows with a point to search for readings."""
FAST = 0.004
"""Share of the reach below which points read as given need no search; with orientations most of `FITS`."""
SURE = 0.7 * FITS
ALIKE, CLEAR = 1.3, 2.5
"""Ratio of misfits below which the simplest reading is taken, and above which it is certain."""
BOUND_ROWS, PLACED_ROWS, CHUNK = 16, 60, 4096
"""Rows of the bounds and of placed readings; candidates at a time."""
PLACED, REFINED, STEPS = 10, 10, 10
"""Readings of a family that are placed, whose zeros are refined, and steps of the placement."""
SNAP = float(np.radians(4.0))
"""Zeros nearer to a quarter turn are one."""
FEW_POINTS = 20
"""Points without orientations below which partly right readings fit, too."""
GLANCE = 0.02
"""Maximum difference of scales from 1, and of orientations [rad], of rows that fit at a glance."""
STILL = float(np.radians(0.5))
"""Columns that move less don't move."""
LENGTHS = {1e-3: "mm labelled m", 1e3: "m labelled mm", 0.0254: "inch labelled m", 1e-2: "cm labelled m",
           25.4: "inch labelled mm", 10.0: "cm labelled mm", 0.1: "mm labelled cm"}  # fmt: skip
UNIT, HANDED, INVERSE = 1.0, 2.0, 1.5
"""Complexity of a unit, a handedness, and of inverse poses."""
SHOWN = 6
"""Readings that are named in a list."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Meaning:
    """What rows mean: the best reading, and what these rows can't tell from it.

    Args:
        best: The simplest of the readings that fit best.
        plain: The rows as given.
        margin: How many times worse the next one is that moves otherwise.
        alike: Readings of the same motion.
        blind: Readings of the same points, whose orientations or handedness differ.
        open: Readings that these rows can't tell from it.
        tried: Number of candidates by family; empty if the rows fit as given.
        turned: The joints as given with another convention of orientations that is clearly theirs, if any.
    """

    best: Reading
    plain: Reading | None
    margin: float = np.inf
    alike: tuple[str, ...] = ()
    blind: tuple[str, ...] = ()
    open: tuple[str, ...] = ()
    tried: dict[str, int] = field(default_factory=dict)
    turned: Reading | None = None

    @property
    def is_found(self) -> bool:
        """Whether the best reading fits and is clearly better than the rows as given and than any other."""
        if not self.best.fits:
            return False
        if self.best.is_plain or self.plain is None:
            return self.margin > 1.0
        return self.margin >= CLEAR and CLEAR * self.best.score < self.plain.score

    @property
    def tried_text(self) -> str:
        """`tried in full: 1472 signs and couplings, 9 arms, 960 orders`."""
        return ", ".join(f"{number} {family}" for family, number in self.tried.items())


class Search:
    """Readings of some rows of one session, which are placed once they are likely.

    Args:
        robot: The arm that is said to have moved.
        data: Rows with points, and orientations or none.
    """

    def __init__(self, robot: Robot, data: Dataset):
        self.robot = robot.bare
        self.data = data.take(_far_apart(data, PLACED_ROWS))
        self.few = _far_apart(self.data, BOUND_ROWS)
        self.found: list[Reading] = []
        self.tried: dict[str, int] = {}

    @property
    def points(self) -> Float[np.ndarray, "rows 3"]:
        return np.asarray(self.data.position)

    @cached_property
    def conventions(self) -> list[Convention]:
        return list(conventions(self.data))

    @cached_property
    def still(self) -> np.ndarray:
        """Columns that don't move."""
        return np.ptp(self.data.q, axis=0) < STILL

    @cached_property
    def units(self) -> list[tuple[float, float, tuple[str, ...]]]:
        """Factors of the joint columns that are possible, their complexity and text."""
        largest, degree = np.abs(self.data.q).max(), np.pi / 180.0
        if largest > 2.0 * TURN:
            return [(degree, UNIT, ("the joints are degrees labelled rad",))]
        less = (
            [(1.0 / degree, UNIT, ("the joints are rad labelled degrees",))] if largest < 7.0 * degree else []
        )
        return [(1.0, 0.0, ()), *less]

    def place(self, reading: Reading, among: list[Convention]) -> Reading:
        """A reading with base, tool, unit of length, handedness and convention, and its misfit."""
        flange = reading.flange(self.data.q)
        reading = self._scaled(reading, flange)
        if reading.mirrored and among and np.array_equal(reading.w, np.eye(len(reading.w))):
            return min((self._aligned(r, among[0]) for r in _axes_exchanged(reading)), key=lambda r: r.score)
        if not among or reading.mirrored:
            return self._aligned(reading, None)
        base = nearest_rotation(affine_map(flange, self.points).T)
        misfit = nearest_turn(base @ flange[:, :3, :3], np.array([c.rotations for c in among]))
        order = np.argsort(misfit)[:3]
        clear = len(order) > 1 and misfit[order[0]] < 0.5 * misfit[order[-1]]
        tried = [self._aligned(reading, among[k]) for k in (order[:1] if clear else order)]
        return min(tried, key=lambda r: r.score)

    def _scaled(self, reading: Reading, flange: np.ndarray) -> Reading:
        """The reading with the unit of length and the handedness that its affine image shows."""
        size = np.linalg.svd(linear := affine_map(flange, self.points), compute_uv=False)
        scale, spread = float(size[:2].mean()), self.points - self.points.mean(0)
        moved = np.linalg.svd(spread, compute_uv=False)[1] / np.sqrt(len(spread))
        if not np.isfinite(size).all() or moved * scale < 0.03 * self.robot.reach:
            return reading  # visits to one place know neither
        if np.linalg.det(linear) < 0.0 and size[2] > 0.5 * size[0]:
            text = "x, y, z are left-handed: two exchanged, or one inverted"
            changes, axes = (*reading.changes, text), np.diag([1.0, 1.0, -1.0])
            reading = replace(reading, axes=axes, cost=reading.cost + HANDED, changes=changes)
        unit = min(LENGTHS, key=lambda s: abs(np.log(s / scale)))
        if abs(np.log(scale)) < 1.0 or abs(np.log(unit / scale)) > 0.3:
            return reading
        text = f"the positions are {LENGTHS[unit]}"
        return replace(reading, scale=unit, cost=reading.cost + UNIT, changes=(*reading.changes, text))

    def _aligned(self, reading: Reading, convention: Convention | None) -> Reading:
        if convention is not None:
            orientation, cost = convention.text, reading.cost + convention.cost
            reading = replace(reading, rotations=convention.rotations, orientation=orientation, cost=cost)
        rows = reading.apply(self.data)
        rows = Dataset(
            q=rows.q, position=rows.position, rotation=None if convention is None else rows.rotation
        )
        arm, error, turn = _fitted(reading.robot, rows)
        apart = _apart(error)
        if apart.any():
            arm, _, _ = _fitted(reading.robot, rows.take(~apart))
            error, turn = _misfits(arm, rows)
        position, rotation = (float(np.sqrt((e[~apart] ** 2).mean())) for e in (error, turn))
        flange = flange_poses(reading.robot, rows.q)
        wide = np.sqrt(((flange[:, :3, 3] - flange[:, :3, 3].mean(0)) ** 2).sum(1).mean()) + 1e-9
        turned = np.sqrt(np.maximum(3.0 - grams(flange[None, :, :3, :3]).mean(), 1e-9))
        return replace(
            reading,
            robot=arm,
            position=position,
            rotation=rotation,
            motion=float(np.hypot(position / wide, np.nan_to_num(rotation) / turned)),
            apart=tuple(np.flatnonzero(apart).tolist()),
        )

    def plain(self) -> Reading:
        """The rows as given, in the declared convention."""
        return self._aligned(Reading.plain(self.robot), next(iter(self.conventions), None))

    @property
    def turned(self) -> Reading | None:
        """The second reading, plain but for its orientations, if these are clearly better so."""
        if len(self.found) < 2 or not self.found[1].orientation or not self.found[1].is_plain:
            return None
        plain, turned = self.found[:2]
        is_clear = turned.rotation < min(FITS_TURN, plain.rotation / CLEAR)
        return turned if is_clear and turned.position < FOREIGN_MISFIT * self.robot.reach else None

    def suffices(self, reading: Reading) -> bool:
        """Whether a reading of plain joints fits so well that no other need be tried."""
        limit = SURE if self.conventions and reading.motion < NARROW / 2 else FAST
        return reading.score < limit and reading.fits

    def fits_at_a_glance(self) -> bool:
        """Whether the rows as given fit by the bounds alone, in their unit and right-handed."""
        flange = Reading.plain(self.robot).flange(self.data.q)
        if point_bounds(flange[None], self.points)[0] > FAST * self.robot.reach:
            return False
        size = np.linalg.svd(linear := affine_map(flange, self.points), compute_uv=False)
        if not np.abs(size - 1.0).max() < GLANCE or np.linalg.det(linear) < 0.0:
            return False
        if self.data.rotation is None:
            return len(self.data) >= FEW_POINTS
        base = nearest_rotation(linear.T)
        return bool(nearest_turn(base @ flange[:, :3, :3], self.data.rotation[None])[0] < GLANCE)

    def family(self, name: str, robot: Robot, candidates: Candidates, *, inverse: bool = True) -> None:
        """Place the likeliest readings of a family."""
        candidates = candidates.moving(self.still)
        self.tried[name] = self.tried.get(name, 0) + len(candidates)
        q, points = self.data.q[self.few], self.points[self.few]
        table = None
        if self.conventions:
            table = grams(np.array([c.rotations[self.few] for c in self.conventions]))
        ranked: list[tuple[float, int, int, bool]] = []
        directions = (False, True) if inverse and table is not None else (False,)
        for unit, (factor, more, _) in enumerate(self.units):
            for begin in range(0, len(candidates), CHUNK):
                some = slice(begin, begin + CHUNK)
                joints = candidates.of(factor * q, some)
                cost = candidates.cost[some] + more
                for turned in directions:
                    flange = flange_poses(robot, joints, inverse=turned)
                    bound = point_bounds(flange, points) / robot.reach
                    if table is not None:
                        bound = np.hypot(bound, WEIGHT * turn_bounds(flange, table))
                    bound = bound + 1e-4 * (cost + INVERSE * turned)
                    ranked += [
                        (bound[k], begin + k, unit, turned) for k in np.argsort(bound)[:PLACED].tolist()
                    ]
        ranked.sort()
        likely = [c for c in ranked if c[0] < max(30.0 * ranked[0][0], 0.08)][:PLACED]
        readings = [self._reading(robot, candidates, *c[1:]) for c in likely]
        if candidates.refined:
            readings = [self.refined(r) for r in readings[:REFINED] if not r.inverse]
        placed = [self.place(r, self.conventions) for r in readings]
        self.found += [r for r in placed if not (r.mirrored and r.rotations is None and self.conventions)]

    def _reading(self, robot: Robot, candidates: Candidates, k: int, unit: int, inverse: bool) -> Reading:
        factor, more, texts = self.units[unit]
        w, zero = candidates.w[k], candidates.zero[k]
        changes = (
            *texts,
            *joint_texts(w, zero),
            *(("poses are of the base in the tool",) if inverse else ()),
        )
        if robot.name != self.robot.name:
            changes = (f"the arm is {robot.name}", *changes)
        cost = float(candidates.cost[k]) + more + INVERSE * inverse
        return Reading(robot=robot, w=factor * w, zero=zero, cost=cost, inverse=inverse, changes=changes)

    def refined(self, reading: Reading) -> Reading:
        """The reading with the zeros of inner joints fitted to its points, and rounded to quarter turns."""
        names = reading.robot.joint_offsets[1:-1]
        scaled = self._scaled(reading, reading.flange(self.data.q))
        rows = scaled.apply(self.data)
        rows = Dataset(q=rows.q, position=rows.position)
        freedom = FrameFreedom(FRAME_PARTS, FRAME_PARTS[:3])
        arm = align(reading.robot, rows, freedom, limit=STEPS)
        problem = Problem.build(arm, rows, free=names, frames=freedom)
        x = dict(zip(problem.names, (Opt2(limit=40).search(problem).x - problem.start).tolist(), strict=True))
        zero = reading.zero.copy()
        zero[1:-1] += [x.get(name, 0.0) for name in names]
        zero = (zero + np.pi) % TURN - np.pi
        quarter = np.round(zero / (np.pi / 2)) * np.pi / 2
        near = np.abs(zero - quarter) < SNAP
        zero = np.where(near, quarter, zero)
        zero = np.where(np.isclose(zero, -np.pi), np.pi, zero)
        cost = (
            reading.cost - 0.8 * (reading.zero != 0.0).sum() + 0.8 * (zero != 0.0).sum() + 0.6 * (~near).sum()
        )
        units = [text for text in reading.changes if text.startswith(("the joints are", "the arm is"))]
        factor = np.abs(reading.w).max(initial=1.0) if units else 1.0
        texts = joint_texts(reading.w / factor if factor > 2.0 else reading.w, zero)
        return replace(reading, zero=zero, cost=float(cost), changes=(*units, *texts))


def joint_texts(w: Float[np.ndarray, "n m"], zero: Float[np.ndarray, " n"]) -> list[str]:
    """What each joint is that isn't its own column: `joint 3 = q3 + q2`, `joint 5 = -q5 + 90°`."""
    found, eye = [], np.eye(*w.shape)
    for k, row in enumerate(w):
        turn = float(np.degrees((zero[k] + np.pi) % TURN - np.pi))
        if np.allclose(row, eye[k]) and abs(turn) < 1e-6:
            continue
        columns = sorted(np.flatnonzero(row).tolist(), key=lambda j: (j != k, j))
        sizes = {j: "" if abs(abs(row[j]) - 1.0) < 1e-9 else f"{abs(row[j]):.4g} " for j in columns}
        text = " ".join(f"{'-' if row[j] < 0 else '+'} {sizes[j]}q{j + 1}" for j in columns)
        text = text[2:] if text.startswith("+") else f"-{text[2:]}"
        text += "" if abs(turn) < 1e-6 else f" {'-' if turn < 0 else '+'} {abs(turn):.4g}°"
        found.append(f"joint {k + 1} = {text}")
    return found


def read_rows(robot: Robot, data: Dataset, *, arms: bool = True) -> Meaning | None:
    """What rows mean for an arm; None with too few rows with a point.

    Args:
        robot: The arm that is said to have moved.
        data: Rows; those of the session, and of the point, that has most are looked at.
        arms: Whether other built-in arms are tried.
    """
    rows = _usable(data)
    if rows is None:
        return None
    search, plain = Search(robot, rows), None
    if data.joints == robot.dof:
        plain = search.plain()
        if search.suffices(plain):
            return Meaning(best=plain, plain=plain)
        search.found = [plain, search.place(Reading.plain(robot), search.conventions)]
        if search.suffices(search.found[1]):
            return _ranked(search, plain)
    for number, stage in enumerate(steps := _stages(search, arms)):
        if plain is not None and number and _is_done(search, plain, last=number == len(steps) - 1):
            break
        stage()
    return _ranked(search, plain) if search.found else None


def _stages(search: Search, arms: bool) -> list[Callable[[], None]]:
    """Families in their order."""
    robot, columns = search.robot, search.data.joints
    own = Families(robot, columns)
    stages: list[Callable[[], None]] = []
    if columns == robot.dof:
        near = min(r.position for r in search.found) < FITS * robot.reach

        def first() -> None:
            search.family("signs and couplings", robot, own.signs)
            if near:  # a plain reading that fits so-so has met these before it stands
                search.family("exchanges", robot, own.exchanges)
                search.family("zeros", robot, own.zeros, inverse=False)

        stages.append(first)
    elif columns > robot.dof:
        stages.append(lambda: search.family("choices of columns", robot, own.plain))
    if arms:
        stages.append(lambda: _try_arms(search))
    if columns == robot.dof:
        stages += [
            lambda: search.family("orders", robot, own.orders),
            lambda: search.family("zeros with signs", robot, own.signed_zeros, inverse=False),
            lambda: search.family("couplings with zeros", robot, own.coupled_zeros, inverse=False),
            lambda: search.family("quarter turns with signs", robot, own.quarters, inverse=False),
        ]
    return stages


def _try_arms(search: Search) -> None:
    columns = search.data.joints
    for name in built_in_robots():
        other = load_robot(name)
        if other.dof == columns and other.name.split(",")[0] != search.robot.name.split(",")[0]:
            search.family("other arms", other.bare, Families(other.bare, columns).plain, inverse=False)


def _is_done(search: Search, plain: Reading, *, last: bool) -> bool:
    """Whether what was found is good or clear enough to stop."""
    best = min(r.score for r in search.found)
    few = len(search.data) < FEW_POINTS and not search.conventions
    if best > SURE or (few and best > 1e-3 and not last and not plain.fits):
        return False
    top = _ranked(search, plain)
    if top.best.moves_otherwise and top.best.motion > 0.4 * NARROW:
        return False
    return best < GOOD or (top.margin > 3.0 and (bool(search.conventions) or not top.best.moves_otherwise))


def _ranked(search: Search, plain: Reading | None) -> Meaning:
    """The simplest of the readings that fit alike; the others by what tells them from it."""
    found = sorted(search.found, key=lambda r: r.score)
    ties = [r for r in found if r.score < ALIKE * found[0].score + 1e-5]
    ties += [r for r in found if r.is_plain and r.fits and r.score < CLEAR * found[0].score]
    best = min(ties, key=lambda r: (round(r.cost, 3), r.score))
    floor = max(best.score, 1e-5)
    near = [r for r in found if r is not best and r.text != best.text and r.score < 4.0 * CLEAR * floor][:40]
    far = min((r.score for r in found if r is not best and r.score >= 4.0 * CLEAR * floor), default=np.inf)
    low, high = search.data.q.min(0), search.data.q.max(0)
    q = np.random.default_rng(0).uniform(low, high, (24, len(low)))
    alike = [r for r in near if not r.mirrored and _same_motion(best, r, q)]
    blind = [r for r in near if r not in alike and _same_points(best, r, q)]
    other = [r for r in near if r not in alike and r not in blind]
    return Meaning(
        best=best,
        plain=plain,
        margin=min((r.score for r in other), default=far) / floor,
        alike=_texts(alike),
        blind=_texts(blind),
        open=_texts([r for r in other if r.score < CLEAR * floor]),
        tried=dict(search.tried),
        turned=search.turned,
    )


def _texts(readings: list[Reading]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(r.text for r in readings))[:SHOWN]


def _axes_exchanged(reading: Reading) -> Iterator[Reading]:
    """A reading with left-handed axes, with two of them exchanged, or one inverted."""
    for i, j in combinations(range(3), 2):
        order = [{i: j, j: i}.get(k, k) for k in range(3)]
        text = f"{'xyz'[i]} and {'xyz'[j]} are exchanged"
        yield replace(reading, axes=np.eye(3)[order], changes=(*reading.changes[:-1], text))
    for k in range(3):
        axes = np.diag([-1.0 if j == k else 1.0 for j in range(3)])
        yield replace(reading, axes=axes, changes=(*reading.changes[:-1], f"{'xyz'[k]} is inverted"))


def _same_motion(one: Reading, other: Reading, q: np.ndarray) -> bool:
    """Whether two readings move the flange alike at random postures, up to base and tool."""
    if one.inverse != other.inverse or one.orientation != other.orientation:
        return False
    seen, own = one.flange(q), other.flange(q)
    tool = hand_eye(own, seen)
    error = se3.pose_error(mean_base(own @ tool, seen) @ own @ tool, seen)
    return bool(np.abs(error[:, :3]).max() < 2e-4 * one.robot.reach and np.abs(error[:, 3:]).max() < 2e-3)


def _same_points(one: Reading, other: Reading, q: np.ndarray) -> bool:
    """Whether two readings predict the same points of the file at random postures."""
    if one.inverse or other.inverse:
        return False
    seen, own = (_points(r, q) for r in (one, other))
    error = one.scale * np.sqrt(((seen - own) ** 2).sum(1).mean())
    return bool(error < max(1.5 * max(one.position, other.position), 2e-4 * one.robot.reach))


def _points(reading: Reading, q: np.ndarray) -> Float[np.ndarray, "rows 3"]:
    points = chains.poses(reading.robot.chain, reading.joints(q))[:, :3, 3]
    return points @ reading.axes.T / reading.scale


def _fitted(robot: Robot, rows: Dataset) -> tuple[Robot, np.ndarray, np.ndarray]:
    """The arm with the best base and tool, and distances [m] and angles [rad] of the rows."""
    parts = FRAME_PARTS[:3] if rows.rotation is None else FRAME_PARTS
    arm = align(
        robot.with_frames(base=Frame(), tool=Frame()), rows, FrameFreedom(FRAME_PARTS, parts), limit=STEPS
    )
    return arm, *_misfits(arm, rows)


def _misfits(arm: Robot, rows: Dataset) -> tuple[np.ndarray, np.ndarray]:
    poses = chains.poses(arm.chain, rows.q)
    error = np.linalg.norm(poses[:, :3, 3] - rows.position, axis=1)
    if rows.rotation is None:
        return error, np.full(len(error), np.nan)
    turn = se3.matrix_to_rotvec(rows.rotation @ np.swapaxes(poses[:, :3, :3], 1, 2))
    return error, np.linalg.norm(turn, axis=1)


def _apart(error: Float[np.ndarray, " rows"]) -> np.ndarray:
    """Rows that stand off, at most a fifth."""
    return error > np.maximum(5.0 * np.median(error), np.quantile(error, 0.8))


def fits_at_a_glance(robot: Robot, data: Dataset) -> bool:
    """Whether rows fit as given, or can't tell; cheap."""
    rows = _usable(data)
    return rows is None or (data.joints == robot.dof and Search(robot, rows).fits_at_a_glance())


def _usable(data: Dataset) -> Dataset | None:
    """Rows with a point, and orientation where those have one, of the session and socket that has most."""
    if data.position is None and data.markers is not None:
        data = replace(data, position=data.markers[:, 0])
    if data.position is None:
        return None
    rows = data.included & np.isfinite(data.position).all(1) & np.isfinite(data.q).all(1)
    if data.rotation is not None:
        turned = rows & np.isfinite(data.rotation).all((1, 2))
        rows = turned if turned.sum() >= MIN_ROWS else rows
    for names in (data.session, data.point):
        if names is not None and rows.any():
            values, counts = np.unique(names[rows], return_counts=True)
            rows = rows & (names == values[np.argmax(counts)])
    kept = data.take(rows)
    if kept.rotation is not None and not np.isfinite(kept.rotation).all():
        kept = replace(kept, rotation=None, written=None)
    if len(kept) < MIN_ROWS:
        return None
    away = np.linalg.norm(kept.position - np.median(kept.position, axis=0), axis=1)
    return kept.take(away <= 20.0 * np.median(away) + 1e-9)


def _far_apart(data: Dataset, count: int) -> Int[np.ndarray, " k"]:
    """Rows far apart in joints and points, at most so many."""
    if len(data) <= count:
        return np.arange(len(data))
    points = np.asarray(data.position)
    table = np.column_stack([data.q / (data.q.std(0) + 1e-9), points / (points.std() + 1e-9)])
    table = np.clip(table - np.median(table, axis=0), -4.0, 4.0)
    distance = np.full(len(table), np.inf)
    chosen = [int(np.argmin((table**2).sum(1)))]
    for _ in range(count - 1):
        distance = np.minimum(distance, ((table - table[chosen[-1]]) ** 2).sum(1))
        chosen.append(int(np.argmax(distance)))
    return np.array(sorted(chosen))


MIN_FITTING_SHARE, TRIM_ROUNDS = 0.65, 8
"""Share of rows that must fit for the others to be wrong, and number of rounds that search for them."""


def majority(robot: Robot, data: Dataset) -> tuple[tuple[int, ...], float] | None:
    """Numbers of the rows that stand off from an arm that most others fit, and its error on these [m]."""
    located = _usable(data)
    if located is None:
        return None
    located = replace(located, rotation=None, written=None)
    off = np.zeros(len(located))
    for _ in range(TRIM_ROUNDS):
        most = located.take(np.flatnonzero(off <= np.quantile(off, MIN_FITTING_SHARE)))
        arm, _, _ = _fitted(robot.bare, most.take(_far_apart(most, PLACED_ROWS)))
        off, _ = _misfits(arm, located)
    fits = off < FITS * robot.reach
    error = float(np.median(off[fits])) if fits.any() else np.inf
    if not MIN_FITTING_SHARE <= fits.mean() < 1.0 or error > 0.5 * FITS * robot.reach:
        return None
    return tuple(located.row[~fits].tolist()), error


def placed(robot: Robot, data: Dataset) -> Robot:
    """The nominal arm with the base and tool that fit its rows best; unchanged with too few points."""
    rows = _usable(data) if data.joints == robot.dof else None
    if rows is None:
        return robot
    arm = Search(robot, rows).plain().robot
    return replace(robot, mounting=robot.mounting.at(arm.base.pose, arm.tool.pose), sessions={})


def zeros_fitted(robot: Robot, data: Dataset) -> float:
    """Misfit [m] of rows that are an arm's own once base, tool and joint zeros are fitted."""
    search = Search(robot, data)
    plain = search.plain()
    refined = search.place(search.refined(Reading.plain(search.robot)), search.conventions[:1])
    return min(plain.position, refined.position)
