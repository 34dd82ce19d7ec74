"""Joint trajectories corrected with a calibrated model, effects included.

    Δq = −Jᵀ (J Jᵀ + λ)⁻¹ Δx,      Δx the calibrated arm's error at the commanded joints

This step, Katana eq. (5.22) with damping, is repeated until the deflected arm is at the commanded pose
(`arm.inverse.follow`). A row that a correction would make worse keeps its commanded joints, and is reported.
Loads are those of the arm at rest, unless the motion has velocities and accelerations.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.inverse.branch import margins
from workbench.arm.inverse.damped_newton import ROTATION_WEIGHT, Reached, Task, refine
from workbench.arm.inverse.follow import refine_deflected, rigid_targets
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.arm.inverse.solutions import task_jacobian
from workbench.arm.joint_units import shown_joints, shown_units
from workbench.arm.motion import Motion
from workbench.base import se3
from workbench.base.types import frozen
from workbench.base.wording import first_of, plural
from workbench.extras.trajectories.path import Commanded, refuse, refuse_beyond
from workbench.identification.errors.row_errors import Errors
from workbench.identification.report.results_json import errors_json
from workbench.report.blocks import Block, ResultTable, headed
from workbench.report.json import Json, document
from workbench.report.numbers import short
from workbench.report.result_display import AbstractShown

SCHEMA = "workbench.compensation/1"

ACCEPTED_ERROR = 1e-6
"""Remaining error of an iterated correction above which it is reported [m]."""
MAX_CORRECTION = 0.35
"""Correction of a joint above which the cause is a singularity, not the calibration [rad or m]."""
AT_LIMIT = 1e-9
"""A joint this near to its limit counts as held by it [rad or m]."""
TURNS, DAMPING = 4, 1e-2
"""Rounds in which an orientation is met as nearly as can be, and damping of turns that few joints give."""
BOUNDARY = 0.02
"""Singular value of the Jacobian below which an unconverged run has met the boundary of its branch."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Compensation(AbstractShown):
    """A corrected trajectory.

    Args:
        commanded: The path as commanded.
        motion: The corrected joint positions, with drivers of effects.
        before: Distances and angles to the commanded poses, as far as the task requires, that the calibrated
            arm is predicted to have without correction.
        after: The same with it.
        kept: Uncorrected rows, which a correction would have made worse.
    """

    commanded: Commanded
    motion: Motion
    before: Errors
    after: Errors
    kept: Bool[np.ndarray, " rows"]
    notes: tuple[str, ...]

    @property
    def q(self) -> Float[np.ndarray, "rows n"]:
        """Corrected joint positions [rad or m]."""
        return self.motion.q

    def blocks(self) -> list[Block]:
        """Predicted errors before and after, and decisions."""
        own, is_place = self.commanded.expected, self.commanded.task is Task.POSITION
        remains = is_place or self.after.position.max() > ACCEPTED_ERROR
        found = [("as commanded", self.before.spreads), ("corrected", self.after.spreads)][: 1 + remains]
        rows = [(n, *(short(round(v, 6)) for s in e.values() for v in (s.mean, s.max))) for n, e in found]
        mean, angle = (short(1e3 * own[0]), short(np.rad2deg(own[1]))) if own else ("–", "–")
        rows.append(("corrected (model error on held-out rows)", mean, "–", angle, "–"))
        headings = ("predicted error", "mean [mm]", "max [mm]", "mean [°]", "max [°]")
        head = f"{self.commanded.calibrated.name}: {plural(len(self.q), 'row')}"
        return headed(head, ResultTable("", headings, rows), notes=self.notes)

    def json(self) -> Json:
        """The result as plain data; rows count from 0. Errors are predicted by the calibrated model, without
        its own error (`model_error` [m, rad], from held-out rows).
        """
        commanded, time = self.commanded, self.motion.time
        columns = {
            "row": np.arange(len(self.q)),
            "time": [None] * len(self.q) if time is None else time,
            "before_mm": 1e3 * self.before.position,
            "after_mm": 1e3 * self.after.position,
            "kept": self.kept,
        }
        return document(
            SCHEMA,
            robot=commanded.calibrated.name,
            task=commanded.task.name.lower(),
            effects=[e.name for e in commanded.calibrated.effects],
            before=errors_json(self.before),
            after=errors_json(self.after),
            model_error=None if commanded.expected is None else list(commanded.expected),
            largest_correction=np.abs(self.q - commanded.q).max(0),
            rows=[dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)],
            notes=self.notes,
        )


