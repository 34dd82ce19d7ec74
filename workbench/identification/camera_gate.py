"""The gate of what pictures may identify: freedom grows only as far as it carries.

First camera and target alone, then the joints' zeros, then the arm's geometry, then effects beside it, where
geometry leaves more than chance. Each step is weighed in mm at the tool, frames aside: with Σ the covariance
of the arm's constants and J̃ their effect on the tool's positions at the measured poses, less what a base and
a tool frame could do as well,

    uncertainty² = mean tr(J̃ Σ J̃ᵀ),    moved² = mean |J̃ d|²,    d = change of the constants

A step is taken if it moves the tool by clearly more than it is uncertain, if pictures of whole blocks of
joint space are predicted better without having been fitted, and, from the geometry on, if little is left
unexplained: a camera, a target or a clock that is wrong bends the geometry to fit the pictures, and the arm
ends worse than it began. The uncertainty is the larger of that from the likelihood (`picture_noise`) and of
what the blocks, each left out once, show; the geometry's prior is as wide as the pictures say.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from workbench.arm.effects import AbstractEffect
from workbench.arm.kinematics.forward import sensitivity
from workbench.arm.motion import Motion
from workbench.arm.robot import FRAME_PARTS, Robot
from workbench.data.dataset import Dataset
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.camera_checks import Fit, doubts
from workbench.identification.held_out_rows import cells
from workbench.identification.picture_noise import (
    FAR,
    LEAST,
    Considered,
    Knowledge,
    Pictures,
    Variances,
    mean_width,
    most_likely,
)
from workbench.identification.problem import Noise, Problem

ZEROS, GEOMETRY, EFFECTS = "joint zeros", "geometry", "geometry and effects"
ROUNDS, TOLERANCE = 4, 0.03
"""Fits between which the variances are estimated anew, and their relative change that is none."""
SEARCHES = 3
"""Most searches for effects, each at the fit with those of the last one."""
FIRST_WIDTH = 3e-4
"""Width of the geometry's prior [m] from which its own is sought."""
BLOCKS = 10
"""Blocks of joint space that are left out in turns."""
CLEARLY = 2.0
"""A step must move the tool by so many times what it is uncertain, in squares."""
UNEXPLAINED = 0.4
"""Part of the tool's error before, that may be left unexplained where the geometry is taken."""
WORTHWHILE = 0.9
"""Part of the expected error that a step may leave: what else bends zeros lowers it a little too."""
HINTED = 0.5
"""More pictures are advised for a step that moves the tool by this part of what it is uncertain."""
MEANINGLESS = 1e-5
"""Errors of the tool below this [m] are none."""
CONFOUNDED = 1e-5
"""A constant whose column is this small beside what camera and target do alone can't be told from them."""
OUT_OF_LINE, FAR_OFF = 6.0, 2e-3
"""Pictures this many times the median off, and so many m, don't suit their joints."""


Seek = Callable[[Robot, Problem, np.ndarray], tuple[AbstractEffect, ...]]
"""Finds the effects of an arm that a problem's answer leaves unexplained."""


@dataclass(frozen=True, eq=False)
class Step:
    """One step of the gate.

    Args:
        name: What it frees beside camera and target.
        free: Constants of the arm that it frees.
        pixel: Error of corners in blocks that were not fitted [px, root mean square of a coordinate].
        moved: Distance that it moves the tool [m], from the step before that was taken.
        uncertainty: Of the tool's position from the uncertainty of its constants [m].
        turned: Of the tool's orientation [rad].
        lack: Distance of the tool [m] that the model leaves unexplained in a picture.
        is_lack_shown: Whether it is more than chance.
        weakest: The constant whose uncertainty moves the tool most.
        refused: Why it was not taken; "" where it was.
    """

    name: str
    free: tuple[str, ...]
    pixel: float
    moved: float
    uncertainty: float
    turned: float
    lack: float
    is_lack_shown: bool = True
    weakest: str = ""
    refused: str = ""

    @property
    def expected(self) -> float:
        """Expected error of the tool's position [m]."""
        return float(np.hypot(self.uncertainty, self.lack))


