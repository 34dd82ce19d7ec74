"""Stepwise identification from pictures: parameters are freed only as far as the pictures support them.

First camera and target alone, then the joints' zeros, then the arm's geometry, then effects beside it, where
geometry leaves more than chance. Each step is assessed in mm at the tool, excluding frames: with Σ the
covariance of the arm's constants and J̃ their effect on the tool's positions at the measured poses, less what
a base and a tool frame could do as well,

    uncertainty² = mean tr(J̃ Σ J̃ᵀ),    moved² = mean |J̃ d|²,    d = change of the constants

A step is taken if the pictures speak for it (`Likelihood.evidence`): twice the log likelihood must rise by
so much for each of them, on average, when its constants are let go about nominal. All pictures are weighed
together, so that two halves of them decide alike. Besides, pictures of whole blocks of joint space must be
predicted better without having been fitted. Where the pictures contradict fixed intrinsics, these are let go
first; where they contradict a target's size, no geometry is taken, and zeros count as uncertain by what that
bends them.

The uncertainty is the larger of that from the likelihood (`pixel_noise`) and of what the blocks, each left
out once, show; the geometry's prior is as wide as the pictures say.

Constants that stay as given are not known for that. With x̂ and Σ of the step that lets most go, any
other step's arm x is expected to be off by

    expected² = |J̃ (x̂ − x)|² + mean tr(J̃ Σ J̃ᵀ) + 3 s_p²,

J̃ at poses within 15 cm of the measured places in whatever orientation, s_p averaged over its likelihood.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.spatial.distance import cdist

from workbench.arm.frame import FRAME_PARTS
from workbench.arm.kinematics.forward import identification_jacobian, tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.wording import in_mm
from workbench.data.dataset import Dataset
from workbench.extras.camera.doubts import Doubts, PictureFit, find_doubts
from workbench.extras.camera.pixel_noise import FAR, MIN_SIZE, Likelihood, Pictures, Variances
from workbench.extras.camera.selection_steps import (
    EFFECTS,
    GEOMETRY,
    NEARBY,
    WOULD_DISTORT,
    ZEROS,
    Identifiability,
    Step,
    advised,
    judged,
)
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.consider_covariance import Considered
from workbench.identification.instrument_preparation import Seek
from workbench.identification.noise import factor_at
from workbench.identification.problem import Noise, Problem
from workbench.identification.rows.row_selection import cells

ROUNDS, TOLERANCE = 4, 0.03
"""Fits between which the variances are estimated anew, and their relative change that is none."""
SEARCHES = 3
"""Most searches for effects, each at the fit with those of the last one."""
FIRST_WIDTH = 3e-4
"""Width of the geometry's prior [m] from which its own is sought."""
BLOCKS = 10
"""Blocks of joint space that are left out in turns."""
CONFOUNDED = 1e-5
"""A constant whose column is this small after removing that of camera and target can't be separated from
them."""
DRAWN, OTHERS = 3000, 60
"""Joint positions that are drawn, and the fewest of them at which the error is expected."""
UNSEEN = 1e-9
"""Information that is left of an unknown, such as a board's place, which only the block left out shows."""


class Fitted(NamedTuple):
    """A step's problem, weighed, with its answer."""

    problem: Problem
    x: np.ndarray
    free: tuple[str, ...]
    noise: Noise
    is_lack_shown: bool
    shares: np.ndarray

    @property
    def arm(self) -> list[int]:
        """Places of the arm's constants among the unknowns."""
        return [self.problem.names.index(name) for name in self.free]

    @property
    def robot(self) -> Robot:
        """The arm with these constants, in the first session's frames."""
        return self.problem.robot_at(self.x).in_session(self.problem.data.sessions[0])

    def values(self, other: "Fitted") -> Float[np.ndarray, " arm"]:
        """Its values of the constants that another fit frees, nominal where it has none."""
        found, names = self.problem.named(self.x), other.problem.names
        return np.array([found.get(names[k], other.problem.start[k]) for k in other.arm], float)


class TriedStep(NamedTuple):
    """A step's numbers, its fit, and the covariance of that by likelihood and by the blocks."""

    step: Step
    at: Fitted
    covariance: np.ndarray
    left_out: np.ndarray


