"""Commands about trajectories: plan one, play it, pause it, leave it."""

from dataclasses import replace
from typing import Any

import numpy as np

from workbench.base.errors import OptionError
from workbench.base.progress import Cancel
from workbench.session.command import AbstractChange, AbstractTask, Progress, computed
from workbench.session.plan_trajectory import CIRCLE, LINE, PLANES, erring_robot, make_track
from workbench.session.planned_trajectory import Place, Play, Track
from workbench.session.state import Focus, Session, Severity
from workbench.session.target_steps import check_free

LEAST_TIME, GREATEST_TIME = 1.0, 120.0
"""Time that a trajectory may take [s]."""
LEAST_RADIUS, GREATEST_RADIUS = 1e-3, 5.0
"""Size of a circle or line [m]."""
SLOWEST, FASTEST = 0.1, 10.0
"""Pace at which it is played, in multiples of its own."""


class PlanTrack(AbstractTask):
    """Plan a trajectory with the nominal arm, and see what the calibrated one makes of it.

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
        if not LEAST_TIME <= self.duration <= GREATEST_TIME:
            raise OptionError(
                f"a trajectory must last {LEAST_TIME:g} to {GREATEST_TIME:g} s, got {self.duration:g}"
            )
        if self.plane not in PLANES:
            raise OptionError(f"the plane must be one of {', '.join(PLANES)}, got '{self.plane}'")
        if not (np.isfinite(self.centre or 0.0).all() and LEAST_RADIUS <= self.radius <= GREATEST_RADIUS):
            raise OptionError(
                f"a trajectory needs a finite centre and a radius of {1e3 * LEAST_RADIUS:g} to "
                f"{1e3 * GREATEST_RADIUS:g} mm, got {1e3 * self.radius:g} mm"
            )
        if self.is_corrected and erring_robot(session) is None:
            raise OptionError("there is no calibrated arm to correct with; identify it first")

    def compute(self, session: Session, *, progress: Progress, cancel: Cancel) -> Any:
        progress(0.2, "solving for joint positions along it")
        place = None if self.centre is None else Place(self.centre, self.radius, self.plane)
        track = make_track(
            session, self.kind, duration=self.duration, is_corrected=self.is_corrected, place=place
        )
        return session.robot, track

    def finish(self, session: Session, result: Any) -> Session:
        robot, track = result
        if session.robot is not robot:
            raise OptionError("the arm has changed since; plan again")
        session = replace(session, track=track, play=Play(pace=session.play.pace))
        if session.drag is None:
            session = replace(session, focus=Focus.TRACK)
        return session.tell(Severity.INFO, _summary(track))


class PlayTrack(AbstractChange):
    """Go on along the trajectory; from its beginning if it has come to its end."""

    title = "Play the trajectory"
    key = "play"

    def check(self, session: Session) -> None:
        _planned(session)
        check_free(session)
        if session.job is not None:
            raise OptionError("a computation is running; wait for it or cancel it, then play")
        if session.measuring is not None:
            raise OptionError("the arm is being measured; use its rows or stop measuring first")

    def apply(self, session: Session) -> Session:
        track = _planned(session)
        at = 0.0 if session.play.at >= track.duration else session.play.at
        return replace(session, focus=Focus.TRACK, play=Play(at=at, pace=session.play.pace, is_running=True))


class PauseTrack(AbstractChange):
    """Stop playing where the arm is; what moves it then says where that is (`PlaceTrack`)."""

    title = "Pause the trajectory"
    key = "pause"

    def check(self, session: Session) -> None:
        _planned(session)

    def apply(self, session: Session) -> Session:
        return replace(session, play=replace(session.play, is_pausing=True))


class PlaceTrack(AbstractChange):
    """Put the arm at a moment of the trajectory; nothing is played there.

    Args:
        at: Time along the trajectory [s].
        is_shown: Whether the arm comes from elsewhere to be shown there.
    """

    is_automatic = True
    key = "place"

    at: float
    is_shown: bool = False

    title = computed(lambda self: f"The trajectory at {self.at:.2f} s")

    def check(self, session: Session) -> None:
        duration = _planned(session).duration
        if not 0.0 <= self.at <= duration:
            raise OptionError(f"the time must be 0 to {duration:g} s, got {self.at:g}")

    def apply(self, session: Session) -> Session:
        focus = Focus.TRACK if self.is_shown else session.focus
        return replace(session, focus=focus, play=Play(at=self.at, pace=session.play.pace))


class LeaveTrack(AbstractChange):
    """Stop playing, and let the arm go back to the selected target."""

    title = "Leave the trajectory"
    key = "leave"

    def check(self, session: Session) -> None:
        _planned(session)

    def apply(self, session: Session) -> Session:
        return replace(session, focus=Focus.TARGET, play=Play(at=session.play.at, pace=session.play.pace))


class SetPace(AbstractChange):
    """Play faster or slower.

    Args:
        pace: In multiples of the trajectory's own time.
    """

    key = "pace"

    pace: float

    title = computed(lambda self: f"Play at {self.pace:g}× speed")

    def check(self, session: Session) -> None:
        if not SLOWEST <= self.pace <= FASTEST:
            raise OptionError(f"the speed must be {SLOWEST:g} to {FASTEST:g}, got {self.pace:g}")

    def apply(self, session: Session) -> Session:
        return replace(session, play=replace(session.play, pace=self.pace))


def _planned(session: Session) -> Track:
    if session.track is None:
        raise OptionError("no trajectory has been planned yet; plan one first")
    return session.track


def _summary(track: Track) -> str:
    """Errors in one sentence, with those before a correction."""
    if track.before is None:
        return f"the {track.kind} is planned; identify the arm to see its error along it"
    now = f"{1e3 * np.mean(track.errors):.3g} mm"
    if not track.is_corrected:
        return f"mean error along the {track.kind}: {now}"
    before = f"{1e3 * np.mean(track.before):.3g} mm"
    return f"mean error along the {track.kind}: {now} corrected, {before} uncorrected"
