"""Unknown parts of base and tool: as stated in the robot's file, or decided from the data and reported.

Where the file says `auto`, models of increasing freedom are fitted (frames as given, base free, tool free
too, base or tool per session), and the simplest one is taken that no freer one beats significantly (F test
of the residuals). Unobservable parts are never freed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial

import numpy as np
from scipy import linalg, special

from workbench.arm.frame import FRAME_PARTS
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.progress import cancelled
from workbench.base.types import Freedom
from workbench.base.wording import in_mm, plural
from workbench.data.dataset import Dataset
from workbench.data.prediction import predict
from workbench.identification.algorithms.identifier import SearchOutcome, factor_of
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.alignment import MAX_ALIGNED_ROWS, align, spread_rows
from workbench.identification.errors.expected_deviation import USUAL_DEVIATION, expected_deviation
from workbench.identification.errors.row_errors import Errors, Spread, count_measured, row_errors
from workbench.identification.fit_choices import FitChoices, Sessions
from workbench.identification.frame_freedom import moved_robot
from workbench.identification.prior import Prior
from workbench.identification.problem import FrameFreedom, Problem
from workbench.identification.problem_blocks import carried, of_rows
from workbench.identification.undetermined_combinations import RANK_TOLERANCE, Factor

SIGNIFICANCE = 1e-4
"""Significance level at which a freer model is taken …"""
PROMISING = 0.05
"""… and at which, by its linearisation, it is fitted at all."""
CERTAINLY, ROUNDING = 1e-12, 1e-12
"""Significance level at which no simpler model is fitted, and residual variance that is rounding."""
STRANGE_ANGLE, STRANGE_LENGTH = np.deg2rad(10.0), 0.02
"""Corrections of the arm beyond these are implausible: more likely the tool differs from the file."""
MAX_BASE_ERROR_RATIO = 10.0
"""A base declared as known is refused if its error is this many times that of a free one …"""
CLEAR_SHARE_OF_REACH = 0.05
"""… and exceeds this share of the arm's reach."""
NEGLIGIBLE, ALIKE = 1e-4, 1.3
"""Errors [m] of which nothing is said, and the ratio of errors within which one frame alone explains them."""


@dataclass(frozen=True, eq=False)
class FrameChoice:
    """The decision.

    Args:
        robot: The nominal arm with its frames aligned to the rows.
        freedom: What is identified with it.
        notes: The decisions, one sentence each.
        first: Problem and search that decided, if made on all rows with equal shares: the first of what is
            then identified.
    """

    robot: Robot
    freedom: FrameFreedom
    notes: tuple[str, ...]
    first: tuple[Problem, SearchOutcome] | None = None


def choose_frames(
    robot: Robot,
    data: Dataset,
    choices: FitChoices = FitChoices(),  # noqa: B008 frozen
    *,
    free: tuple[str, ...] | None = None,
    effects: tuple[str, ...] = (),
    prior: Prior | None = None,
) -> FrameChoice:
    """Decide what of base and tool is identified, with these constants of the nominal arm and coefficients of
    its effects, and align it; its frames say fixed, free or auto."""
    noise, known = choices.noise, choices.known
    candidates = _candidates(robot, data, Sessions(choices.frames), known)
    trial, several = of_rows(data, spread_rows(data, MAX_ALIGNED_ROWS)), len(data.sessions) > 1
    (chosen, text), aligned = candidates[0], None
    first: tuple[Problem, SearchOutcome] | None = None
    if len(candidates) > 1:
        build = partial(Problem.build, noise=noise, free=free, effects=effects, known=known)

        @cache
        def tried(freedom: FrameFreedom, text: str) -> _FrameTrial:
            arm = align(robot, trial, freedom, noise=noise, known=known)
            problem = build(arm, trial, frames=freedom).with_shares()
            return _FrameTrial(arm, text, problem if prior is None else prior.on(problem))

        *simpler, freest = candidates
        taken, widest = tried(*candidates[0]), None if several else freest[0]
        may_win = cache(lambda trial, freedom: trial.may_be_beaten(freedom, prior, widest))
        if widest and (taken.is_far or any(may_win(taken, freedom) for freedom, _ in candidates[1:])):
            candidates = [*(c for c in simpler if not tried(*freest).is_needed(robot, c[0])), freest]
            taken = tried(*candidates[0])
        for candidate in candidates[1:]:
            if cancelled():
                break
            if may_win(taken, candidate[0]) and (new := tried(*candidate)).beats(taken):
                taken = new
        chosen, text = taken.problem.frames, f"{taken.text} (decided from the data)"
        if len(trial) == len(data):
            is_first = taken.search.outcome.ok and taken.problem.shares is None and data.readings is None
            aligned, first = taken.aligned, (taken.problem, taken.search) if is_first else None
    aligned = aligned or align(robot, data, chosen, noise=noise, known=known)
    notes = [text, *(_where_the_base_is(robot, aligned) if chosen.base else ())]
    if choices.levelled:
        chosen, first = replace(chosen, levelled=True), None
        aligned = moved_robot(aligned, chosen, data.sessions, {})
    return FrameChoice(aligned, chosen, tuple(notes), first)


