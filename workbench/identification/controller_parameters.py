"""Controller-ready numbers: joint offsets, tool and base, for a controller that accepts nothing else.

Most controllers compute with the nominal geometry and let their user set a zero offset for every joint, a
tool frame and a base frame. Those are chosen here so that the nominal arm with them comes closest to the
calibrated arm over the joint positions that matter (Gauss–Newton on

    Σ_rows ‖Δp‖² + L² ‖Δφ‖²,

Δp and Δφ the pose errors of the nominal arm, L a lever that turns angles into lengths). The remaining error,
which only the full model can correct, is reported.

Some of these numbers do the same: a turn of the base about the first axis is an offset of joint 1, one of
the tool about the last axis an offset of the last joint. They are taken in order (offsets, tool, base),
and a number that repeats what earlier ones can do stays as it is and is named.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from workbench.arm.kinematics.forward import joint_elements, sensitivity, tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import FRAME_PARTS, Frame, Robot
from workbench.base import se3
from workbench.base.errors import OptionError, ShapeError
from workbench.base.types import frozen
from workbench.identification.undetermined_combinations import independent_columns

LEVER = 0.3
"""Length L at which an angle counts [m]: about the reach of a tool with its workpiece."""
SAMPLES = 500
"""Joint positions sampled within the limits where none are given."""
ITERATIONS = 30
"""Greatest number of Gauss–Newton steps."""
REPEATS = 1e-8
"""A number whose effect is this close to what earlier ones can do (relative length) stays as it is."""


class Part(StrEnum):
    """The parts that a controller accepts."""

    OFFSETS = "offsets"
    TOOL = "tool"
    BASE = "base"


class PoseErrors(NamedTuple):
    """Difference of two arms over some joint positions.

    Args:
        position_mean: Mean distance of the tools [m].
        position_max: Greatest distance [m].
        rotation_mean: Mean angle between the tools [rad].
        rotation_max: Greatest angle [rad].
    """

    position_mean: float
    position_max: float
    rotation_mean: float
    rotation_max: float


@dataclass(frozen=True, eq=False, kw_only=True)
class ControllerNumbers:
    """What to enter into a controller, and what it leaves.

    Args:
        parts: What was allowed to change.
        offsets: To be added to every joint reading before the nominal kinematics [rad or m].
        tool: Tool frame in the nominal arm's last frame.
        base: Pose of the nominal arm's base in the measuring frame.
        robot: The nominal arm with all of this.
        held: Numbers that repeat what others do and stayed as they were, such as `base.yaw`.
        before: Errors of the nominal arm, with the calibrated arm's base and tool.
        after: Errors that remain.
        rows: Number of joint positions compared.
    """

    parts: tuple[Part, ...]
    offsets: Float[np.ndarray, " n"]
    tool: Frame
    base: Frame
    robot: Robot
    held: tuple[str, ...]
    before: PoseErrors
    after: PoseErrors
    rows: int


def controller_numbers(
    calibrated: Robot,
    nominal: Robot,
    *,
    q: Float[np.ndarray, "rows n"] | None = None,
    parts: Sequence[Part | str] = tuple(Part),
    session: str = "",
    lever: float = LEVER,
    rng: np.random.Generator | None = None,
) -> ControllerNumbers:
    """The joint offsets, tool and base with which the nominal arm comes closest to the calibrated one.

    The search begins with the calibrated arm's base and tool; a part that is not allowed keeps them, and
    offsets that are not allowed are 0.

    Args:
        calibrated: The arm as identified.
        nominal: The arm as the controller computes it.
        q: Joint positions that matter [rad or m]; sampled evenly within the limits if None.
        parts: What the controller takes: `offsets`, `tool`, `base`.
        session: Session whose base and tool count, where the calibrated arm has several.
        lever: Length L at which an angle counts [m].
        rng: For the sampling; seeded with 0 if None.

    Raises:
        ShapeError: the arms, or the rows, have different numbers of joints.
        OptionError: an unknown part, no rows, or a lever that is not positive.
    """
    chosen = _parts(parts)
    if calibrated.dof != nominal.dof:
        raise ShapeError(
            f"the calibrated arm '{calibrated.name}' has {calibrated.dof} joints, the nominal one "
            f"'{nominal.name}' {nominal.dof}; give the arm that was calibrated",
            expected=nominal.dof,
            found=calibrated.dof,
        )
    q = _sample(nominal, rng) if q is None else np.ascontiguousarray(q)
    if not len(q) or not lever > 0:
        raise OptionError(
            f"at least 1 joint position and a lever above 0 m are needed, got {len(q)} and {lever:g} m"
        )
    frames = calibrated.session_frames(session)
    wanted = tool_poses(calibrated.in_session(session), Motion(q))
    arm = start = nominal.with_frames(base=frames.base, tool=frames.tool)
    names = _names(arm, chosen)
    weight = np.array([1.0] * 3 + [lever] * 3)
    error = se3.pose_error(wanted, tool_poses(arm, Motion(q)))
    held: tuple[str, ...] = ()
    before, cost = _summary(error), _cost(error, weight)
    for _ in range(ITERATIONS):
        columns = sensitivity(arm, Motion(q), names)[1] * weight[:, None]
        jacobian = columns.reshape(-1, len(names))
        if not held:
            own = independent_columns(jacobian, REPEATS * np.linalg.norm(jacobian, axis=0))
            held = tuple(n for i, n in enumerate(names) if i not in own)
        keep = [i for i, n in enumerate(names) if n not in held]
        step = np.linalg.lstsq(jacobian[:, keep], (error * weight).ravel(), rcond=None)[0]
        moved = arm.with_values(
            {
                names[i]: arm.chain.values[arm.chain.index[names[i]]] + s
                for i, s in zip(keep, step, strict=True)
            }
        )
        moved_error = se3.pose_error(wanted, tool_poses(moved, Motion(q)))
        moved_cost = _cost(moved_error, weight)
        if not moved_cost < cost:
            break
        arm, error, done = moved, moved_error, moved_cost > (1.0 - 1e-12) * cost
        cost = moved_cost
        if done:
            break
    drives = joint_elements(arm)
    return ControllerNumbers(
        parts=chosen,
        offsets=frozen(arm.chain.values[drives] - start.chain.values[drives]),
        tool=arm.tool,
        base=arm.base,
        robot=arm,
        held=held,
        before=before,
        after=_summary(error),
        rows=len(q),
    )


def _parts(parts: Sequence[Part | str]) -> tuple[Part, ...]:
    try:
        given = {Part(p) for p in parts}
    except ValueError as error:
        raise OptionError(f"{error}; a controller takes {', '.join(Part)}") from None
    if not given:
        raise OptionError(f"at least one part is needed; choose from {', '.join(Part)}")
    return tuple(p for p in Part if p in given)


def _sample(robot: Robot, rng: np.random.Generator | None) -> np.ndarray:
    rng = np.random.default_rng(0) if rng is None else rng
    lower, upper = robot.search_limits.T
    return rng.uniform(lower, upper, (SAMPLES, robot.dof))


def _names(arm: Robot, parts: tuple[Part, ...]) -> tuple[str, ...]:
    """Constants to search, in the order in which they are preferred."""
    names: list[str] = []
    if Part.OFFSETS in parts:
        names += [arm.chain.elements[i].name for i in joint_elements(arm)]
    for part in (Part.TOOL, Part.BASE):
        if part in parts:
            names += [f"{part}.{piece}" for piece in FRAME_PARTS]
    return tuple(names)


def _cost(error: Float[np.ndarray, "rows 6"], weight: Float[np.ndarray, "6"]) -> float:
    return float(np.sum((error * weight) ** 2))


def _summary(error: Float[np.ndarray, "rows 6"]) -> PoseErrors:
    distance, angle = np.linalg.norm(error[:, :3], axis=1), np.linalg.norm(error[:, 3:], axis=1)
    return PoseErrors(float(distance.mean()), float(distance.max()), float(angle.mean()), float(angle.max()))
