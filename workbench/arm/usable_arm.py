"""The usable part of a calibrated arm: what was observed, and what a format can represent.

Unobservable directions of the tool (`tool_observability.py`) stay as near to nominal as the others allow; a
format that can't represent effects gets the best geometry without them, which the record has. Both are one
fit to the predictions T(q) of the calibrated arm, or of that geometry, over measured joint positions:

    Σ_q |Δp|²/s_p² + |Δφ|²/s_φ² + Σ_k (x_k − nominal_k)²/s_x²

Where a channel was not observed, Δ is relative to the nominal arm instead, and s is so large that it
determines only directions that the others don't. Constants of the arm have a prior, base and tool none, so
that redundant changes go to the base.

An arm that was measured over events is used in its present state, after them (`after_events`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.calibration_record import Expected
from workbench.arm.effects import AbstractEffect, Loads
from workbench.arm.effects.effect import NO_WRENCHES
from workbench.arm.effects.events import AbstractEvent, FrameStep, ToolStep
from workbench.arm.frame import Frame
from workbench.arm.kinematics.forward import identification_jacobian, tool_poses
from workbench.arm.motion import Motion
from workbench.arm.mounting import Mounting
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.hand_eye import nearest_rotation
from workbench.base.types import Matrix4
from workbench.base.wording import in_mm

POSITION_SIGMA = 1e-4
"""s_p of observed positions [m]: below the accuracy of calibrations."""
LEVER = 0.3
"""Lever that weighs angles [m], s_φ = s_p / lever: about the size of a tool with its workpiece."""
OPEN_SIGMA = 0.02
"""s of a channel that was not observed [m or rad]: accuracy of nominal arms."""
CONSTANT_SIGMA = 0.01
"""s_x of the arm's constants [rad or m]."""
LIMIT_SAMPLES = 500
"""Number of joint positions sampled within the limits if none are known."""
NO_DIFFERENCE = 1e-9
"""Difference [m] that counts as zero."""
NOTICED_RISE, ALIKE = 1.1, 1.01
"""Ratios above which a measured error counts more than the expected one; up to which two errors are one."""
MAX_ITERATIONS, RANK = 30, 1e-9
"""Maximum number of Gauss–Newton steps, and relative singular value below which none goes along."""


class PoseErrors(NamedTuple):
    """Difference of two arms' tools over some joint positions.

    Args:
        position_mean: Mean distance of the tools [m].
        position_max: Maximum distance [m].
        rotation_mean: Mean angle between the tools [rad].
        rotation_max: Maximum angle [rad].
    """

    position_mean: float
    position_max: float
    rotation_mean: float
    rotation_max: float

    @classmethod
    def of(cls, error: Float[np.ndarray, "rows 6"]) -> "PoseErrors":
        """Summary of differences row by row [m, rad]."""
        distance, angle = np.linalg.norm(error[:, :3], axis=1), np.linalg.norm(error[:, 3:], axis=1)
        return cls(float(distance.mean()), float(distance.max()), float(angle.mean()), float(angle.max()))


@dataclass(frozen=True, eq=False, kw_only=True)
class Usable:
    """The usable part of a calibrated arm.

    Args:
        robot: The arm to use, without a calibration record.
        left: Difference of its tool from the calibrated arm's over the measured poses.
        sees_position: Whether positions are the calibrated arm's.
        sees_rotation: Whether orientations are.
        free_frames: Parts of base and tool that were identified.
        q: Joint positions compared [rad or m].
        notes: What was not observed, and assumptions, one sentence each.
        calibrated: The calibrated arm in its first session, with the effects that depend on joint positions.
    """

    robot: Robot
    left: PoseErrors
    calibrated: Robot
    sees_position: bool = True
    sees_rotation: bool = True
    free_frames: tuple[str, ...] = ()
    q: Float[np.ndarray, "rows n"]
    notes: tuple[str, ...] = ()

    def wanted(self, q: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "rows 4 4"]:
        """Tool poses in the first session that a file should have: those of the calibrated arm where it was
        observed, elsewhere those of the arm to use."""
        known, _ = divided(self.robot)
        poses = tool_poses(self.robot.in_first_session.with_effects(*known), Motion(q))
        own = tool_poses(self.calibrated, Motion(q))
        if self.sees_position:
            poses[:, :3, 3] = own[:, :3, 3]
        if self.sees_rotation:
            poses[:, :3, :3] = own[:, :3, :3]
        return poses