def correct(commanded: Commanded, *, motion: Motion | None = None) -> Compensation:
    """Joint positions with which the calibrated arm reaches the commanded poses.

    Args:
        motion: Drivers of the arm's effects, one row each, and the time; none if None.

    Raises:
        DataError: a row beyond a limit, or for which no correction is found, with row and joint.
    """
    robot, q, time = commanded.calibrated, commanded.q, commanded.time
    state = begun = Motion(q) if motion is None else motion.at(q)
    refuse_beyond(robot, q, time)
    before = _errors(commanded, state)
    after = _corrected(commanded, state)
    wrong = _singular(commanded, after)
    points = taken = np.zeros(len(q), bool)
    alone = replace(commanded, task=Task.POSITION)
    if wrong.any() and commanded.task is not Task.POSITION:
        place = _corrected(alone, state)
        points = wrong & ~_singular(alone, place)
        steps = np.pad(np.abs(np.diff(q, axis=0)).max(1), 1, constant_values=np.inf)
        taken = points & (np.minimum(steps[:-1], steps[1:]) > MAX_CORRECTION) & (time is None)
        if taken.any():  # targets that are no rows of a path need no orientation in a singularity
            after = _errors(commanded, state.at(np.where(taken[:, None], place.q, after.q)))
            wrong = wrong & ~taken
    _check(commanded, after, wrong, points)
    after = _errors(commanded, state.at(after.q)) if commanded.is_turned else after
    weight = ROTATION_WEIGHT * compile_arm(robot).length
    worse = after.cost(weight) > before.cost(weight)
    worse |= after.position_error > np.maximum(before.position_error, AT_LIMIT)
    state = state.at(frozen(np.where(worse[:, None], q, after.q)))
    if commanded.task is Task.POSITION:  # what becomes of orientations is told
        before, after = (_errors(replace(commanded, is_turned=True), s) for s in (begun, state))
    unseen = np.full(len(q), np.nan)  # tilts of links
    first, last = (np.array([e.position_error, e.rotation_error, unseen]) for e in (before, after))
    errors = Errors(*frozen(np.where(worse, first, last)))
    return Compensation(
        commanded=commanded,
        motion=state,
        before=Errors(*frozen(first)),
        after=errors,
        kept=frozen(worse),
        notes=(*commanded.notes, *robot.extrapolation_warnings(q), *_notes(errors, worse, taken & ~worse)),
    )


def _errors(commanded: Commanded, state: Motion) -> Reached:
    """Errors of the deflected arm in a state; of all of the orientation where it is met as near as can be."""
    wanted = rigid_targets(commanded.calibrated, commanded.poses, state)
    task = Task.POSE if commanded.is_turned else commanded.task
    return refine(compile_arm(commanded.calibrated), wanted, state.q, task=task, iterations=0)