def select_camera_step(
    robot: Robot,
    data: Dataset,
    *,
    free: Sequence[str] | None = None,
    build: Callable[..., Problem] = Problem.build,
    seek: Seek | None = None,
) -> tuple[Problem, Identifiability]:
    """The problem of the last step that carries, weighed, and why.

    Args:
        free: Constants of the arm that may be freed at all; the robot's default ones if None.
        build: Makes the problem from robot, data and `free`.
        seek: Finds effects beside the geometry; None ends with the geometry.
    """
    chosen = list(robot.default_free if free is None else free)
    zeros = [n for n in robot.joint_offsets if n in chosen]
    begin = _alike(build(robot, data, free=()))
    hidden = _confounded(build(robot, data, free=tuple(zeros), noise=begin.noise)) if zeros else set()
    own = {ZEROS: zeros, GEOMETRY: chosen if set(chosen) - set(zeros) else []}
    known = {name: tuple(n for n in names if n not in hidden) for name, names in own.items()}
    fits = {name: names for name, names in known.items() if names and len(data) * 4 >= len(names)}
    seen = fits.get(ZEROS, ())
    widest = fits.get(GEOMETRY, seen)

    def free_of(rows: Dataset, names: tuple[str, ...]) -> tuple[Problem, Fitted]:
        problem = build(robot, rows, free=names, noise=begin.noise)
        return problem, _fitted(problem, tuple(n for n in names if n not in zeros))

    def weighed(rows: Dataset) -> PictureFit:
        problem, at = free_of(rows, widest)
        unlikelihood = Likelihood.at(problem, at.x, at.shares).unlikelihood(Variances(at.noise, FIRST_WIDTH))
        return PictureFit(at.problem, at.x, unlikelihood)

    doubted = find_doubts(weighed, data)
    if doubted.given is not data:
        data = doubted.given
        begin = _alike(build(robot, data, free=()))
    last, taken, at = begin.problem, begin, begin
    tried = [_tried("camera and target alone", begin, begin)]
    for name, names in fits.items():
        last, at = free_of(data if name == ZEROS else doubted.data, names)
        bends = None
        if doubted.off and name == ZEROS:
            bends = doubted.considered(build(robot, doubted.data, free=at.free, noise=at.noise))
        one = _tried(name, at, taken, bends, _evidence(last, at))
        step = judged(one.step, [t.step for t in tried], len(data))
        step = replace(step, refused=WOULD_DISTORT) if doubted.off and name == GEOMETRY else step
        tried.append(one._replace(step=step))
        if not step.refused:
            taken = at
    if seek is not None and tried[-1].step.name == GEOMETRY and at.is_lack_shown and not doubted.off:
        deflected = _with_effects(robot, data, last, at, zeros, build, seek)
        one = _tried(EFFECTS, deflected or at, taken)
        if deflected is None:
            lack = in_mm(one.step.lack)
            nothing = f"no effect of the arm stands out in the {lack} that the geometry leaves unexplained"
            step = replace(one.step, refused=nothing)
        else:
            step = judged(one.step, [t.step for t in tried], len(data))
        tried.append(one._replace(step=step))
        if not step.refused:
            at = taken = one.at
    steps = _expected(tried, robot, data)
    number = max(k for k, step in enumerate(steps) if not step.refused)
    advice = "" if doubted.off else advised(steps, number, data)
    if doubted.off and steps[-1].name != GEOMETRY:
        last = build(robot, doubted.data, free=seen, noise=begin.noise)
        at = _fitted(last, ())
    if at.free and not taken.free:
        at = _fitted(last, tuple(p.name for p in last.parameters if p.is_geometry))
    identifiability = Identifiability.of(
        steps,
        number,
        taken.noise,
        advice=advice,
        doubts=doubted.sentences,
        actual=None if taken.free else at.noise,
        considered=_considered(doubted, last, at, taken),
    )
    return taken.problem, identifiability


def _lengths(problem: Problem) -> Float[np.ndarray, " p"]:
    """Standard deviation of each unknown by which a tool would move by about 1 m."""
    reach = max(problem.robot.reach / 2.0, 0.1)
    return np.array([1.0 / reach if p.unit == "rad" else 1.0 for p in problem.parameters])


def _evidence(problem: Problem, at: Fitted) -> float:
    """How the pictures speak for a step's constants: for zeros where it frees no others."""
    shares = np.array([p.is_geometry for p in problem.parameters]) * _lengths(problem)
    likelihood = Likelihood.at(problem, at.x, at.shares if at.shares.any() else shares)
    return likelihood.evidence(Variances(at.noise, FIRST_WIDTH))


def _considered(doubted: Doubts, last: Problem, at: Fitted, taken: Fitted) -> Considered | None:
    """What stays as given though it is uncertain: geometry that is not taken, and what is contradicted."""
    deviations = np.zeros(len(at.x))
    if len(at.free) > len(taken.free):
        deviations = Likelihood.at(last, at.x, at.shares).mean_width(Variances(at.noise)) * at.shares
    elif not doubted.off:
        return None
    return doubted.considered(at.problem.with_noise(taken.problem.noise), deviations)


def _alike(problem: Problem) -> Fitted:
    """Fit of camera and target alone, all corners weighed alike: what they leave tells of the arm."""
    problem = problem.with_noise(Noise(0.0, 0.0, (), problem.noise.own))
    x = Opt2(limit=60).search(problem).x
    found = Likelihood.at(problem, x).most_likely(Variances(Noise(1e-3, 1e-3, (), problem.noise.own)))
    return Fitted(problem, x, (), found.noise, found.is_shown, np.zeros(len(x)))