def usable_arm(robot: Robot, *, effects: bool = True) -> Usable:
    """The usable part of an arm.

    Args:
        robot: As calibrated.
        effects: Whether the format represents effects; if not, the geometry approximates them.
    """
    found, free, seen = robot.calibration, _free(robot), _observed(robot)
    frames = tuple(n for n in free if n.startswith(("base.", "tool.")))
    q = sampled(robot) if found is None else found.observed.q
    known, unknown = divided(robot)
    notes: tuple[str, ...] = ()
    if unknown and not effects:
        names = ", ".join(dict.fromkeys(str(e.name) for e in unknown))
        notes += (f"can't represent {names}, which depends on more than joint positions",)
    if robot.sessions and not effects:
        notes += (
            f"base and tool are those of session '{next(iter(robot.sessions))}', as the format has only one",
        )
    actual = robot.with_effects(*known).in_first_session
    alone = None if found is None or effects else found.geometry
    wanted = actual if alone is None else replace(alone.in_first_session, calibration=found)
    if all(seen) and (effects or not known or alone is not None):
        kept = robot if effects else alone or robot.with_effects()
        left = PoseErrors(0.0, 0.0, 0.0, 0.0) if alone is None else _difference(actual, wanted, q)
        kept = replace(kept, calibration=None)
        return Usable(robot=kept, left=left, calibrated=actual, free_frames=frames, q=q, notes=notes)
    start = nominal_arm(wanted) if effects else nominal_arm(wanted).with_effects()
    fitted = _fitted(start, tool_poses(wanted, Motion(q)), q, free, seen)
    arm = replace(fitted, effects=robot.effects if effects else (), sessions={}, calibration=None)
    return Usable(
        robot=_with_sessions(arm, alone or robot, wanted),
        left=_difference(actual, fitted, q),
        calibrated=actual,
        sees_position=seen[0],
        sees_rotation=seen[1],
        free_frames=frames,
        q=q,
        notes=(*unobserved_text(robot, {"": fitted}), *notes),
    )


def _difference(arm: Robot, other: Robot, q: Float[np.ndarray, "rows n"]) -> PoseErrors:
    """Difference of two arms' tools."""
    return PoseErrors.of(se3.pose_error(*(tool_poses(each, Motion(q)) for each in (arm, other))))


def off_nominal(arm: Robot, nominal: Robot, q: Float[np.ndarray, "rows n"]) -> Expected:
    """Mean distance and angle between the flanges of two arms on the best common base [m], [rad].

    Effects that depend on more than joint positions are ignored, and the nominal arm has none.
    """
    known, _ = divided(arm)
    own, old = (tool_poses(each, Motion(q)) for each in (arm.bare.with_effects(*known), nominal.bare))
    turn = nearest_rotation(np.einsum("rij,rkj->ik", own[:, :3, :3], old[:, :3, :3]))
    placed = se3.pose(turn, own[:, :3, 3].mean(0) - turn @ old[:, :3, 3].mean(0)) @ old
    errors = PoseErrors.of(se3.pose_error(own, placed))
    return Expected(errors.position_mean, errors.rotation_mean)


