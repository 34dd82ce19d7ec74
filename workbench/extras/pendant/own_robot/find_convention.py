"""Finding the interpretation of a robot's table that reproduces the poses shown on its pendant, by trial.

    T_i = C_0 Z(s_1 q_i1 + o_1) C_1 … Z(s_n q_in + o_n) C_n,      s_k = ±1, o_k offsets, i the typed poses

C are the constants of the table under one reading (standard or modified DH; m or mm, rad or deg). For each
reading, every choice of signs and of offsets in steps is met in the middle: products of the first joints take
T_i to where products of the last ones must be, and the nearest pairs are refined by Gauss–Newton in o. The
reading that fits is accepted only if no other one that fits as well predicts something else somewhere:
readings that are the same arm (such as a wrist turned over) are one, and the one with the fewest changes is
taken. Everything else is refused, with what would decide.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse.reduced_arm import ReducedArm, compile_arm
from workbench.arm.many_starts import descend
from workbench.arm.robot import Robot
from workbench.arm.signs_and_offsets import with_signs_and_offsets
from workbench.base import se3
from workbench.base.arguments import checked_arguments
from workbench.base.errors import DataError, OptionError, ShapeError
from workbench.base.types import frozen
from workbench.base.wording import in_mm
from workbench.extras.pendant.own_robot.table_meanings import TableReading, Typed

MIN_POSES = 3
WEIGHT = 0.25
"""Length at which an angle counts, as a share of the arm's."""
MAX_READING_ERROR = (0.005, float(np.deg2rad(0.5)))
"""Maximum error of a reading that fits: position, as a share of the arm's length, and angle [rad]."""
SAME_READING = 0.01
"""Two readings that differ by less than this share of the arm's length are one."""
CLEARLY = 5.0
"""An accepted reading fits this many times better than any other, or others do not fit …"""
ROUNDING = 2e-4
"""… where errors below this share of the arm's length are rounding of typed numbers."""
SEARCH_STAGES = ((4, 60, 0.1), (4, 60, np.inf), (8, 400, np.inf))
"""Offsets tried a turn, pairs refined, and how far apart (length and angle as in `_features`) these may be.

Quarters that fit as they are first, then quarters and eighths from which the offsets are refined.
"""
CHECK = "check every number, and that the pendant shows the flange (no tool) in the base (no user frame)"
BLOCK = 4096
"""Products of first joints that are compared with all of the last ones at a time."""
FIXED = 1e-9


@dataclass(frozen=True, eq=False, kw_only=True)
class FoundConvention:
    """A reading that fits.

    Args:
        robot: The arm, whose joints count as the pendant does.
        signs: Which joints count the other way than in the table (−1).
        offsets: What is added to the joints after their sign [rad or m].
        assumptions: What was assumed of table and numbers.
        position: Maximum error at the typed poses [m].
        rotation: Maximum angle there [rad].
        tried: Number of readings.
    """

    robot: Robot
    signs: Float[np.ndarray, " n"]
    offsets: Float[np.ndarray, " n"]
    assumptions: tuple[str, ...]
    position: float
    rotation: float
    tried: int

    @property
    def changes(self) -> tuple[str, ...]:
        """What differs from the table as it was given, one sentence each."""
        flips = [f"joint {k + 1} is inverted" for k in np.flatnonzero(self.signs < 0)]
        slides = [not e.axis.turns for e in self.robot.elements if e.joint is not None]
        moves = [
            f"joint {k + 1} has an offset of {1e3 * v:.3f} mm" if slides[k] else
            f"joint {k + 1} has an offset of {np.rad2deg(v):.3f}°"
            for k, v in enumerate(self.offsets)
            if abs(v) > FIXED
        ]  # fmt: skip
        return (*flips, *moves)


@dataclass(frozen=True, eq=False)
class _ConventionFit:
    reading: TableReading
    typed: Typed
    signs: np.ndarray
    offsets: np.ndarray
    errors: tuple[float, float]

    @property
    def cost(self) -> float:
        """Error as a length, in parts of the arm's."""
        length = compile_arm(self.reading.robot).length
        return float(np.hypot(self.errors[0] / length, WEIGHT * self.errors[1]))

    @property
    def fits(self) -> bool:
        """Whether no pose is farther off than production errors and rounding explain."""
        length = compile_arm(self.reading.robot).length
        return self.errors[0] < MAX_READING_ERROR[0] * length and self.errors[1] < MAX_READING_ERROR[1]

    @property
    def changes(self) -> float:
        """How far it is from the table as given."""
        return float(np.sum(self.signs < 0) + 0.5 * np.sum(np.abs(self.offsets) > FIXED))

    @property
    def assumed(self) -> str:
        """What is assumed of table and numbers."""
        return ", ".join((*self.reading.assumptions, *self.typed.assumptions))

    def at(self, q: np.ndarray) -> np.ndarray:
        """Tool poses (rows, 3, 4)."""
        return compile_arm(self.reading.robot).geometry(self.signs * q + self.offsets)[0]

    def off(self, typed: Typed) -> Float[np.ndarray, "poses 2"]:
        """How far each pose is off: distance [m], angle [rad]."""
        full = np.tile(np.eye(4), (len(typed.q), 1, 1))
        full[:, :3] = self.at(typed.q)
        error = se3.pose_error(typed.poses, full)
        return np.stack([np.linalg.norm(error[:, part], axis=1) for part in PARTS], axis=1)