@dataclass(frozen=True, eq=False)
class Gate:
    """What the gate decided.

    Args:
        steps: Every step that was tried.
        taken: Number of the one that holds.
        advice: What to measure next; "" where nothing has to be.
        noise: How corners scatter, and how far the tool is off in every picture.
        doubts: What of camera and target the pictures contradict.
        actual: How corners scatter, where all were weighed alike.
        considered: The arm's constants that stay nominal though they are uncertain.
    """

    steps: tuple[Step, ...]
    taken: int
    advice: str
    noise: Noise
    doubts: tuple[str, ...] = ()
    actual: Noise | None = None
    considered: Considered | None = None

    @property
    def step(self) -> Step:
        """The step that holds."""
        return self.steps[self.taken]

    @property
    def refused(self) -> str:
        """Why the arm stays as it was; "" where something of it was identified."""
        if self.taken:
            return ""
        if self.doubts:
            return self.doubts[0]
        reasons = [f"{step.name}: {step.refused}" for step in self.steps[1:]]
        if not reasons:
            return "it has no constant that these pictures could show"
        return "; ".join([*reasons, self.advice] if self.advice else reasons)

    @property
    def notes(self) -> list[str]:
        """The decision, one sentence each."""
        step = self.step
        words = [
            f"{step.name}: expected error of the tool {_mm(step.expected)}, {_mm(step.uncertainty)} by the "
            f"constants' uncertainty; corners of pictures left out {step.pixel:.2f} px"
        ]
        words += [f"{step.name} not taken: {step.refused}" for step in self.steps if step.refused]
        return [*words, self.advice] if self.advice else words


class Fitted(NamedTuple):
    """A step's problem, weighed, with its answer."""

    problem: Problem
    x: np.ndarray
    free: tuple[str, ...]
    noise: Noise
    is_lack_shown: bool
    shares: np.ndarray = np.zeros(0)


def pass_gate(
    robot: Robot,
    data: Dataset,
    *,
    free: Sequence[str] | None = None,
    build: Callable[..., Problem] = Problem.build,
    seek: Seek | None = None,
) -> tuple[Problem, Gate]:
    """The problem of the last step that carries, weighed, and why.

    Args:
        free: Constants of the arm that may be freed at all; the robot's default ones if None.
        build: Makes the problem from robot, data and `free`.
        seek: Finds effects beside the geometry; None ends with the geometry.
    """
    chosen = list(robot.default_free if free is None else free)
    zeros = [n for n in robot.joint_offsets if n in chosen]
    wanted = [(ZEROS, zeros)] + ([(GEOMETRY, chosen)] if set(chosen) - set(zeros) else [])
    at = _alike(build(robot, data, free=()))
    noise = at.noise
    taken, steps = at, [_step("camera and target alone", at, at)]
    last, hidden = at.problem, set[str]()
    for name, names in wanted:
        if not names:
            continue
        problem = build(robot, data, free=tuple(n for n in names if n not in hidden), noise=noise)
        if name == ZEROS and (found := _confounded(problem)):
            hidden |= found
            problem = build(robot, data, free=tuple(n for n in names if n not in hidden), noise=noise)
        mine = tuple(p.name for p in problem.parameters if p.is_geometry)
        if not mine or len(data) * 4 < len(mine):
            continue
        last, at = problem, _fitted(problem, tuple(n for n in mine if n not in zeros))
        step = _judged(_step(name, at, taken), steps)
        steps.append(step)
        if not step.refused:
            taken = at
    if seek is not None and steps[-1].name == GEOMETRY and at.is_lack_shown:
        bent = _with_effects(robot, data, last, at, zeros, build, seek)
        step = _step(EFFECTS, bent or at, taken)
        nothing = f"no effect of the arm stands out in the {_mm(step.lack)} that geometry leaves unexplained"
        steps.append(_judged(step, steps) if bent else replace(step, refused=nothing))
        if bent and not steps[-1].refused:
            at = taken = bent
    number = max(k for k, step in enumerate(steps) if not step.refused)

    shown = [p.name for p in last.parameters if p.name in zeros]

    def fitted(other: Dataset) -> Fit:
        again = _alike(build(robot, other, free=shown))
        return Fit(again.problem, again.x)

    doubted, advice = tuple(doubts(fitted, data)), _advice(steps, number, data)
    considered = None
    if at.free and not taken.free:
        at = _fitted(last, tuple(p.name for p in last.parameters if p.is_geometry))
    if len(at.free) > len(taken.free):
        known = Knowledge.of(last, at.x, at.shares)
        width = mean_width(Pictures.at(last, at.x), known, Variances(at.noise))
        considered = Considered(at.problem.with_noise(taken.problem.noise), width * at.shares)
    actual = None if taken.free else at.noise
    return taken.problem, Gate(tuple(steps), number, advice, taken.noise, doubted, actual, considered)


