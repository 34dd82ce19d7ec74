"""The command that plans a trajectory.

The default ones are a circle and a straight line in the region that matters; the Katana's are those of its
thesis (§5.5.1), the line being a diameter of the circle.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from workbench.arm.inverse.damped_newton import Task
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.base.progress import progress
from workbench.base.types import frozen
from workbench.base.wording import in_mm
from workbench.extras.trajectories.correction import ACCEPTED_ERROR, correct
from workbench.extras.trajectories.curves import Circle, Curve, circle_through, line
from workbench.extras.trajectories.path import command_joints
from workbench.extras.trajectories.planning import plan
from workbench.extras.trajectories.track import Track
from workbench.session.command import AbstractTask, computed
from workbench.session.page_state import Severity
from workbench.session.played_motion import Played
from workbench.session.real_arm import bending_robot
from workbench.session.state import Focus, Session
from workbench.session.target_steps import check_free

CIRCLE, LINE = "circle", "line"
_X, _Y, _Z = np.eye(3)
PLANES = {
    "horizontal": (_X, _Y),
    "upright along x": (_X, _Z),
    "upright along y": (_Y, _Z),
    "tilted by 45°": (_X, (_Z - _Y) / np.sqrt(2.0)),
}
"""Two axes of each plane, base frame: a line runs along the first."""
TRAJECTORY_ROWS = 240
"""Rows of a trajectory."""
CIRCLE_RADIUS_SHARE = 0.3
"""Radius of the default circle, as a share of the region's smaller horizontal edge."""
KATANA = 1e-3 * np.array(
    [
        [100.0, -300.0, 139.2893],
        [0.0, -370.7107, 210.0],
        [-100.0, -300.0, 139.2893],
        [0.0, -229.2893, 68.5786],
    ]
)
"""Four points of the Katana thesis's circle on the plane at 45° (§5.5.1) [m]."""


def deviating_robot(session: Session) -> Robot | None:
    """The arm that deviates from the nominal one: the shown fit, or the opened arm with its own effects."""
    return session.results.calibrated or bending_robot(session)


def curves(session: Session) -> Mapping[str, Curve]:
    """The trajectories that this arm can be sent along, by kind."""
    if session.robot.name.startswith("Katana"):
        return {CIRCLE: circle_through(KATANA), LINE: line(KATANA[0], KATANA[2])}
    region = session.plate.region
    middle, size = 0.5 * (region.min + region.max), region.max - region.min
    radius = CIRCLE_RADIUS_SHARE * float(size[:2].min())
    round_ = middle + radius * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    half = CIRCLE_RADIUS_SHARE * size * [1.0, 1.0, 0.0]
    return {CIRCLE: circle_through(round_), LINE: line(middle - half, middle + half)}


def default_trajectory_circle(session: Session) -> Circle:
    """The circle that this arm is sent along unless another one is asked for."""
    found = curves(session)[CIRCLE]
    assert isinstance(found, Circle)
    return found


def make_track(session: Session, command: "PlanTrack") -> Track:
    """Plan a trajectory, and see where the tools go."""
    planned = plan(session.robot, command.curve(session), duration=command.duration, rows=TRAJECTORY_ROWS)
    erring, nominal = deviating_robot(session), session.robot.with_effects()
    before, actual, own, notes, q = None, None, None, planned.notes, planned.q
    wanted = reached = planned.poses[:, :3, 3]
    if erring is not None:
        is_place = planned.task is Task.POSITION
        sent = command_joints(erring, nominal, planned.q, positions_only=is_place, time=planned.time)
        actual, wanted, own = sent.calibrated, sent.poses[:, :3, 3], sent.expected
        notes = tuple(dict.fromkeys([*notes, *sent.notes]))
        before = frozen(np.linalg.norm(tool_poses(actual, Motion(planned.q))[:, :3, 3] - wanted, axis=1))
        q = correct(sent).q if command.is_corrected else planned.q
        reached = tool_poses(actual, Motion(q))[:, :3, 3]
    return Track(
        kind=command.kind,
        robot=session.robot,
        actual=actual,
        is_corrected=command.is_corrected and actual is not None,
        time=planned.time,
        q=frozen(q),
        wanted=frozen(wanted),
        reached=frozen(reached),
        before=before,
        model_error=None if own is None else own.position,
        notes=notes,
    )