@checked_arguments()
def find_convention(readings: Iterable[TableReading], typed: Sequence[Typed]) -> FoundConvention:
    """The interpretation of a table that reproduces given poses.

    Args:
        readings: What the table may mean; the likeliest first (`table_readings`).
        typed: What the numbers may mean; the likeliest first.

    Raises:
        ShapeError: fewer than three poses, or another number of joints than the table has.
        DataError: no reading fits, or several do and differ elsewhere; says which, and what would decide.
    """
    readings = tuple(readings)
    if not readings or not typed:
        raise OptionError(
            f"no {'typed poses' if readings else 'table'} to compare; give at least one reading of each"
        )
    for numbers in typed:
        if len(numbers.q) < MIN_POSES:
            raise ShapeError(
                f"at least {MIN_POSES} poses are needed, got {len(numbers.q)}; move every joint between",
                expected=MIN_POSES,
                found=len(numbers.q),
            )
        readings[0].robot.check_joints(numbers.q, "the typed poses")
    refined, fits = list[_ConventionFit](), list[_ConventionFit]()
    for stage in SEARCH_STAGES:
        for reading, numbers in product(readings, typed):
            refined += _refined_fits(reading, numbers, *stage)
        if fits := sorted((f for f in refined if f.fits), key=lambda f: f.cost):
            break
    tried = len(readings) * len(typed)
    if not fits:
        why = _slip(readings, typed) or _how_near(refined) + CHECK
        raise DataError(f"none of {tried} readings of the table fits the typed poses; {why}")
    best = fits[0]
    level = max(CLEARLY * best.cost, ROUNDING)
    rivals = [f for f in (*fits[1:], *_turned_back(best)) if f.cost <= level and not _same(f, best)]
    if rivals:
        raise DataError(_undecided(best, rivals))
    chosen = min(
        (f for f in map(_snapped, fits) if f.cost <= max(1.5 * best.cost, ROUNDING) and _same(f, best)),
        key=lambda f: f.changes,
        default=best,
    )
    return FoundConvention(
        robot=with_signs_and_offsets(chosen.reading.robot, chosen.signs, chosen.offsets),
        signs=frozen(chosen.signs),
        offsets=frozen(chosen.offsets),
        assumptions=(*chosen.reading.assumptions, *chosen.typed.assumptions),
        position=chosen.errors[0],
        rotation=chosen.errors[1],
        tried=tried,
    )


def _slip(readings: Sequence[TableReading], typed: Sequence[Typed]) -> str:
    """The one pose without which a reading fits, by how much it is off, and the reading; empty if none is."""
    found: list[tuple[_ConventionFit, int, Typed]] = []
    for row in range(len(typed[0].q) if len(typed[0].q) > MIN_POSES else 0):
        for reading, numbers in product(readings, typed):
            kept = np.arange(len(numbers.q)) != row
            others = replace(numbers, q=numbers.q[kept], poses=numbers.poses[kept])
            fits = (fit for fit in _refined_fits(reading, others, *SEARCH_STAGES[0]) if fit.fits)
            found += [(fit, row, numbers) for fit in fits]
    if not found:
        return ""
    best, row, numbers = min(found, key=lambda f: f[0].cost)
    if any(other != row and fit.cost < CLEARLY * best.cost + ROUNDING for fit, other, _ in found):
        return ""
    position, rotation = best.off(numbers)[row]
    return (
        f"pose {row + 1} alone is {in_mm(position)} and {np.rad2deg(rotation):.3g}° off, the others fit to "
        f"{in_mm(best.errors[0])} with {best.assumed}: check its numbers"
    )


def _how_near(refined: Sequence[_ConventionFit]) -> str:
    """The nearest reading, and how far each pose is off; empty where none reaches the poses."""
    if not refined:
        return ""
    best = min(refined, key=lambda f: f.cost)
    off = ", ".join(f"{1e3 * distance:.3g}" for distance, _ in best.off(best.typed))
    return f"the nearest is {off} mm off ({best.assumed}); "


