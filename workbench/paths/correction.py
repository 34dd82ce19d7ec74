"""Joint trajectories corrected with a calibrated model, effects included.

    one step     Δq = −Jᵀ (J Jᵀ + λ)⁻¹ Δx,      Δx what the calibrated arm would miss at the commanded joints
    iterated     until the deflected arm is at the commanded pose (`arm.inverse.deflected_arm`)

The one step is Katana eq. (5.22) with damping. No row becomes worse: one that would keeps its commanded
joints, and is named. Loads are those of the arm at rest, unless the motion has velocities and accelerations.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import final

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.inverse.branch import margins
from workbench.arm.inverse.damped_newton import WEIGHT, Refined, refine
from workbench.arm.inverse.deflected_arm import refine_deflected, rigid_targets
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.arm.inverse.solutions import task_jacobian
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.errors import DataError, OptionError
from workbench.base.types import frozen
from workbench.paths.path import Commanded, Times, named, refuse_beyond, refuse_fast, refuse_singular
from workbench.report.result_display import AbstractShown, tables_of

MAX_CORRECTION = 0.35
"""Correction of a joint beyond which no calibration is at work but a singularity [rad or m]."""
ACCEPTED_ERROR = 1e-6
"""Error that an iterated correction may leave without being said [m]."""
AT_LIMIT = 1e-9
"""A joint this near to its limit is held by it [rad or m]."""


BOUNDARY = 0.02
"""Singular value of the Jacobian below which a run that ends short has met the boundary of its branch."""


class CorrectionMethod(StrEnum):
    """How a trajectory is corrected."""

    ONE_STEP = "one-step"
    ITERATED = "iterated"


@dataclass(frozen=True, eq=False)
class PathErrors:
    """What an arm misses along a path, row by row.

    Args:
        position: Distance from the commanded position [m].
        rotation: Angle to the commanded orientation, as far as the task asks [rad].
    """

    position: Float[np.ndarray, " rows"]
    rotation: Float[np.ndarray, " rows"]


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Compensation(AbstractShown):
    """A corrected trajectory.

    Args:
        commanded: The path as commanded.
        motion: The corrected joint positions, with what drives the effects.
        before: What the calibrated arm would miss without correction.
        after: What it is predicted to miss with it.
        kept: Rows that a correction would have made worse.
        speed: Maximum speed of every joint with the correction [rad/s or m/s]; None without time.
    """

    summary = tables_of("workbench.paths.report:compensation_table")

    commanded: Commanded
    motion: Motion
    method: CorrectionMethod
    before: PathErrors
    after: PathErrors
    kept: Bool[np.ndarray, " rows"]
    speed: Float[np.ndarray, " n"] | None
    notes: tuple[str, ...]

    @property
    def q(self) -> Float[np.ndarray, "rows n"]:
        """Corrected joint positions [rad or m]."""
        return self.motion.q


def compensate(
    commanded: Commanded,
    *,
    motion: Motion | None = None,
    method: CorrectionMethod | str = CorrectionMethod.ITERATED,
    max_speed: float | None = None,
) -> Compensation:
    """Joint positions with which the calibrated arm takes the commanded poses.

    Args:
        motion: What drives the arm's effects beside q, a row each, and the time; nothing if None.
        method: `one-step` or `iterated`.
        max_speed: Maximum speed of any joint [rad/s or m/s]; not checked if None.

    Raises:
        DataError: a row that a limit, a singularity or the speed forbids; names row
            and joint; or a row to which the iteration finds no correction.
    """
    try:
        method = CorrectionMethod(method)
    except ValueError:
        raise OptionError(f"unknown method '{method}'; choose {' or '.join(CorrectionMethod)}") from None
    robot, q, time = commanded.calibrated, commanded.q, commanded.time
    state = Motion(q) if motion is None else motion.at(q)
    refuse_beyond(robot, q, time)
    before = _missed(commanded, state)
    refuse_singular(robot, q, commanded.task, time)
    after = _corrected(commanded, state, method)
    places, weight = compile_arm(robot).places, WEIGHT * compile_arm(robot).length
    _refuse_stopped(robot, after.x[:, places], after, time)
    if method is CorrectionMethod.ITERATED:
        _refuse_unconverged(commanded, after)
    _refuse_large(after.x[:, places] - q, time)
    worse = after.cost(weight) > before.cost(weight)
    worse |= after.position_error > np.maximum(before.position_error, AT_LIMIT)
    state = state.at(frozen(np.where(worse[:, None], q, after.x[:, places])))
    errors = PathErrors(
        frozen(np.where(worse, before.position_error, after.position_error)),
        frozen(np.where(worse, before.rotation_error, after.rotation_error)),
    )
    speed = _speeds(robot, state, max_speed)
    return Compensation(
        commanded=commanded,
        motion=state,
        method=method,
        before=PathErrors(frozen(before.position_error), frozen(before.rotation_error)),
        after=errors,
        kept=frozen(worse),
        speed=speed,
        notes=(
            *commanded.notes,
            *robot.extrapolation_warnings(q),
            *_notes(method, errors, worse, speed, max_speed),
        ),
    )


def _missed(commanded: Commanded, state: Motion) -> Refined:
    """What the deflected arm misses in a state."""
    arm = compile_arm(commanded.calibrated)
    wanted = rigid_targets(commanded.calibrated, commanded.poses, state)
    return refine(arm, wanted, state.q[:, arm.columns], task=commanded.task, iterations=0)


def _corrected(commanded: Commanded, state: Motion, method: CorrectionMethod) -> Refined:
    """Corrected joints with what they still miss."""
    robot, task = commanded.calibrated, commanded.task
    limits = robot.limits
    if method is CorrectionMethod.ITERATED:
        return refine_deflected(robot, commanded.poses, state.q, task=task, limits=limits, motion=state)
    arm = compile_arm(robot)
    wanted = rigid_targets(robot, commanded.poses, state)
    step = refine(arm, wanted, state.q[:, arm.columns], task=task, limits=limits[arm.columns], iterations=1)
    return _missed(commanded, state.at(step.x[:, arm.places]))


def _refuse_stopped(robot: Robot, new: np.ndarray, after: Refined, time: Times) -> None:
    at = margins(new, robot.limits) < AT_LIMIT
    stopped = ~after.converged & at.any(1)
    if stopped.any():
        row = int(np.argmax(stopped))
        joint = int(np.argmax(at[row]))
        raise DataError(
            f"{named(row, time)}: the correction needs joint {joint + 1} beyond its limit "
            f"{new[row, joint]:.4f} (rad or m), {1e3 * after.position_error[row]:.3g} mm are left; "
            "lead the path away from it",
            row=row,
        )


def _refuse_large(change: np.ndarray, time: Times) -> None:
    """Refuse corrections that no calibration can mean."""
    size = np.abs(change)
    if (size > MAX_CORRECTION).any():
        row, joint = divmod(int(np.argmax(size)), size.shape[1])
        raise DataError(
            f"{named(row, time)}: the correction turns joint {joint + 1} by {size[row, joint]:.2f} "
            "(rad or m), as it is near a singularity; lead the path around it",
            row=row,
        )


def _refuse_unconverged(commanded: Commanded, after: Refined) -> None:
    """Refuse rows that miss more than the play of the joints explains: nothing brings them to the path.

    Where a run of the rigid arm ends short of its target within the limits, Jᵀ r = 0: it stands at a
    singularity, on the boundary of what this branch reaches.
    """
    robot = commanded.calibrated
    left = after.position_error > ACCEPTED_ERROR + _play(robot)
    if left.any():
        row = int(np.argmax(left))
        jacobian = task_jacobian(compile_arm(robot), after.x[row : row + 1], commanded.task)
        minimum = float(np.linalg.svd(jacobian, compute_uv=False)[0, -1])
        why = "check the effects of the calibrated robot, or lead the path away from where it ends"
        if minimum < BOUNDARY:
            why = (
                "the calibrated arm does not reach this pose in the branch of the path (singularity, "
                f"smallest singular value {minimum:.1e}); lead the path away from it, or take another branch"
            )
        raise DataError(
            f"{named(row, commanded.time)}: the correction does not converge, "
            f"{1e3 * after.position_error[row]:.3g} mm are left; {why}",
            row=row,
        )


def _play(robot: Robot) -> float:
    """How far the tool may hang between the flanks of all plays, at most [m]."""
    return 2.0 * robot.reach * sum(abs(c) for e in robot.effects if e.has_play for c in e.coefficients)


def _speeds(robot: Robot, state: Motion, maximum: float | None) -> np.ndarray | None:
    """Maximum speed of every joint between two rows; refuse one above `maximum`."""
    if state.time is None or len(state) < 2:
        if maximum is not None:
            raise OptionError(
                "a maximum speed is given, but the trajectory has no time; add the column time[s]"
            )
        return None
    speed = np.abs(np.diff(state.q, axis=0)) / np.diff(state.time)[:, None]
    refuse_fast(robot, np.vstack([0.0 * speed[:1], speed]), maximum, state.time)
    return frozen(speed.max(0))


def _notes(method, errors: PathErrors, worse, speed, max_speed) -> Iterable[str]:
    """What a user should know of the answer."""
    if worse.any():
        rows = ", ".join(str(r) for r in np.flatnonzero(worse)[:10]) + (" …" if worse.sum() > 10 else "")
        yield f"{int(worse.sum())} rows keep their commanded joints, as a correction would miss more: {rows}"
    if method is CorrectionMethod.ITERATED and (left := errors.position > ACCEPTED_ERROR).any():
        row = int(np.argmax(errors.position))
        yield (
            f"{int(left.sum())} rows can't be met, row {row} misses {1e3 * errors.position[row]:.3g} mm: a "
            "load changes its sign within a joint's play there"
        )
    if speed is not None and max_speed is None:
        joint = int(np.argmax(speed))
        yield f"joint {joint + 1} is the fastest, {speed[joint]:.3g} (rad/s or m/s); no limit was given"