def _corrected(commanded: Commanded, state: Motion) -> Reached:
    """Corrected joints with their remaining errors."""
    robot, task, arm = commanded.calibrated, commanded.task, compile_arm(commanded.calibrated)
    q = state.q
    for _ in range(TURNS if commanded.is_turned else 0):  # along the motions that keep the position
        found = refine_deflected(robot, commanded.poses, q, task=task, limits=robot.limits, motion=state)
        wanted, jacobian = rigid_targets(robot, commanded.poses, state.at(found.q)), arm.jacobian(found.q)
        off = se3.matrix_to_rotvec(wanted[:, :3, :3] @ arm.geometry(found.q)[0][:, :3, :3].swapaxes(1, 2))
        free = np.linalg.svd(jacobian[:, :3])[2][:, 3:].swapaxes(1, 2)
        turns = jacobian[:, 3:] @ free
        normal = turns.swapaxes(1, 2) @ turns + DAMPING * np.eye(free.shape[2])
        q = found.q + (free @ np.linalg.solve(normal, turns.swapaxes(1, 2) @ off[..., None]))[..., 0]
    return refine_deflected(robot, commanded.poses, q, task=task, limits=robot.limits, motion=state)


def _singular(commanded: Commanded, after: Reached) -> Bool[np.ndarray, " rows"]:
    """Rows that miss their target, or that a singularity throws far away."""
    robot = commanded.calibrated
    play = sum(abs(c) for e in robot.effects if e.has_play for c in e.coefficients)
    missed = after.position_error > ACCEPTED_ERROR + 2.0 * robot.reach * play
    return missed | (np.abs(after.q - commanded.q) > MAX_CORRECTION).any(1)


def _check(commanded: Commanded, after: Reached, wrong: np.ndarray, points: np.ndarray) -> None:
    """Refuse rows that a limit stops and wrong ones, some of whose position alone could be corrected."""
    robot, moved, left = commanded.calibrated, np.abs(after.q - commanded.q), 1e3 * after.position_error
    units, at, size = shown_units(robot), shown_joints(robot, after.q), shown_joints(robot, moved)
    refuse(
        ~after.converged[:, None] & (margins(after.q, robot.limits) < AT_LIMIT),
        commanded.time,
        lambda row, joint: (
            f": the correction needs joint {joint + 1} beyond its limit {at[row, joint]:.5g}{units[joint]}, "
            f"{left[row]:.3g} mm remain; keep the path farther from it"
        ),
    )

    def why(row: int) -> str:
        """A rigid arm that ends short of its target within the limits has Jᵀ r = 0: a singularity."""
        jacobian = task_jacobian(compile_arm(robot), after.q[row : row + 1], commanded.task)
        minimum, joint = float(np.linalg.svd(jacobian, compute_uv=False)[0, -1]), int(np.argmax(moved[row]))
        text = f": the correction does not converge, {left[row]:.3g} mm remain; "
        if moved[row, joint] > MAX_CORRECTION:
            text = f": the correction moves joint {joint + 1} by {size[row, joint]:.3g}{units[joint]}, as it"
            text += " is near a singularity; lead the path around it"
        elif minimum < BOUNDARY:
            text += "the calibrated arm does not reach this pose in the branch of the path (singularity, "
            text += f"smallest singular value {minimum:.1e}); avoid it or use another branch"
        else:
            text += "check the effects of the calibrated robot, or change the path there"
        return text + ", or correct positions alone (--positions-only)" * bool(points[row])

    refuse(wrong, commanded.time, why)


def _notes(errors: Errors, worse: np.ndarray, points: np.ndarray) -> Iterator[str]:
    """Notes for the user."""
    if points.any():
        off = f"corrected in position, {np.rad2deg(errors.rotation[points].max()):.2g}° off in orientation"
        rows = f"{plural(int(points.sum()), 'row')} ({first_of(np.flatnonzero(points), 10)})"
        yield f"near a singularity, {off}: {rows}"
    if worse.any():
        rows = f"{plural(int(worse.sum()), 'row')} ({first_of(np.flatnonzero(worse), 10)})"
        yield f"as commanded, since a correction would make them worse: {rows}"
    if (left := (errors.position > ACCEPTED_ERROR) & ~worse).any():
        row = int(np.argmax(errors.position * left))
        yield (
            f"{int(left.sum())} rows can't be reached exactly (row {row}: {1e3 * errors.position[row]:.3g} "
            "mm off): a load changes sign within a joint's backlash there"
        )