def unobserved_text(robot: Robot, arms: Mapping[str, Robot] | None = None) -> tuple[str, ...]:
    """What a calibration did not observe, and the distance of arms from nominal there; empty if it observed
    everything.

    Args:
        robot: As calibrated.
        arms: Saved or used arms by name; the calibrated arm itself if None.
    """
    sees_position, sees_rotation = _observed(robot)
    if (found := robot.calibration) is None or (sees_position and sees_rotation):
        return ()
    seen, start, sizes = found.observed, nominal_arm(robot), []
    for name, arm in ({"": robot} if arms is None else arms).items():
        off = off_nominal(arm, start, seen.q)
        size = [] if sees_position else [in_mm(off.position)]
        size += [] if sees_rotation else [_in_degrees(off.rotation)]
        sizes.append(" and ".join(size) + (f" ({name})" if name else ""))
    far = f"the flange differs from nominal by {', '.join(sizes)}, mean over {len(seen.q)} measured poses"
    tool = ", so errors hold for the tool that was measured ('calibrated_tool' in a URDF)"
    tool = "" if sees_rotation else tool
    return (f"{seen.missing}{tool}; {far}",)


def carried_text(robot: Robot) -> tuple[str, ...]:
    """Error of a file without effects relative to a calibrated arm, one sentence each; empty if there is
    none."""
    found = usable_arm(robot, effects=False)
    return (*away_text("URDF", robot, found.left, len(found.q), effects=False), *found.notes)


def away_text(
    name: str, robot: Robot, left: PoseErrors, poses: int, *, effects: bool = True
) -> tuple[str, ...]:
    """Difference of a used arm from the calibrated one, and the error of both; empty if they agree.

    Args:
        name: Name of the used arm.
        robot: As calibrated.
        left: Difference of the tools.
        poses: Number of poses compared.
        effects: Whether the used arm has the effects; without them its error where it was measured counts.
    """
    if max(left.position_max, left.rotation_max) < NO_DIFFERENCE:
        return ()
    turned, sizes = _observed(robot)[1], np.reshape(left, (2, 2)).T.tolist()
    mean, maximum = (in_mm(size) + f" and {_in_degrees(angle)}" * turned for size, angle in sizes)
    at = f"{mean} on average from the calibrated model, up to {maximum}, over {poses} poses"
    if robot.calibration is None or (own := robot.calibration.error) is None:
        return (f"the {name} is {at}",)
    used, loads = np.hypot(own.position, left.position_mean), ""
    alone = None if effects else robot.calibration.geometry_error
    if alone is not None and (name == "URDF" or alone.position > NOTICED_RISE * used):
        used, loads = alone.position, " at the loads and temperatures that were measured"
    both = f"{name} about {in_mm(used)}{loads} · TOML {in_mm(own.position)}: " * bool(
        used > ALIKE * own.position
    )
    return (f"{both}the {name} is {at}",)


def expected_error(robot: Robot, left: PoseErrors) -> Expected | None:
    """Error of an arm with this difference from a calibrated one; None if the latter's is unknown."""
    if robot.calibration is None or (own := robot.calibration.error) is None:
        return None
    return Expected(
        float(np.hypot(own.position, left.position_mean)), float(np.hypot(own.rotation, left.rotation_mean))
    )


def _in_degrees(angle: float) -> str:
    return f"{np.rad2deg(angle):.2g}°" if angle > NO_DIFFERENCE else "0°"


def sampled(robot: Robot) -> Float[np.ndarray, "rows n"]:
    """Joint positions uniform within the limits, always the same."""
    lower, upper = robot.search_limits.T
    return np.random.default_rng(0).uniform(lower, upper, (LIMIT_SAMPLES, robot.dof))


def divided(robot: Robot) -> tuple[list[AbstractEffect], list[AbstractEffect]]:
    """Effects that depend on joint positions only, and those that need more; the instrument's are omitted."""
    mine = [e for e in robot.effects if e.moves_arm]
    known = [e for e in mine if not e.needs and (robot.has_masses or e.loads is Loads.NONE)]
    return known, [e for e in mine if e not in known]


def _observed(robot: Robot) -> tuple[bool, bool]:
    """Whether positions and orientations were observed."""
    if (found := robot.calibration) is None:
        return True, True
    return found.observed.sees_position, found.observed.sees_rotation


def nominal_arm(robot: Robot) -> Robot:
    """The arm with its constants before its calibration."""
    arm = {e.name for e in robot.elements}
    found = {} if robot.calibration is None else robot.calibration.nominal
    return robot.with_values({n: v for n, v in found.items() if n in arm})


