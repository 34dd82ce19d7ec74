"""Trajectories: plan one, play it on both arms, and read the tool error along it."""

from itertools import cycle

import numpy as np
import viser

from workbench.arm.joint_units import shown_joints, shown_units
from workbench.arm.robot import Robot
from workbench.base.wording import capital, in_mm
from workbench.extras.trajectories.session import (
    CIRCLE,
    LINE,
    MAX_TIME,
    MIN_TIME,
    PLANES,
    PlanTrack,
    corrected,
    default_trajectory_circle,
    deviating_robot,
)
from workbench.extras.trajectories.track import Track, planned_track
from workbench.plate.region import Region
from workbench.report.chart import FOOT, Chart, Marks
from workbench.report.numbers import signed
from workbench.session.commands.playing import SLOWEST, LeaveTrack, PauseTrack, PlaceTrack, PlayTrack, SetPace
from workbench.session.page_state import Tab
from workbench.session.played_motion import Played
from workbench.session.state import Focus, Session
from workbench.session.worker import Worker
from workbench.views.appearance.colours import gradient
from workbench.views.page.html import MUTED, block, bullets, heading, note, pairs, text
from workbench.views.page.panels.panel import AbstractPanel, set_value
from workbench.views.page.style import OVER, OVER_HEIGHT

KINDS = {"Circle": CIRCLE, "Straight line": LINE}
ERROR_HEIGHT = 44.0
MIN_MOVED = 1.0
"""A joint that moves less is drawn as nearly at rest [° or mm]."""
JOINT_INKS = ("#3b82f6", "#16a34a", "#c2700a", "#db2777", "#7c3aed", "#0891b2", "#737373")
EMPTY_NOTE = "Plan a path, then play it. After an identification, both arms follow it and the error is shown."
QUICKEST = 5.0
ERROR_DECIMALS = 3
"""Of errors in mm: smaller ones are numerical noise."""


class TrackPanel(AbstractPanel):
    """Plan, play, pause, leave; errors and joint positions as curves over time, where the arms can be put."""

    tab, order = Tab.COMPARE, 20
    depends = (
        lambda session: session.part(Played),
        "playback.focus",
        deviating_robot,
        "is_idle",
        "mode",
        "choices.overlay",
        "robot",
        "plate.region",
    )

    def __init__(self, worker: Worker):
        super().__init__(worker)
        self._usual_of: tuple[Robot, Region] | None = None
        self._drawn_track: Track | None = None

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Trajectory"):
            kind = self.dropdown("Path", KINDS, "Path of the tool: a circle or a line in the region.")
            self._centre = gui.add_vector3(
                "Centre [mm]", (0.0, 0.0, 0.0), step=1.0, hint="Middle of the path in the base frame."
            )
            self._radius = self.number(
                "Radius [mm]",
                (1.0, 5000.0, 1.0),
                "Radius of the circle, or half the length of the line.",
                unit=1e-3,
                value=100.0,
            )
            self._plane = gui.add_dropdown("Plane", list(PLANES), hint="Plane of the path.")
            duration = self.number(
                "Duration [s]",
                (MIN_TIME, MAX_TIME, 1.0),
                "Time from rest at the start to rest at the end.",
                value=10.0,
            )
            hint = "With the calibrated arm, so that its tool follows the path."
            corrected = self.checkbox("Corrected", hint, disabled=lambda s: deviating_robot(s) is None)
            self._corrected = corrected.control
            self.button(
                "Plan it",
                lambda: self._path(kind.typed, duration.typed, corrected.typed),
                viser.Icon.ROUTE,
                "Plan as the controller does, with the nominal model.",
                disabled=lambda s: s.page.job is not None,
            )
            limits, pace = (SLOWEST, QUICKEST, 0.1), "Playback speed."
            self.form(SetPace, self.slider("Speed ×", limits, pace, _pace, visible=_is_there))
            self._build_buttons()
            self._curves = gui.add_html("")
            time = self.slider(
                "Time", (0.0, 1.0, 0.001), "Click or drag on the curves.", value=0.0, visible=_is_there
            )
            self._time = time.control
            self.form(self._go, time)
            self.html(_result)

    def _build_buttons(self) -> None:
        icon = viser.Icon
        self.button(
            "Play",
            PlayTrack,
            icon.PLAYER_PLAY,
            "Move the arms along the path; any other input pauses.",
            main=True,
            visible=lambda s: _is_there(s) and not s.is_playing,
            disabled=lambda s: s.page.job is not None or s.mode is not None,
        )
        self.button(
            "Pause",
            PauseTrack,
            icon.PLAYER_PAUSE,
            "Stop here; Play continues.",
            main=True,
            visible=lambda s: s.is_playing,
        )
        self.button(
            "Back to the target",
            LeaveTrack,
            icon.PLAYER_STOP,
            "Stop, and return to the target.",
            visible=lambda s: _is_there(s) and s.playback.focus is Focus.TRACK,
        )

    def moved(self, share: float) -> None:
        """Move the line over the curves to this share of the trajectory, as the arms move along it."""
        set_value(self._time, round(share, 3))

    def _show_usual(self, session: Session) -> None:
        """Where the path is unless another one is typed; a new arm or region has another one."""
        usual = default_trajectory_circle(session)
        set_value(self._centre, tuple(np.round(1e3 * usual.centre, 1).tolist()))
        set_value(self._radius.control, round(1e3 * usual.radius, 1))
        flat = [abs(np.cross(*axes) @ np.cross(usual.along, usual.across)) for axes in PLANES.values()]
        set_value(self._plane, list(PLANES)[int(np.argmax(flat))])

    def show(self, session: Session) -> None:
        track, played = planned_track(session), session.part(Played)
        if (known := (session.robot, session.plate.region)) != self._usual_of:
            self._usual_of = known
            self._show_usual(session)
        if track is not self._drawn_track:
            self._drawn_track = track
            self._curves.content = "" if track is None else curves(track)
        if played is not None:
            self.moved(played.at / played.motion.duration)
        if self._corrected.disabled:
            set_value(self._corrected, False)

    def _path(self, kind: str, duration: float, is_corrected: bool) -> PlanTrack:
        x, y, z = (1e-3 * float(v) for v in self._centre.value)
        place = (x, y, z), self._radius.typed, str(self._plane.value)
        return PlanTrack(kind, duration, is_corrected, *place)

    def _go(self, share: float) -> PlaceTrack | None:
        track = planned_track(self._worker.session)
        return None if track is None else PlaceTrack(share * track.duration, is_shown=True)