def _fitted(problem: Problem, shrunk: tuple[str, ...]) -> Fitted:
    """Fit and variances in turns; the shrunk constants get a prior about nominal as wide as is likely."""
    shares = np.array([p.name in shrunk for p in problem.parameters]) * _lengths(problem)
    inside = shares > 0.0
    names = [p.name for p in problem.parameters if p.name in shrunk]
    now, x, found = problem, problem.start, Variances(problem.noise, FIRST_WIDTH)
    for _ in range(ROUNDS):
        if shrunk:
            wall = np.diag(1.0 / (max(found.width, MIN_SIZE[3]) * shares[inside]))
            now = problem.with_noise(now.noise).with_prior(names, problem.start[inside], wall)
        x = Opt2(limit=60).search(now, begin=x).x
        found = Likelihood.at(problem, x, shares).most_likely(found)
        old, now = now.noise, now.with_noise(found.noise)
        if np.allclose(now.noise[:2], old[:2], rtol=TOLERANCE, atol=1e-6) and np.isclose(
            now.noise.own, old.own, rtol=TOLERANCE
        ):
            break
    free = tuple(p.name for p in problem.parameters if p.is_geometry or p.is_coefficient)
    return Fitted(now, x, free, now.noise, found.is_shown, shares)


def _with_effects(
    robot: Robot,
    data: Dataset,
    problem: Problem,
    at: Fitted,
    zeros: Sequence[str],
    build: Callable[..., Problem],
    seek: Seek,
) -> Fitted | None:
    """A fit of geometry and of the effects that it leaves unexplained; None where none stands out."""
    names = tuple(p.name for p in problem.parameters if p.is_geometry)
    shrunk = tuple(n for n in names if n not in zeros)
    before: tuple[str, ...] = ()
    now = at
    own = tuple(p.name for p in problem.parameters if p.is_coefficient)
    for _ in range(SEARCHES):
        effects = seek(robot, now.problem, now.x)
        found = tuple(n for e in effects for n in e.names)
        if not found:
            return None
        if set(found) == set(before):
            break
        arm = robot.with_effects(*robot.effects, *effects)
        deflected = build(arm, data, free=names, noise=now.noise, effects=(*own, *found))
        before, now = found, _fitted(deflected, shrunk)
    return now


def _confounded(problem: Problem) -> set[str]:
    """Constants of the arm that camera and target can do as well, such as the first joint's zero."""
    jacobian = problem.evaluate(problem.start).jacobian * problem.units
    arm = np.array([p.is_geometry for p in problem.parameters])
    q, _ = np.linalg.qr(jacobian[:, ~arm])
    left = jacobian[:, arm] - q @ (q.T @ jacobian[:, arm])
    small = np.linalg.norm(left, axis=0) < CONFOUNDED * np.linalg.norm(jacobian[:, arm], axis=0)
    return set(np.array(problem.names)[arm][small].tolist())


class Effect(NamedTuple):
    """What changes of the arm's constants do at the tool, frames aside: |J̃ d|² = dᵀ M d, mean over poses."""

    position: Float[np.ndarray, "k k"]
    rotation: Float[np.ndarray, "k k"]

    @classmethod
    def of(cls, robot: Robot, motion: Motion, names: tuple[str, ...]) -> "Effect":
        """Of some constants at some poses."""
        if not names:
            return cls(np.zeros((0, 0)), np.zeros((0, 0)))
        mine, frames = columns(robot, motion, names)
        found = []
        for axes in (slice(0, 3), slice(3, 6)):
            flat, frame = mine[:, axes].reshape(-1, len(names)), frames[:, axes].reshape(-1, frames.shape[2])
            left = flat - frame @ by_frames(flat, frame)
            found.append(left.T @ left / len(mine))
        return cls(*found)


