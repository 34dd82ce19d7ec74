"""Commands about a planned trajectory: play it, pause it, put the arm anywhere along it, leave it."""

from dataclasses import replace

from workbench.base.errors import OptionError
from workbench.session.command import AbstractChange, computed
from workbench.session.played_motion import Played
from workbench.session.state import Focus, Session
from workbench.session.target_steps import check_free

SLOWEST, FASTEST = 0.1, 10.0
"""Pace at which it is played, in multiples of its own."""


class AbstractTrackChange(AbstractChange):
    """A change that needs a planned trajectory."""

    def check(self, session: Session) -> None:
        _planned(session)


class PlayTrack(AbstractTrackChange):
    """Play the trajectory from where it stopped, or from the start if it has ended."""

    title = "Play the trajectory"
    key = "play"

    def check(self, session: Session) -> None:
        super().check(session)
        check_free(session)
        if session.page.job is not None:
            raise OptionError("a computation is running; wait for it or cancel it, then play")
        if session.mode is not None:
            raise OptionError("the arm is being measured; use its rows or stop measuring first")

    def apply(self, session: Session) -> Session:
        played = _planned(session)
        at = 0.0 if played.at >= played.motion.duration else played.at
        begun = replace(played.stopped(at), is_running=True)
        return session.with_part(begun).updated("playback", focus=Focus.TRACK)


class PauseTrack(AbstractTrackChange):
    """Stop playing where the arm is; what moves it then says where that is (`PlaceTrack`)."""

    title = "Pause the trajectory"
    key = "pause"

    def apply(self, session: Session) -> Session:
        return session.with_part(replace(_planned(session), is_pausing=True))


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
        duration = _planned(session).motion.duration
        if not 0.0 <= self.at <= duration:
            raise OptionError(f"the time must be 0 to {duration:g} s, got {self.at:g}")

    def apply(self, session: Session) -> Session:
        focus = Focus.TRACK if self.is_shown else session.playback.focus
        return session.with_part(_planned(session).stopped(self.at)).updated("playback", focus=focus)


class LeaveTrack(AbstractTrackChange):
    """Stop playing, and let the arm go back to the selected target."""

    title = "Leave the trajectory"
    key = "leave"

    def apply(self, session: Session) -> Session:
        played = _planned(session)
        return session.with_part(played.stopped(played.at)).updated("playback", focus=Focus.TARGET)


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
        _planned(session)

    def apply(self, session: Session) -> Session:
        return session.with_part(replace(_planned(session), pace=self.pace))


def _planned(session: Session) -> Played:
    if (played := session.part(Played)) is None:
        raise OptionError("no trajectory has been planned yet; plan one first")
    return played