MIN_TIME, MAX_TIME = 1.0, 120.0
"""Time that a trajectory may take [s]."""
MIN_RADIUS, MAX_RADIUS = 1e-3, 5.0
"""Size of a circle or line [m]."""


class PlanTrack(AbstractTask[tuple[Robot, Track]]):
    """Plan a trajectory with the nominal arm, and compute how the calibrated one follows it.

    Args:
        kind: `circle` or `line`.
        duration: Time from beginning to end [s].
        is_corrected: Whether its joints are corrected with the calibrated arm.
        centre: Of the circle or line, base frame [m]; None: where it is usual for the arm and its region.
        radius: Of the circle, or half the length of the line [m].
        plane: In which it lies, one of `PLANES`.
    """

    kind: str = CIRCLE
    duration: float = 10.0
    is_corrected: bool = False
    centre: tuple[float, float, float] | None = None
    radius: float = 0.1
    plane: str = "horizontal"

    title = computed(lambda self: f"Plan a {self.kind}" + (", corrected" if self.is_corrected else ""))

    def check(self, session: Session) -> None:
        check_free(session)
        if self.kind not in (CIRCLE, LINE):
            raise OptionError(f"the trajectory must be {CIRCLE} or {LINE}, got '{self.kind}'")
        if not MIN_TIME <= self.duration <= MAX_TIME:
            raise OptionError(f"a trajectory must last {MIN_TIME:g} to {MAX_TIME:g} s, got {self.duration:g}")
        if self.plane not in PLANES:
            raise OptionError(f"the plane must be one of {', '.join(PLANES)}, got '{self.plane}'")
        if not (np.isfinite(self.centre or 0.0).all() and MIN_RADIUS <= self.radius <= MAX_RADIUS):
            raise OptionError(
                f"a trajectory needs a finite centre and a radius of {1e3 * MIN_RADIUS:g} to "
                f"{1e3 * MAX_RADIUS:g} mm, got {1e3 * self.radius:g} mm"
            )
        if self.is_corrected and deviating_robot(session) is None:
            raise OptionError("there is no calibrated arm to correct with; identify it first")

    def compute(self, session: Session) -> tuple[Robot, Track]:
        progress(0.2, "solving for joint positions along it")
        return session.robot, make_track(session, self)

    def curve(self, session: Session) -> Curve:
        """Where the tool is sent."""
        if self.centre is None:
            return curves(session)[self.kind]
        (along, across), centre = PLANES[self.plane], np.array(self.centre)
        if self.kind == CIRCLE:
            return Circle(centre=frozen(centre), along=along, across=across, radius=self.radius)
        return line(centre - self.radius * along, centre + self.radius * along)

    def finish(self, session: Session, result: tuple[Robot, Track]) -> Session:
        robot, track = result
        if session.robot is not robot:
            raise OptionError("the arm has changed since; plan again")
        focus = Focus.TRACK if session.drag is None else session.playback.focus
        former = session.part(Played)
        played = Played(motion=track) if former is None else replace(former.stopped(0.0), motion=track)
        session = session.with_part(played).with_playback(focus=focus)
        return session.with_message(Severity.INFO, _summary(track))


def corrected(track: Track) -> str:
    """What is left with a correction: a model has no error against itself."""
    own = "not measured" if track.model_error is None else f"{in_mm(track.model_error)} on held-out rows"
    left = float(track.errors.max())
    beside = f", plus up to {in_mm(left)} that can't be corrected" if left > ACCEPTED_ERROR else ""
    return f"with correction, the model's own error remains ({own}){beside}"


def _summary(track: Track) -> str:
    """Errors in one sentence, with those before a correction."""
    if track.before is None:
        return f"the {track.kind} is planned; identify the arm to see its error along it"
    now = f"{1e3 * np.mean(track.errors):.3g} mm"
    if not track.is_corrected:
        return f"mean error along the {track.kind}: {now}"
    before = in_mm(float(np.mean(track.before)))
    return f"mean error along the {track.kind}: {before} uncorrected; {corrected(track)}"