def _free(robot: Robot) -> tuple[str, ...]:
    """Constants that were identified, base and tool for one session."""
    if (found := robot.calibration) is None:
        return robot.default_free
    names = (f"{n.split('[')[0]}.{n.rpartition('.')[2]}" if "[" in n else n for n in found.nominal)
    return tuple(n for n in dict.fromkeys(names) if n in robot.chain.index)


def _fitted(
    start: Robot,
    wanted: Float[np.ndarray, "rows 4 4"],
    q: np.ndarray,
    names: tuple[str, ...],
    seen: tuple[bool, bool],
) -> Robot:
    """The arm with the named constants fitted; unobserved rotations are relative to its own base."""
    sigma = np.repeat(np.where(seen, (POSITION_SIGMA, POSITION_SIGMA / LEVER), OPEN_SIGMA), 3)
    here, nominal = Motion(q), tool_poses(start, Motion(q))
    wanted = wanted.copy()
    if not seen[0]:
        wanted[:, :3, 3] = nominal[:, :3, 3]
    turned = wanted if seen[1] else tool_poses(start.with_frames(base=Frame()), here)
    if not seen[1] and "tool.yaw" in names:  # the tool stays as identified
        turned[:, :3, :3] @= nearest_rotation(np.einsum("rji,rjk->ik", nominal[:, :3, :3], wanted[:, :3, :3]))
    own = np.array([not n.startswith("base.") for n in names])

    def at(arm: Robot) -> tuple[np.ndarray, np.ndarray]:
        poses, twists = identification_jacobian(arm, here, names)
        error = se3.pose_error(wanted, poses)
        if not seen[1]:
            poses, columns = identification_jacobian(arm.with_frames(base=Frame()), here, names)
            error[:, 3:] = se3.pose_error(turned, poses)[:, 3:]
            twists[:, 3:] = columns[:, 3:] * own
        return (error / sigma).ravel(), (twists / sigma[:, None]).reshape(-1, len(names))

    prior = np.array([0.0 if n.startswith(("base.", "tool.")) else 1.0 / CONSTANT_SIGMA for n in names])
    return closest(start, names, at, prior=prior)


def closest(start: Robot, names: tuple[str, ...], at, *, prior: Float[np.ndarray, " p"]) -> Robot:
    """The arm with the constants that minimise |r|² + |prior · (x − start)|², by Gauss–Newton steps.

    Args:
        start: Start of the search.
        names: Free constants.
        at: Residuals of an arm, and the derivative of its prediction in these constants.
        prior: Reciprocal standard deviation of each constant; 0 for none.
    """
    begin = start.values(names)
    arm, x, (residual, jacobian) = start, np.zeros(len(names)), at(start)
    cost = float(residual @ residual)
    for _ in range(MAX_ITERATIONS):
        rows = np.vstack([jacobian, np.diag(prior)])
        step = np.linalg.lstsq(rows, np.concatenate([residual, -prior * x]), rcond=RANK)[0]
        moved = start.with_values(dict(zip(names, (begin + x + step).tolist(), strict=True)))
        new, derivative = at(moved)
        reached = float(new @ new) + float(np.sum((prior * (x + step)) ** 2))
        if not reached < cost:
            break
        done = reached > (1.0 - 1e-12) * cost
        arm, x, residual, jacobian, cost = moved, x + step, new, derivative, reached
        if done:
            break
    return arm


def _with_sessions(arm: Robot, robot: Robot, actual: Robot) -> Robot:
    """Bases and tools of all sessions moved like those of the fitted one."""
    if not robot.sessions:
        return arm
    base = se3.inverse(actual.base.pose) @ arm.base.pose
    tool = arm.tool.pose @ se3.inverse(actual.tool.pose)

    def moved(own: Mounting) -> Mounting:
        return own.at(own.base.pose @ base, tool @ own.tool.pose)

    sessions = {name: moved(own) for name, own in robot.sessions.items()}
    return replace(arm, mounting=moved(robot.mounting), sessions=sessions)