def visible_parts(
    data: Dataset, known: Mapping[str, float] | None = None
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Parts of base and tool that are observable in the rows."""
    kinds = carried(data)
    places = ({*kind.of(data.take(own)).unknowns} for kind, own in kinds.items() if known)
    fixed = any(all(n in (known or ()) or n.endswith(".zero") for n in names) for names in places)
    base = FRAME_PARTS if any(kind.sees_base for kind in kinds) or fixed else ()
    if any(kind.sees_tool_rotation for kind in kinds):
        return base, FRAME_PARTS
    without = all(kind.is_tool_free or not kind.sees_tool for kind in kinds)
    return base, () if without else FRAME_PARTS[:3]


def _candidates(
    robot: Robot, data: Dataset, sessions: Sessions, known: Mapping[str, float]
) -> list[tuple[FrameFreedom, str]]:
    """Models of increasing freedom, as far as the robot's file and the user allow."""
    base_parts, tool_parts = visible_parts(data, known)
    several = len(data.sessions) > 1

    def levels(freedom: Freedom, parts: tuple[str, ...]) -> list[int]:
        """0 known, 1 free, 2 free per session."""
        if freedom is Freedom.FIXED or not parts:
            return [0]
        every = [0, 1, 2] if several and sessions is not Sessions.SHARED else [0, 1]
        return every[freedom is Freedom.FREE :]

    base_levels, tool_levels = levels(robot.base.free, base_parts), levels(robot.tool.free, tool_parts)
    if several and sessions is Sessions.PER_SESSION:
        base_levels = base_levels[-1:]
    pairs = [(b, t) for b in base_levels for t in tool_levels if t < 2 or b == 2 or b == base_levels[-1]]
    pairs.sort(key=lambda pair: (pair[0] + pair[1], pair[1]))
    labels = ("as given", "identified", "identified for every session")
    return [
        (
            FrameFreedom(base_parts if b else (), tool_parts if t else (), b == 2, t == 2),
            f"base {labels[b]}, tool {labels[t]}",
        )
        for b, t in pairs
    ]


@dataclass(frozen=True, eq=False)
class _FrameTrial:
    """A geometric fit with certain frames free, starting from the nominal arm aligned with them.

    Args:
        aligned: That arm.
        text: Which frames are free.
        freer: Freer models linearised at its solution.
    """

    aligned: Robot
    text: str
    problem: Problem
    freer: dict[FrameFreedom, tuple[Problem, Factor]] = field(default_factory=dict)

    @cached_property
    def is_far(self) -> bool:
        """Whether the nominal arm is off by more than manufacturing errors are: frames are elsewhere."""
        off = self.problem.physical(self.problem.evaluate(self.problem.start).residual)
        most = zip(self.problem.channels, (STRANGE_LENGTH, STRANGE_ANGLE, STRANGE_ANGLE), strict=True)
        return any((off[mine] ** 2).sum() > mine.sum() * size**2 for mine, size in most)

    @cached_property
    def search(self) -> SearchOutcome:
        """Its solution."""
        return Opt2(limit=40).search(self.problem)

    @cached_property
    def factor(self) -> Factor:
        """Linearisation there."""
        return self.search.factor or factor_of(self.problem, self.problem.evaluate(self.search.x))

    @cached_property
    def strangeness(self) -> float:
        """Largest correction of the arm in units of what is implausible."""
        kinds = [p.unit == "rad" for p in self.problem.parameters]
        moved = np.abs(self.search.x - self.problem.start) / np.where(kinds, STRANGE_ANGLE, STRANGE_LENGTH)
        return float(moved[self.problem.geometry].max(initial=0.0))

    @cached_property
    def expected_deviation(self) -> float:
        """How far from nominal the rows let the arm's constants be expected with these frames [rad, m]."""
        return max(expected_deviation(self.problem)[0], USUAL_DEVIATION)

    def beats(self, other: "_FrameTrial") -> bool:
        """Whether this freer model is significantly better than the other.

        If the other needs corrections of the arm that can't be manufacturing errors (a tool offset appears in
        the last joint, a base offset in the first) and this one far smaller ones, or the nominal arm itself
        is far nearer with it, it is taken whatever the F test says: with few rows, one bad row, or where both
        fits wander, the test has no power.
        """
        if other.strangeness > 1.0 and (
            self.strangeness < 0.5 * other.strangeness
            or self.expected_deviation < 0.5 * other.expected_deviation
            or self.search.history[0] < 0.25 * other.search.history[0]
        ):
            return True
        return _chance(other, self.problem, self.factor, 2.0 * self.search.history[-1]) < SIGNIFICANCE

    def is_needed(self, given: Robot, simpler: FrameFreedom) -> bool:
        """Whether the frames that a simpler model has as given are certainly elsewhere, by linearisation."""
        off, arm = dict[str, float](), self.problem.robot_at(self.search.x)
        for kind in (kind for kind in ("base", "tool") if not getattr(simpler, kind)):
            found, was = getattr(arm, kind), getattr(given, kind)
            moved = *(was.xyz - found.xyz), *se3.matrix_to_rotvec(found.rotation.T @ was.rotation)
            off |= zip((f"{kind}.{part}" for part in FRAME_PARTS), moved, strict=True)
        held = np.array([name in off for name in self.problem.names])
        others = linalg.orth(self.factor.r[:, ~held], rcond=RANK_TOLERANCE)
        more = self.factor.r[:, held] @ np.array([off[n] for n in self.problem.names if n in off])
        more = more - others @ (others.T @ more)
        gained, left = self.factor.rank - others.shape[1], self.problem.count - self.factor.rank
        if self.strangeness > 1.0 or gained <= 0 or left <= 0 or not self.search.outcome.ok:
            return False
        ratio = (more @ more / gained) / (2.0 * self.search.history[-1] / left + ROUNDING)
        return bool(special.fdtrc(gained, left, ratio) < CERTAINLY)

    def may_be_beaten(self, freedom: FrameFreedom, prior: Prior | None, widest: FrameFreedom | None) -> bool:
        """Whether a freer model can be better, judged by its linearisation at this one's solution, which is
        part of that of the widest one where all have the same unknowns by name."""
        if self.strangeness > 1.0:
            return True
        if (wide := widest or freedom) not in self.freer:
            found = self.problem.named(self.search.x)
            arm = None if widest else self.problem.robot_at(self.search.x)
            problem = self.problem.again(robot=arm, frames=wide).with_shares()
            x = problem.at(found if widest else self.problem.instrument(self.search.x))
            problem = problem if prior is None else prior.on(problem)
            self.freer[wide] = problem, factor_of(problem, problem.evaluate(x))
        problem, factor = self.freer[wide]
        held = tuple(f"{kind}." for kind, parts, _ in freedom.by_frame if not parts)
        if held:
            factor = factor.only(np.array([not name.startswith(held) for name in problem.names]))
        square = factor.residual_square - float(factor.compressed @ factor.compressed)  # the least
        if _chance(self, problem, factor, square) < PROMISING:
            square = factor.residual_square - factor.predicted_decrease()
        return _chance(self, problem, factor, square) < PROMISING


def _chance(held: _FrameTrial, freer: Problem, factor: Factor, square: float) -> float:
    """Probability that a freer model leaves no more than this |r|² where the held frames are right."""
    size, before = freer.count + len(freer.prior), 2.0 * held.search.history[-1]
    gained = int(np.sum(factor.visible)) - int(np.sum(held.factor.visible))  # however weakly
    left, rounding = size - factor.rank, 1e-16 * size
    if gained <= 0 or left <= 0 or before <= rounding:
        return 1.0
    ratio = (max(before - square, 0.0) / gained) / max(square / left, rounding)
    return float(special.fdtrc(gained, left, ratio))


def check_known_base(
    robot: Robot, freedom: FrameFreedom, data: Dataset, errors: Errors, choices: FitChoices
) -> None:
    """Refuse a base declared as known that is elsewhere, and report where it is.

    Args:
        freedom: Of the arm aligned by its tool, as far as that is free, with the base as given.
        errors: Of that arm on these rows.
    """
    noise, known, off = choices.noise, choices.known, Spread.of(errors.position).rms
    base, tool = visible_parts(data, known)
    if freedom.base or not base or not off > CLEAR_SHARE_OF_REACH * robot.reach:
        return
    data = of_rows(data, spread_rows(data, MAX_ALIGNED_ROWS))
    own = freedom.tool or (tool if robot.tool.free is not Freedom.FIXED else ())
    for moved, parts in dict.fromkeys((("[base]", own), ("[base] and [tool]", tool))):
        aligned = align(robot, data, replace(freedom, base=base, tool=parts), noise=noise, known=known)
        best = Spread.of(row_errors(aligned, data, known=known).position).rms
        measured, unknown = count_measured(data), len(base) + len(parts)
        if not off > MAX_BASE_ERROR_RATIO * best:
            continue
        if measured <= unknown:
            few = f"{plural(len(data), 'row')} can't tell the {unknown} unknowns of base and tool"
            few += f"; measure at least {unknown * len(data) // measured + 1} poses"
            raise DataError(f"{data.source}: {few}", column="base")
        where = "; ".join(_where_the_base_is(robot, aligned)) or "elsewhere"
        raise DataError(
            f"{data.source}: the nominal arm is off by {1e3 * off:.0f} mm with {moved} as given, by "
            f"{1e3 * best:.1f} mm with another ({where}); choose the robot that was measured, or "
            f"correct {moved} in its file, or set free = true there",
            column="base",
        )


def doubt_of(robot: Robot, data: Dataset, errors: Errors, fitted: int) -> tuple[str, bool]:
    """What makes errors tell little of an arm, of which so many unknowns of base and tool were fitted, and
    whether the rows are hardly its own; empty if nothing does."""
    if fitted and count_measured(data) <= fitted:
        return f"{plural(len(data), 'row')} can't tell the {fitted} unknowns of base and tool", False
    off, turned = (Spread.of(each).rms for each in (errors.position, errors.rotation))
    far, angles = CLEAR_SHARE_OF_REACH * robot.reach, " and {:.3g}°" if turned > STRANGE_ANGLE else ""
    if not (off > NEGLIGIBLE or angles):
        return "", False
    freedom = FrameFreedom(*visible_parts(data), base_per_session=len(data.sessions) > 1)
    placed = row_errors(align(robot, data, freedom), data)
    best, turn = (Spread.of(each).rms for each in (placed.position, placed.rotation))
    if best > far or turn > STRANGE_ANGLE:
        size = f"{in_mm(best)}{f' and {np.rad2deg(turn):.0f}°' if turn > STRANGE_ANGLE else ''}"
        return f"even the best base and tool leave {size} rms: the rows are hardly this arm's", True
    if not (off > min(far, MAX_BASE_ERROR_RATIO * best) or angles):
        return "", False
    moved = ""
    for name, alone in (("base", FrameFreedom(freedom.base)), ("tool", FrameFreedom(tool=freedom.tool))):
        arm = align(robot, data, alone)
        if not (moved or angles) and Spread.of(row_errors(arm, data).position).rms < ALIKE * best:
            if name == "base":
                shift = (predict(arm, data) - predict(robot, data))[:, :3, 3].mean(0)
            else:
                shift = arm.in_first_session.tool.xyz - robot.in_first_session.tool.xyz
            size = ", ".join(f"{1e3 * v:z.2f}" for v in shift)
            moved = f" (another {name} does: {size} mm in x, y, z from the file's)"
    now, was = (in_mm(e) + angles.format(np.rad2deg(a)) for e, a in ((best, turn), (off, turned)))
    return f"the best base and tool leave {now} rms{moved}, not {was}; fit them: --frames fit", False


def _where_the_base_is(robot: Robot, aligned: Robot) -> list[str]:
    """Description of a base found far from where the file has it."""
    given, found = robot.base, aligned.in_first_session.base
    turn = se3.matrix_to_rotvec(found.rotation @ given.rotation.T)
    angle, moved = float(np.linalg.norm(turn)), float(np.linalg.norm(found.xyz - given.xyz))
    if angle < np.deg2rad(2.0) and moved < 0.02:
        return []
    axis = int(np.argmax(np.abs(turn)))
    about = f" about {'xyz'[axis]}" if angle and abs(turn[axis]) > 0.99 * angle else ""
    which = f"base of session '{next(iter(aligned.sessions))}'" if aligned.sessions else "base"
    away = f"{np.rad2deg(angle):.1f}°{about} and {moved:.3f} m"
    return [f"{which}: rotated by {away} from its pose in the robot's file"]