def _alike(problem: Problem) -> Fitted:
    """Fit of camera and target alone, all corners weighed alike: what they leave tells of the arm."""
    problem = problem.with_noise(Noise(0.0, 0.0, (), problem.noise.pixel))
    x = Opt2(limit=60).search(problem).x
    nothing = np.zeros(len(x))
    begin = Variances(Noise(1e-3, 1e-3, (), problem.noise.pixel))
    found = most_likely(Pictures.at(problem, x), Knowledge.of(problem, x, nothing), begin)
    return Fitted(problem, x, (), found.noise, found.is_shown)


def _fitted(problem: Problem, shrunk: tuple[str, ...]) -> Fitted:
    """Fit and variances in turns; the shrunk constants get a prior about nominal as wide as is likely."""
    reach = max(problem.robot.reach / 2.0, 0.1)
    shares = np.array(
        [(1.0 / reach if p.unit == "rad" else 1.0) if p.name in shrunk else 0.0 for p in problem.parameters]
    )
    now, x, found = problem, problem.start, Variances(problem.noise, FIRST_WIDTH)
    for _ in range(ROUNDS):
        if shrunk:
            inside = shares > 0.0
            names = [p.name for p, mine in zip(problem.parameters, inside, strict=True) if mine]
            wall = np.diag(1.0 / (max(found.width, LEAST[3]) * shares[inside]))
            now = problem.with_noise(now.noise).with_prior(names, problem.start[inside], wall)
        x = Opt2(limit=60).search(now, begin=x).x
        found = most_likely(Pictures.at(problem, x), Knowledge.of(problem, x, shares), found)
        old, now = now.noise, now.with_noise(found.noise)
        if np.allclose(now.noise[:2], old[:2], rtol=TOLERANCE, atol=1e-6) and np.isclose(
            now.noise.pixel, old.pixel, rtol=TOLERANCE
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
        bent = build(arm, data, free=names, noise=now.noise, effects=(*own, *found))
        before, now = found, _fitted(bent, shrunk)
    return now


def _confounded(problem: Problem) -> set[str]:
    """Constants of the arm that camera and target can do as well, such as the first joint's zero."""
    jacobian = problem.evaluate(problem.start).jacobian * problem.units
    arm = np.array([p.is_geometry for p in problem.parameters])
    q, _ = np.linalg.qr(jacobian[:, ~arm])
    left = jacobian[:, arm] - q @ (q.T @ jacobian[:, arm])
    small = np.linalg.norm(left, axis=0) < CONFOUNDED * np.linalg.norm(jacobian[:, arm], axis=0)
    return {
        p.name
        for p, lost in zip([p for p in problem.parameters if p.is_geometry], small, strict=True)
        if lost
    }


class Effect(NamedTuple):
    """What changes of the arm's constants do at the tool, frames aside: |J̃ d|² = dᵀ M d, mean over poses."""

    position: Float[np.ndarray, "k k"]
    rotation: Float[np.ndarray, "k k"]

    @classmethod
    def of(cls, robot: Robot, data: Dataset, names: tuple[str, ...]) -> "Effect":
        """Of some constants at the measured poses."""
        if not names:
            return cls(np.zeros((0, 0)), np.zeros((0, 0)))
        frames = tuple(f"{kind}.{part}" for kind in ("base", "tool") for part in FRAME_PARTS)
        robot = robot.in_session(data.sessions[0])
        _, twists = sensitivity(robot, Motion.of(data), (*names, *frames))
        found = []
        for axes in (slice(0, 3), slice(3, 6)):
            flat = twists[:, axes].reshape(-1, twists.shape[2])
            mine, frame = flat[:, : len(names)], flat[:, len(names) :]
            left = mine - frame @ np.linalg.lstsq(frame, mine, rcond=1e-10)[0]
            found.append(left.T @ left / len(twists))
        return cls(*found)


def _step(name: str, at: Fitted, before: Fitted) -> Step:
    """A step's numbers, against the one that was taken before."""
    problem, x = at.problem, at.x
    arm = [problem.names.index(n) for n in at.free]
    effect = Effect.of(problem.robot_at(x), problem.data, at.free)
    covariance, left_out, pixel = _left_out(problem, x)
    earlier = dict(zip(before.problem.names, before.x, strict=True))
    change = x[arm] - np.array([earlier.get(problem.names[k], problem.start[k]) for k in arm], float)
    if before is at:
        change = 0.0 * change
    wide = [np.sum(m * c[np.ix_(arm, arm)]) for m in effect for c in (covariance, left_out)]
    each = np.diag(effect.position @ covariance[np.ix_(arm, arm)])
    return Step(
        name=name,
        free=at.free,
        pixel=pixel,
        moved=float(np.sqrt(max(change @ effect.position @ change, 0.0))),
        uncertainty=float(np.sqrt(max(*wide[:2], 0.0))),
        turned=float(np.sqrt(max(*wide[2:], 0.0))),
        lack=float(np.sqrt(3.0) * at.noise.position),
        is_lack_shown=at.is_lack_shown,
        weakest=at.free[int(np.argmax(each))] if at.free else "",
    )


def _judged(step: Step, steps: Sequence[Step]) -> Step:
    """The step, with the reason where it is not taken."""
    before = [s for s in steps if not s.refused][-1]
    reason = ""
    if step.moved**2 <= CLEARLY * step.uncertainty**2:
        reason = (
            f"it would move the tool by {_mm(step.moved)}, which is known to ±{_mm(step.uncertainty)} only"
        )
    elif step.pixel >= before.pixel:
        reason = (
            f"pictures left out are not predicted better: {step.pixel:.2f} px, {before.pixel:.2f} px before"
        )
    elif (
        step.name in (GEOMETRY, EFFECTS)
        and step.is_lack_shown
        and step.lack > max(UNEXPLAINED * before.lack, MEANINGLESS)
    ):
        reason = (
            f"it leaves {_mm(step.lack)} of {_mm(before.lack)} unexplained, so that camera, target, clock or "
            "an effect of the arm may be to blame, and the geometry would bend to fit them"
        )
    elif step.expected >= WORTHWHILE * before.expected:
        reason = f"the expected error of the tool stays {_mm(step.expected)}, {_mm(before.expected)} before"
    return replace(step, refused=reason)


def _advice(steps: Sequence[Step], taken: int, data: Dataset) -> str:
    """What to measure so that the next step could be taken."""
    step = next((s for s in steps[taken + 1 :] if s.moved**2 <= CLEARLY * s.uncertainty**2), None)
    if step is None and (last := steps[-1]).name == EFFECTS and last.refused:
        return (
            "to see whether an effect of the arm is to blame, measure about "
            f"{max(len(data), 30)} more pictures, with the arm folded and stretched out and every joint "
            "turned over its whole range"
        )
    if step is None or (taken and step.moved < HINTED * step.uncertainty):
        return ""
    more = len(data) * (CLEARLY * step.uncertainty**2 / max(step.moved, 1e-9) ** 2 - 1.0)
    count = int(np.clip(np.ceil(more), 5, 300))
    digits = "".join(c for c in step.weakest.split(".")[0] if c.isdigit())
    joint = min(int(digits or 1), data.joints) - 1
    turned = np.rad2deg(np.ptp(data.q[:, joint]))
    return (
        f"to tell more, measure about {count} more pictures, with joint {joint + 1} turned beyond the "
        f"{turned:.0f}° so far and the target near the camera, tilted and in all parts of the picture"
    )


def unsuited(robot: Robot, data: Dataset, build: Callable[..., Problem] = Problem.build) -> dict[int, float]:
    """Rows whose picture does not suit their joints, and how far the tool seems to be off [m]."""
    problem = build(robot, data, free=tuple(n for n in robot.joint_offsets if n in robot.default_free))
    problem = problem.with_noise(Noise(1e-3, 2e-3, (), problem.noise.pixel))
    x = Opt2(limit=40).search(problem).x
    off, _ = Pictures.at(problem, x).errors(Noise(1.0, 1.0, (), 0.5))
    lost = off > max(OUT_OF_LINE * float(np.median(off)), FAR_OFF)
    return {int(i): float(off[i]) for i in np.flatnonzero(lost)} if lost.mean() < 0.2 else {}


def _mm(length: float) -> str:
    if length < 1e-6:
        return "less than 0.001 mm"
    return f"{1e3 * length:.2g} mm" if length < 0.1 else f"{1e3 * length:.0f} mm"


def _left_out(problem: Problem, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Covariance by likelihood, by blocks that are left out in turns, and the error of these blocks [px]."""
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
    off, predicted = [], at.residual[: problem.size].copy()
    for k in range(count):
        mine = of_component == k
        j, r = at.jacobian[mine], at.residual[mine]
        step = -np.linalg.solve(h - j.T @ j, j.T @ r)
        off.append(step)
        predicted[mine[: problem.size]] -= j @ step
    spread = np.array(off)
    left_out = (count - 1) / count * spread.T @ spread
    pixel = problem.physical(predicted)
    return np.linalg.inv(h), left_out, float(np.sqrt((pixel**2).sum() / problem.count))