STEPS = (FrameStep, ToolStep)
"""Events that change base or tool, which may differ between sessions."""


def events_of(robot: Robot) -> list[AbstractEvent]:
    """Events during the measurements of an arm, in their order."""
    events = (e for e in robot.effects if isinstance(e, AbstractEvent))
    return sorted(events, key=lambda e: e.moment)


def after_events(robot: Robot, sessions: Mapping[str, Motion]) -> Robot:
    """The arm in its present state, without the events during the measurements.

    A session that ended before base or tool stepped keeps the base and the tool of its time; the present
    ones come first.

    Args:
        robot: The arm with its events.
        sessions: The rows that determine them, by session.
    """
    gone = {n for e in events_of(robot) for n in e.names}
    if not gone:
        return robot
    now = _after(robot, robot.mounting, Motion(np.zeros((1, robot.dof))))
    own, seen = {}, {}
    for name in dict.fromkeys([*robot.sessions, *sessions]):
        last = _last(robot, sessions.get(name))
        own[name] = _after(robot, robot.sessions.get(name, robot.mounting), last)
        seen[name] = sum(bool(e.is_over(last)[0]) for e in _steps(robot))
    differ = bool(robot.sessions) or not all(_same(m, now) for m in own.values())
    order = sorted(own, key=lambda n: -seen[n]) if differ else []
    if (record := robot.calibration) is not None:
        if (alone := record.geometry) is not None:
            alone = replace(alone, sessions={n: alone.sessions.get(n, alone.mounting) for n in order})
        record = replace(record, std={n: record.std[n] for n in record.std if n not in gone}, geometry=alone)
    return replace(
        robot,
        mounting=now,
        effects=tuple(e for e in robot.effects if not e.is_event),
        sessions={n: own[n] for n in order},
        calibration=record,
    )


def is_valid_after(robot: Robot, rows: Motion, fitted: Motion | None) -> Bool[np.ndarray, " rows"]:
    """Rows of a session for which the arm of `after_events` is valid.

    Args:
        robot: The arm with its events.
        rows: Some rows of the session.
        fitted: Its rows that determine the events; None if there are none.
    """
    out, last = np.ones(len(rows), bool), _last(robot, fitted)
    for event in events_of(robot):
        out &= event.is_over(rows) == (not isinstance(event, STEPS) or bool(event.is_over(last)[0]))
    return out


def _steps(robot: Robot) -> list[AbstractEvent]:
    return [e for e in events_of(robot) if isinstance(e, STEPS)]


def _last(robot: Robot, motion: Motion | None) -> Motion:
    """The row of a session after most of the steps; one after all events without rows."""
    steps = _steps(robot)
    if motion is None or not len(motion) or not steps:
        return Motion(np.zeros((1, robot.dof)))
    latest = int(np.argmax(np.sum([e.is_over(motion) for e in steps], axis=0)))
    return replace(motion.take(slice(latest, latest + 1)), q=np.zeros((1, robot.dof)))


def _after(robot: Robot, own: Mounting, last: Motion) -> Mounting:
    """The mounting in a row."""
    acting = [e for e in _steps(robot) if e.law(robot.chain, last, NO_WRENCHES).any()]
    if not acting:
        return own
    plain = replace(robot, mounting=own, sessions={}, effects=())

    def pose(*steps: AbstractEffect) -> Matrix4:
        return tool_poses(plain.with_effects(*steps), last)[0]

    unmoved = se3.inverse(pose())
    based = pose(*(e for e in acting if isinstance(e, FrameStep))) @ unmoved
    tooled = unmoved @ pose(*(e for e in acting if isinstance(e, ToolStep)))
    return own.at(based @ own.base.pose, own.tool.pose @ tooled)


def _same(one: Mounting, other: Mounting) -> bool:
    pairs = ((one.base, other.base), (one.tool, other.tool))
    return all(np.array_equal(a.pose, b.pose) for a, b in pairs)