def _is_there(session: Session) -> bool:
    return planned_track(session) is not None


def _pace(session: Session) -> float:
    played = session.part(Played)
    return 1.0 if played is None else played.pace


def _result(session: Session) -> str:
    if (track := planned_track(session)) is None:
        return note(EMPTY_NOTE, "track")
    return result(track, session.choices.overlay.exaggeration)


def result(track: Track, times: float) -> str:
    """Errors along the path in numbers, their curve, and what the trail's colours mean."""
    tail = bullets(map(text, track.notes), style=f"margin:4px 0 0;color:{MUTED}")
    if track.before is None:
        sentence = "Planned. Identify the arm, and plan again, to see its error along the path."
        return block(f"{legend(track)}<div>{sentence}</div>{tail}", testid="track", style="margin:4px 0")
    errors = track.errors
    rows = [("Error, mean", in_mm(errors.mean())), ("maximum", in_mm(errors.max()))]
    if track.is_corrected:
        before = f"{in_mm(track.before.mean())}, maximum {in_mm(track.before.max())}"
        rows = [("Uncorrected, mean", before)]
        tail = f"<div>{text(capital(corrected(track)))}</div>{tail}"
    content = legend(track) + pairs(rows) + _scale(errors, times) + tail
    return block(content, testid="track", style="margin:4px 0")


def curves(track: Track) -> str:
    """Error and joint positions over time, one above the other; a slider lies over them (`style.py`)."""
    is_shown = track.before is not None and not track.is_corrected
    height, title, drawn = OVER_HEIGHT - FOOT, "Joints", ""
    if is_shown:
        errors = Marks(track.time, np.round(1e3 * track.errors, ERROR_DECIMALS), "currentColor", is_line=True)
        drawn = Chart([errors], ERROR_HEIGHT, floor=0.0).svg()
        height, title = height - ERROR_HEIGHT - FOOT, "Error [mm] and joints"
    joints = [
        Marks(track.time, (q - q.min()) / max(float(np.ptp(q)), MIN_MOVED), ink, is_line=True)
        for q, ink in _joints(track)
    ]
    ends = "0 s", f"{track.duration:g} s"
    drawn += Chart(joints, height, ends, floor=0.0, sides=("min", "max")).svg()
    head = heading(f"{title} over time; click or drag to go there")
    return block(head) + f"<div {OVER}>{block(drawn, testid='curves')}</div>"


def legend(track: Track) -> str:
    """Colour and range of every joint."""
    parts = []
    for j, ((q, ink), unit) in enumerate(zip(_joints(track), shown_units(track.robot), strict=False), 1):
        bounds = f"{signed(q.min(), 0)} … {signed(q.max(), 0)}{unit}"
        parts.append(f'<span style="white-space:nowrap"><b style="color:{ink}">{j}</b> {bounds}</span>')
    return f'<div data-testid="legend-joints" style="color:{MUTED}">{" · ".join(parts)}</div>'


def _joints(track: Track) -> list[tuple[np.ndarray, str]]:
    """Every joint over time, as it is shown, and its colour."""
    return list(zip(shown_joints(track.robot, track.q).T, cycle(JOINT_INKS), strict=False))


def _scale(errors: np.ndarray, times: float) -> str:
    return (
        f'<div style="height:8px;border-radius:3px;margin-top:4px;background:{gradient()}">'
        '</div><div style="display:flex;justify-content:space-between">'
        f"<span>{in_mm(errors.min())}</span><span>{in_mm(errors.max())}</span></div>"
        f'<div style="color:{MUTED}">The trail shows where the orange arm\'s tool goes, its error '
        f"{'to scale' if times == 1 else f'exaggerated {times:g} times'} (Errors × in the legend).</div>"
    )
