"""Trajectories: plan one, play it on both arms, and read the tool error along it."""

import numpy as np
import viser

from workbench.base.wording import capital, in_mm
from workbench.extras.trajectories.session import (
    CIRCLE,
    LINE,
    MAX_TIME,
    MIN_TIME,
    PlanTrack,
    Track,
    corrected,
    deviating_robot,
    planned_track,
)
from workbench.report.chart import Chart, Marks
from workbench.session.commands.playing import SLOWEST, LeaveTrack, PauseTrack, PlaceTrack, PlayTrack, SetPace
from workbench.session.page_state import Tab
from workbench.session.played_motion import Played
from workbench.session.state import Focus, Session
from workbench.views.appearance.colours import gradient
from workbench.views.page.html import MUTED, block, bullets, note, pairs, text
from workbench.views.page.panels.panel import AbstractPanel, set_value

KINDS = {"Circle": CIRCLE, "Straight line": LINE}
ERROR_HEIGHT = 60.0
EMPTY_NOTE = "Plan a path, then play it. After an identification, both arms follow it and the error is shown."
PLANNED = "Planned. Identify the arm, and plan again, to see its error along the path."
QUICKEST = 5.0
ERROR_DECIMALS = 3
"""Of errors in mm: smaller ones are numerical noise."""


class TrackPanel(AbstractPanel):
    """Plan, play, pause, leave; the error over time, and a slider that puts the arms anywhere."""

    tab, order = Tab.COMPARE, 20
    depends = (
        lambda session: session.part(Played),
        "playback.focus",
        deviating_robot,
        "is_idle",
        "mode",
        "choices.overlay",
    )

    def build(self, gui: viser.GuiApi) -> None:
        icon = viser.Icon
        with gui.add_folder("Trajectory"):
            kind = self.dropdown("Path", KINDS, "Path of the tool: a circle or a line in the region.")
            hint = "Time from rest at the start to rest at the end."
            duration = self.number("Duration [s]", (MIN_TIME, MAX_TIME, 1.0), hint, value=10.0)
            hint = "With the calibrated arm, so that its tool follows the path."
            corrected = self.checkbox("Corrected", hint, disabled=lambda s: deviating_robot(s) is None)
            self._corrected = corrected.control
            self.button(
                "Plan it",
                lambda: PlanTrack(kind.typed, duration.typed, corrected.typed),
                icon.ROUTE,
                "Plan as the controller does, with the nominal model.",
                disabled=lambda s: s.page.job is not None,
            )
            limits, pace = (SLOWEST, QUICKEST, 0.1), "Playback speed."
            self.form(SetPace, self.slider("Speed ×", limits, pace, _pace, visible=_is_there))
            self.button(
                "Play",
                PlayTrack,
                icon.PLAYER_PLAY,
                "Move the arms along the path; any other input pauses.",
                main=True,
                visible=lambda s: _is_there(s) and not s.is_playing,
                disabled=lambda s: s.page.job is not None or s.mode is not None,
            )
            hint = "Stop here; Play continues."
            self.button(
                "Pause", PauseTrack, icon.PLAYER_PAUSE, hint, main=True, visible=lambda s: s.is_playing
            )
            self.button(
                "Back to the target",
                LeaveTrack,
                icon.PLAYER_STOP,
                "Stop, and return to the target.",
                visible=lambda s: _is_there(s) and s.playback.focus is Focus.TRACK,
            )
            hint = "Share of the path: put the arms there."
            time = self.slider("Along", (0.0, 1.0, 0.001), hint, value=0.0, visible=_is_there)
            self._time = time.control
            self.form(self._go, time)
            self.html(_result)

    def moved(self, share: float) -> None:
        """Show this share of the trajectory, as the arms move along it."""
        set_value(self._time, round(share, 3))

    def show(self, session: Session) -> None:
        if (played := session.part(Played)) is not None:
            self.moved(played.at / played.motion.duration)
        if self._corrected.disabled:
            set_value(self._corrected, False)

    def _go(self, share: float) -> PlaceTrack | None:
        track = planned_track(self._worker.session)
        return None if track is None else PlaceTrack(share * track.duration, is_shown=True)


def _is_there(session: Session) -> bool:
    return planned_track(session) is not None


def _pace(session: Session) -> float:
    played = session.part(Played)
    return 1.0 if played is None else played.pace


def _result(session: Session) -> str:
    track = planned_track(session)
    return note(EMPTY_NOTE, "track") if track is None else result(track, session.choices.overlay.exaggeration)


def result(track: Track, times: float) -> str:
    """Errors along the path in numbers, their curve over time, and what the trail's colours mean."""
    tail = bullets(map(text, track.notes), style=f"margin:4px 0 0;color:{MUTED}")
    if track.before is None:
        return block(f"<div>{PLANNED}</div>{tail}", testid="track", style="margin:4px 0")
    errors = track.errors
    rows = [("Error, mean", in_mm(errors.mean())), ("maximum", in_mm(errors.max()))]
    chart = Marks(track.planned.time, np.round(1e3 * errors, ERROR_DECIMALS), "currentColor", is_line=True)
    ends = "0 s", f"{track.duration:g} s"
    drawn = f"<div>Error [mm]</div>{Chart([chart], ERROR_HEIGHT, ends, floor=0.0).svg()}"
    if track.is_corrected:
        before = f"{in_mm(track.before.mean())}, maximum {in_mm(track.before.max())}"
        rows, drawn = [("Uncorrected, mean", before)], f"<div>{text(capital(corrected(track)))}</div>"
    return block(pairs(rows) + drawn + _scale(errors, times) + tail, testid="track", style="margin:4px 0")


def _scale(errors: np.ndarray, times: float) -> str:
    return (
        f'<div style="height:8px;border-radius:3px;margin-top:4px;background:{gradient()}">'
        '</div><div style="display:flex;justify-content:space-between">'
        f"<span>{in_mm(errors.min())}</span><span>{in_mm(errors.max())}</span></div>"
        f'<div style="color:{MUTED}">The trail shows where the orange arm\'s tool goes, its error '
        f"{'to scale' if times == 1 else f'exaggerated {times:g} times'} (Errors × in the legend).</div>"
    )