def columns(robot: Robot, motion: Motion, names: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Twists of the tool by constants of the arm, and by a base and a tool frame."""
    frames = tuple(f"{kind}.{part}" for kind in ("base", "tool") for part in FRAME_PARTS)
    twists = identification_jacobian(robot, motion, (*names, *frames))[1]
    return twists[:, :, : len(names)], twists[:, :, len(names) :]


def by_frames(mine: Float[np.ndarray, "n k"], frames: Float[np.ndarray, "n f"]) -> Float[np.ndarray, "f k"]:
    """What of the frames does most of what the constants do."""
    return np.linalg.lstsq(frames, mine, rcond=1e-10)[0]


def _other_poses(robot: Robot, data: Dataset) -> Motion:
    """Random joint positions at which the tool is near to where it was measured, in any orientation."""
    rng, measured, (low, high) = np.random.default_rng(0), Motion.of(data), robot.search_limits.T
    q = rng.uniform(low, high, (DRAWN, robot.dof))
    motion = replace(measured.take(rng.integers(0, len(measured), DRAWN)), q=q)
    distance = cdist(*(tool_poses(robot, each)[:, :3, 3] for each in (motion, measured))).min(1)
    return motion.take(np.flatnonzero(distance <= max(NEARBY, np.sort(distance)[OTHERS])))


def _expected(tried: Sequence[TriedStep], robot: Robot, data: Dataset) -> list[Step]:
    """The steps with the error of the tool that each leaves at other poses, by what the last one knows."""
    last = [t for t in tried if t.step.name != EFFECTS or not t.step.refused][-1]
    at = last.at
    poses = _other_poses(robot.in_session(data.sessions[0]), data)
    effect = Effect.of(at.robot, poses, at.free).position
    square = max(np.sum(effect * c[np.ix_(at.arm, at.arm)]) for c in last[2:])
    square += 3.0 * Likelihood.at(at.problem, at.x).mean_lack(Variances(at.noise)) ** 2
    steps = []
    for step, each, *_ in tried:
        off = at.x[at.arm] - each.values(at)
        steps.append(replace(step, expected=float(np.sqrt(max(square + off @ effect @ off, 0.0)))))
    return steps


def _tried(
    name: str, at: Fitted, before: Fitted, bends: Considered | None = None, speaks: float = 0.0
) -> TriedStep:
    """A step and its numbers, against the one that was taken before; `bends` adds to its uncertainty."""
    problem, x, arm = at.problem, at.x, at.arm
    effect = Effect.of(at.robot, Motion.of(problem.data), at.free)
    covariance, left_out, pixel = _left_out(problem, x)
    if bends is not None:
        covariance += bends.covariance(problem.names, x, factor_at(problem, x).root)
    change = np.zeros(len(arm)) if before is at else x[arm] - before.values(at)
    wide = [np.sum(m * c[np.ix_(arm, arm)]) for m in effect for c in (covariance, left_out)]
    lever = Pictures.at(before.problem, before.x).lever
    uncertainty, turned = (float(np.sqrt(max(*pair, 0.0))) for pair in (wide[:2], wide[2:]))
    each = np.diag(effect.position @ covariance[np.ix_(arm, arm)])
    step = Step(
        name=name,
        free=at.free,
        pixel=pixel,
        moved=float(np.sqrt(max(change @ effect.position @ change, 0.0))),
        uncertainty=uncertainty,
        turned=turned,
        lack=float(np.sqrt(3.0) * at.noise.position),
        lack_seen=float(np.sqrt(3.0) * np.hypot(at.noise.position, lever * at.noise.rotation)),
        uncertainty_seen=float(np.hypot(uncertainty, lever * turned)),
        evidence=speaks,
        weakest=at.free[int(np.argmax(each))] if at.free else "",
    )
    return TriedStep(step, at, covariance, left_out)


def _left_out(problem: Problem, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Covariance by likelihood, by blocks that are left out in turns, and the error of these blocks [px].

    Corners of a board or camera that only the block left out shows are not predicted: they don't count,
    unless there are no others.
    """
    at = problem.evaluate(x)
    known = np.diag((FAR * problem.units) ** -2)
    h = at.jacobian.T @ at.jacobian + known
    block = np.zeros(len(problem.data), int)
    centre = problem.data.q / np.maximum(np.ptp(problem.data.q, axis=0), 1e-9)
    for k, rows in enumerate(cells(centre, np.arange(len(centre)), min(BLOCKS, len(centre)))):
        block[rows] = k
    count = int(block.max()) + 1
    of_component = np.concatenate(
        [block[problem.component_rows], np.full(len(at.residual) - problem.size, -1)]
    )
    off, predicted = [], []
    whole = np.diag(h)
    for k in range(count):
        mine = of_component == k
        j, r = at.jacobian[mine], at.residual[mine]
        rest = h - j.T @ j
        shown = np.diag(rest) > UNSEEN * whole
        step = np.zeros(len(x))
        step[shown] = -np.linalg.solve(rest[np.ix_(shown, shown)], (j.T @ r)[shown])
        off.append(step)
        pixel = problem.physical(np.where(mine, at.residual - at.jacobian @ step, 0.0)[: problem.size])
        judged = (mine[: problem.size]) & (problem.inverse_sigma > 0.0)
        own = judged & ~at.jacobian[: problem.size, ~shown].any(1)
        predicted.append(float((pixel[own if own.any() else judged] ** 2).mean()))
    spread = np.array(off)
    left_out = (count - 1) / count * spread.T @ spread
    return np.linalg.inv(h), left_out, float(np.sqrt(2.0 * np.median(predicted)))