def _steps(arm: ReducedArm, count: int) -> list[list[tuple[float, float]]]:
    """Signs and offsets to try for every joint."""
    turns = [k * 2.0 * np.pi / count for k in range(count)]
    return [[(s, o) for s in (1.0, -1.0) for o in ([0.0] if slides else turns)] for slides in arm.slides]


def _refined_fits(
    reading: TableReading, typed: Typed, count: int, maximum: int, distance: float
) -> list[_ConventionFit]:
    """Signs and offsets with which a reading comes near the poses."""
    arm = compile_arm(reading.robot)
    q, poses = typed.q[:, arm.columns], typed.poses
    if np.linalg.norm(poses[:, :3, 3], axis=1).max() > 1.05 * max(arm.length, 1e-9):
        return []
    choices = _steps(arm, count)
    half = arm.dof // 2
    first = _products(arm, q, range(half), choices, np.array(arm.constants[0]))
    last = _products(arm, q, range(half, arm.dof), choices, np.eye(4))
    wanted = _features(se3.inverse(first) @ poses, arm.length)
    offered = _features(last, arm.length)
    pairs = _nearest(wanted, offered, maximum, distance)
    if not len(pairs):
        return []
    grid = [np.array(list(product(*choices[a:b]))) for a, b in ((0, half), (half, arm.dof))]
    chosen = np.concatenate([grid[0][pairs[:, 0]], grid[1][pairs[:, 1]]], axis=1)
    signs, offsets, errors = _refined(arm, q, poses, chosen[..., 0], chosen[..., 1])
    places = arm.places
    return [
        _ConventionFit(reading, typed, s[places], o[places], (float(e[0]), float(e[1])))
        for s, o, e in zip(signs, offsets, errors, strict=True)
    ]


def _products(arm: ReducedArm, q: np.ndarray, joints: range, choices, start: np.ndarray) -> np.ndarray:
    """Products over some joints for every choice (c, m, 4, 4), the first joint's choice varying slowest."""
    out = np.broadcast_to(start, (1, len(q), 4, 4))
    for k in joints:
        steps = np.stack([_moved(arm, k, s * q[:, k] + o) for s, o in choices[k]])
        out = (out[:, None] @ (steps @ arm.constants[k + 1])[None]).reshape(-1, len(q), 4, 4)
    return out


def _moved(arm: ReducedArm, joint: int, value: np.ndarray) -> np.ndarray:
    axis = np.array([0.0, 0.0, 1.0])
    if arm.slides[joint]:
        return se3.pose(np.eye(3), axis * value[:, None])
    return se3.pose(se3.rotvec_to_matrix(axis * value[:, None]), np.zeros((len(value), 3)))


def _features(poses: np.ndarray, length: float) -> np.ndarray:
    """Poses (c, m, 4, 4) as points whose distances are those of poses."""
    parts = [WEIGHT * poses[..., :3, :3].reshape(*poses.shape[:2], 9), poses[..., :3, 3] / length]
    return np.concatenate(parts, axis=-1).reshape(len(poses), -1).astype(np.float32)


def _nearest(wanted: np.ndarray, offered: np.ndarray, maximum: int, farthest: float) -> np.ndarray:
    """The pairs of points that are next to each other (b, 2)."""
    found: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    size = (offered**2).sum(1)
    for start in range(0, len(wanted), BLOCK):
        block = wanted[start : start + BLOCK]
        distance = size - 2.0 * block @ offered.T + (block**2).sum(1)[:, None]
        near = np.flatnonzero(distance < farthest**2)
        if len(near) > maximum:
            near = near[np.argpartition(distance.ravel()[near], maximum - 1)[:maximum]]
        rows, columns = np.divmod(near, len(offered))
        found.append((distance.ravel()[near], rows + start, columns))
    distance, rows, columns = (np.concatenate(parts) for parts in zip(*found, strict=True))
    order = np.argsort(distance)[:maximum]
    return np.column_stack([rows[order], columns[order]])


