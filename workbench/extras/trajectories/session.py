"""A planned trajectory, and the command that plans it: a circle or a line in the region that matters.

The Katana's are those of its thesis (§5.5.1), the line being a diameter of the circle.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse.damped_newton import Task
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.base.progress import progress
from workbench.base.types import JointRows, Positions, frozen
from workbench.base.wording import in_mm
from workbench.extras.trajectories.correction import ACCEPTED_ERROR, correct
from workbench.extras.trajectories.curves import Curve, circle_through, line
from workbench.extras.trajectories.path import Commanded, command_joints
from workbench.extras.trajectories.planning import Planned, plan
from workbench.session.command import AbstractTask, computed
from workbench.session.page_state import Severity
from workbench.session.played_motion import AbstractMotion, Played
from workbench.session.real_arm import bending_robot
from workbench.session.state import Focus, Session
from workbench.session.target_steps import check_free

CIRCLE, LINE = "circle", "line"
TRAJECTORY_ROWS = 240
"""Rows of a trajectory."""
SHARE = 0.3
"""Radius of the circle, as a share of the region's smaller horizontal edge; ends of the line, likewise."""
KATANA = 1e-3 * np.array(
    [[100, -300, 139.2893], [0, -370.7107, 210], [-100, -300, 139.2893], [0, -229.2893, 68.5786]]
)
"""Four points of the Katana thesis's circle on the plane at 45° (§5.5.1) [m]."""
MIN_TIME, MAX_TIME = 1.0, 120.0
"""Time that a trajectory may take [s]."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Track(AbstractMotion):
    """A trajectory with its tools, a row each moment, in the robot's base frame.

    Args:
        kind: `circle` or `line`.
        robot: The arm that is drawn along it.
        planned: As its controller runs it, with the nominal arm.
        q: Joint positions that are sent [rad or m]: as planned, or corrected with the arm that errs.
        sent: What the planned joints mean for the arm that errs; None where none is known beside the nominal.
    """

    kind: str
    robot: Robot
    planned: Planned
    q: Float[np.ndarray, "rows n"]
    sent: Commanded | None

    @property
    def is_corrected(self) -> bool:
        return self.q is not self.planned.q

    @property
    def notes(self) -> tuple[str, ...]:
        """What was decided, one sentence each."""
        return tuple(dict.fromkeys([*self.planned.notes, *(self.sent.notes if self.sent else ())]))

    @property
    def duration(self) -> float:
        return float(self.planned.time[-1])

    @cached_property
    def wanted(self) -> Positions:
        """Where the tool is meant to be [m]."""
        return frozen((self.sent or self.planned).poses[:, :3, 3])

    @cached_property
    def reached(self) -> Positions:
        """Where the erring tool is [m]; the wanted places where none is known."""
        return self._reached(self.q)

    @property
    def errors(self) -> Float[np.ndarray, " rows"]:
        return np.linalg.norm(self.reached - self.wanted, axis=1)

    @cached_property
    def before(self) -> Float[np.ndarray, " rows"] | None:
        """Errors without a correction [m]; None where nothing is known."""
        plain = self._reached(self.planned.q)
        return None if self.sent is None else np.linalg.norm(plain - self.wanted, axis=1)

    def _reached(self, q: JointRows) -> Positions:
        if self.sent is None:
            return self.wanted
        return frozen(tool_poses(self.sent.calibrated, Motion(q))[:, :3, 3])

    def at(self, time: float) -> Float[np.ndarray, " n"]:
        return np.array([np.interp(time, self.planned.time, column) for column in self.q.T])

    def view(self) -> Float[np.ndarray, "rows 3"]:
        return self.wanted

    def looks_like(self, other: AbstractMotion) -> bool:
        return isinstance(other, Track) and (other.kind, other.robot) == (self.kind, self.robot)


def planned_track(session: Session) -> Track | None:
    """The trajectory that was planned last, if there is one."""
    played = session.part(Played)
    return played.motion if played is not None and isinstance(played.motion, Track) else None


def deviating_robot(session: Session) -> Robot | None:
    """The arm that deviates from the nominal one: the shown fit, or the opened arm with its own effects."""
    return session.results.calibrated or bending_robot(session)


def curve_of(session: Session, kind: str) -> Curve:
    """Where the tool is sent along a circle or a line."""
    if session.robot.name.startswith("Katana"):
        return circle_through(KATANA) if kind == CIRCLE else line(KATANA[0], KATANA[2])
    region = session.plate.region
    middle, size = 0.5 * (region.min + region.max), region.max - region.min
    if kind == LINE:
        half = SHARE * size * [1.0, 1.0, 0.0]
        return line(middle - half, middle + half)
    radius = SHARE * float(size[:2].min())
    return circle_through(middle + radius * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]))


class PlanTrack(AbstractTask[tuple[Robot, Track]]):
    """Plan a trajectory with the nominal arm, and compute how the calibrated one follows it.

    Args:
        kind: `circle` or `line`.
        duration: Time from beginning to end [s].
        is_corrected: Whether its joints are corrected with the calibrated arm.
    """

    kind: str = CIRCLE
    duration: float = 10.0
    is_corrected: bool = False

    title = computed(lambda self: f"Plan a {self.kind}" + (", corrected" if self.is_corrected else ""))

    def check(self, session: Session) -> None:
        check_free(session)
        if self.kind not in (CIRCLE, LINE):
            raise OptionError(f"the trajectory must be {CIRCLE} or {LINE}, got '{self.kind}'")
        if not MIN_TIME <= self.duration <= MAX_TIME:
            raise OptionError(f"a trajectory must last {MIN_TIME:g} to {MAX_TIME:g} s, got {self.duration:g}")
        if self.is_corrected and deviating_robot(session) is None:
            raise OptionError("there is no calibrated arm to correct with; identify it first")

    def compute(self, session: Session) -> tuple[Robot, Track]:
        progress(0.2, "solving for joint positions along it")
        curve, deviating = curve_of(session, self.kind), deviating_robot(session)
        planned, sent = plan(session.robot, curve, duration=self.duration, rows=TRAJECTORY_ROWS), None
        q = planned.q
        if deviating is not None:
            nominal, is_place = session.robot.with_effects(), planned.task is Task.POSITION
            sent = command_joints(deviating, nominal, q, positions_only=is_place, time=planned.time)
            q = correct(sent).q if self.is_corrected else q
        return session.robot, Track(kind=self.kind, robot=session.robot, planned=planned, q=q, sent=sent)

    def finish(self, session: Session, result: tuple[Robot, Track]) -> Session:
        robot, track = result
        if session.robot is not robot:
            raise OptionError("the arm has changed since; plan again")
        focus = Focus.TRACK if session.drag is None else session.playback.focus
        former = session.part(Played)
        played = Played(motion=track) if former is None else replace(former.stopped(0.0), motion=track)
        session = session.with_part(played).updated("playback", focus=focus)
        return session.with_message(Severity.INFO, _summary(track))


def corrected(track: Track) -> str:
    """What is left with a correction: a model has no error against itself."""
    expected = track.sent and track.sent.expected
    own = f"{in_mm(expected.position)} on held-out rows" if expected else "not measured"
    left = float(track.errors.max())
    beside = f", plus up to {in_mm(left)} that can't be corrected" if left > ACCEPTED_ERROR else ""
    return f"with correction, the model's own error remains ({own}){beside}"


def _summary(track: Track) -> str:
    """Errors in one sentence, with those before a correction."""
    if track.before is None:
        return f"the {track.kind} is planned; identify the arm to see its error along it"
    if not track.is_corrected:
        return f"mean error along the {track.kind}: {in_mm(float(track.errors.mean()))}"
    before = in_mm(float(track.before.mean()))
    return f"mean error along the {track.kind}: {before} uncorrected; {corrected(track)}"