def _refined(arm: ReducedArm, q, poses, signs, offsets) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All candidates refined in the offsets; errors are the maximum of each (c, 2)."""
    count, (m, n) = len(signs), q.shape
    scale = np.repeat([1.0, WEIGHT * arm.length], 3)

    def linearise(o):
        x = (signs[:, None] * q + o[:, None]).reshape(-1, n)
        tool, axes, points = arm.geometry(x)
        full = np.tile(np.eye(4), (len(x), 1, 1))
        full[:, :3] = tool
        error = se3.pose_error(np.tile(poses, (count, 1, 1)), full)
        lever = np.cross(axes, tool[:, None, :, 3] - points)
        slides = arm.slides[None, :, None]
        jacobian = np.concatenate([np.where(slides, axes, lever), np.where(slides, 0.0, axes)], -1) * scale
        return (error * scale).reshape(count, -1), jacobian.swapaxes(1, 2).reshape(count, 6 * m, n)

    (offsets,), left = descend((offsets,), linearise, lambda o, step: (o + step,), steps=30)
    error = left.reshape(count, m, 6) / scale
    turned = np.where(arm.slides, offsets, (offsets + np.pi) % (2.0 * np.pi) - np.pi)
    maximum = [np.linalg.norm(error[..., part], axis=2).max(1) for part in PARTS]
    return signs, turned, np.stack(maximum, axis=1)


PARTS = (slice(0, 3), slice(3, 6))


def _refit(fit: _ConventionFit, signs: np.ndarray, offsets: np.ndarray) -> _ConventionFit:
    """The same reading with other signs, its offsets refined from others."""
    arm = compile_arm(fit.reading.robot)
    order = arm.columns
    q = fit.typed.q[:, order]
    _, found, errors = _refined(arm, q, fit.typed.poses, signs[None, order], offsets[None, order])
    return replace(
        fit, signs=signs, offsets=found[0][arm.places], errors=(float(errors[0, 0]), float(errors[0, 1]))
    )


def _turned_back(best: _ConventionFit) -> Iterator[_ConventionFit]:
    """The best fit with one joint after the other counting the other way about its middle."""
    middle = best.typed.q.mean(0)
    for k in range(len(best.signs)):
        flip = np.where(np.arange(len(best.signs)) == k, -1.0, 1.0)
        offsets = best.offsets + np.where(flip < 0, 2.0 * best.signs * middle, 0.0)
        yield _refit(best, best.signs * flip, offsets)


def _same(a: _ConventionFit, b: _ConventionFit) -> bool:
    """Whether two fits are one arm: the same poses for the same numbers, wherever they are."""
    if a.typed is not b.typed and not np.allclose(a.typed.q, b.typed.q):
        return False
    rng = np.random.default_rng(0)
    low, high = a.reading.robot.search_limits.T
    q = rng.uniform(low, high, (20, len(low)))
    length = compile_arm(b.reading.robot).length
    difference = a.at(q) - b.at(q)
    return bool(
        np.abs(difference[..., 3]).max() < SAME_READING * length
        and np.abs(difference[..., :3]).max() < SAME_READING / WEIGHT
    )


def _snapped(fit: _ConventionFit) -> _ConventionFit:
    """Offsets that are quarter turns but for rounding made exactly that, where the fit stays as good."""
    arm = compile_arm(fit.reading.robot)
    slides = arm.slides[arm.places]
    quarters = np.where(slides, 0.0, np.round(fit.offsets / (0.5 * np.pi)) * 0.5 * np.pi)
    near = np.abs(fit.offsets - quarters) < np.where(slides, 0.01 * arm.length, np.deg2rad(2.0))
    offsets = np.where(near, quarters, fit.offsets)
    offsets = np.where(np.abs(offsets + np.pi) < FIXED, np.pi, offsets)
    trial = replace(fit, offsets=offsets)
    position, rotation = trial.off(fit.typed).max(0).tolist()
    trial = replace(trial, errors=(position, rotation))
    return trial if trial.cost <= max(1.5 * fit.cost, ROUNDING) else fit


def _undecided(best: _ConventionFit, rivals: list[_ConventionFit]) -> str:
    """What fits as well, and what would tell."""
    still = [k for k in range(len(best.signs)) if np.ptp(best.typed.q[:, k]) < np.deg2rad(5.0)]
    if still:
        names = ", ".join(str(k + 1) for k in still)
        return (
            f"the poses leave open how joint {names} counts, as it hardly moves between them; add a pose "
            "with it moved by 30° or more"
        )
    texts = dict.fromkeys(_assumed(f) for f in (best, *rivals))
    shown = "; or ".join(list(texts)[:3])
    return f"{len(texts)} readings give the typed poses and differ elsewhere: {shown}; add another pose"


def _assumed(fit: _ConventionFit) -> str:
    flips = ", ".join(str(k + 1) for k in np.flatnonzero(fit.signs < 0)) or "none"
    offsets = ", ".join(f"{np.rad2deg(o):.1f}" for o in fit.offsets)
    return f"{fit.assumed}, joints reversed: {flips}, offsets {offsets}°"
