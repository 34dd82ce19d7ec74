"""Trajectories: plan one, play it on both arms, and read how far off the tool is along it."""

from typing import Any

import numpy as np
import viser

from workbench.session.commands.track import (
    GREATEST_TIME,
    LEAST_TIME,
    SLOWEST,
    LeaveTrack,
    PauseTrack,
    PlanTrack,
    PlayTrack,
    SetPace,
)
from workbench.session.state import Focus, Session
from workbench.session.track import CIRCLE, LINE, Track, erring_robot
from workbench.views.appearance.colours import SCALE, css
from workbench.views.page.html import MUTED, block, number, pairs, text
from workbench.views.page.panels.panel import AbstractPanel, on_change, on_press, set_value

KINDS = {"Circle": CIRCLE, "Straight line": LINE}
WIDTH, HEIGHT = 340, 60
QUICKEST = 5.0
LEAST_SHOWN = 1e-3
"""Errors below this are not told distance [mm]."""


class TrackPanel(AbstractPanel):
    """Plan, play, pause, leave; the errors as numbers and as a curve over time."""

    def build(self, server: viser.ViserServer) -> None:
        gui = server.gui
        with gui.add_folder("Trajectory"):
            self._kind = gui.add_dropdown(
                "Path", list(KINDS), hint="Path of the tool: a circle or a line in the region."
            )
            self._duration = gui.add_number(
                "Duration [s]",
                10.0,
                min=LEAST_TIME,
                max=GREATEST_TIME,
                step=1.0,
                hint="Time from start to end, at rest at both.",
            )
            self._corrected = gui.add_checkbox(
                "Corrected",
                False,
                hint="Correct the joint positions with the calibrated arm, so that its tool follows the "
                "path.",
            )
            self._plan = gui.add_button(
                "Plan it",
                icon=viser.Icon.ROUTE,
                color="gray",
                hint="Compute joint positions along the path as the nominal arm's controller does.",
            )
            on_press(self._plan, self._ask)
            self._pace = gui.add_slider(
                "Speed ×", SLOWEST, QUICKEST, 0.1, 1.0, visible=False, hint="Playback speed."
            )
            on_change(self._pace, lambda: self._worker.submit(SetPace(float(self._pace.value))))
            self._build_buttons(gui)
            self._result = gui.add_html("")

    def _build_buttons(self, gui: viser.GuiApi) -> None:
        def button(label, command, icon, hint, color=None):
            made = gui.add_button(label, icon=icon, hint=hint, color=color, visible=False)
            on_press(made, lambda: self._worker.submit(command()))
            return made

        icon = viser.Icon
        self._play = button(
            "Play", PlayTrack, icon.PLAYER_PLAY, "Move the arms along the path; any other input pauses."
        )
        self._pause = button("Pause", PauseTrack, icon.PLAYER_PAUSE, "Stop here; Play continues.")
        self._leave = button(
            "Back to the target",
            LeaveTrack,
            icon.PLAYER_STOP,
            "Stop, and return the arm to the selected target.",
            "gray",
        )

    def parts(self, session: Session) -> tuple[Any, ...]:
        is_free = session.job is None and session.measuring is None
        times = session.overlay.exaggeration
        return (
            session.track,
            session.play,
            session.focus,
            erring_robot(session),
            session.job is None,
            is_free,
            times,
        )

    def show(self, session: Session) -> None:
        track, is_there = session.track, session.track is not None
        self._plan.disabled = session.job is not None
        self._corrected.disabled = erring_robot(session) is None
        if self._corrected.disabled:
            set_value(self._corrected, False)
        self._pace.visible = is_there
        self._play.visible = is_there and not session.is_playing
        self._play.disabled = session.job is not None or session.measuring is not None
        self._pause.visible = session.is_playing
        self._leave.visible = is_there and session.focus is Focus.TRACK
        set_value(self._pace, round(session.play.pace, 1))
        times = session.overlay.exaggeration
        self._result.content = nothing() if track is None else result(track, times)

    def _ask(self) -> None:
        duration = float(self._duration.value)
        is_corrected = bool(self._corrected.value)
        self._worker.submit(PlanTrack(KINDS[self._kind.value], duration, is_corrected))


def nothing() -> str:
    """Before a plan."""
    words = "Plan a path, then play it. After an identification both arms follow it and the error is shown."
    return block(words, testid="track", style=f"color:{MUTED};margin:4px 0")


def result(track: Track, times: float) -> str:
    """Errors along the path in numbers, their curve, and what the trail's colours mean."""
    notes = "".join(f"<li>{text(note)}</li>" for note in track.notes)
    tail = f'<ul style="margin:4px 0 0;padding-left:16px;color:{MUTED}">{notes}</ul>' if notes else ""
    if track.before is None:
        words = "Planned. Identify the arm, and plan again, to see its error along the path."
        return block(f"<div>{words}</div>{tail}", testid="track", style="margin:4px 0")
    errors = 1e3 * track.errors
    rows = [("Error, mean", _millimetres(errors.mean())), ("largest", _millimetres(errors.max()))]
    if track.is_corrected:
        before = (
            f"{number(1e3 * float(track.before.mean()))} mm, largest {number(1e3 * track.before.max())} mm"
        )
        rows.append(("uncorrected", before))
    content = pairs(rows) + _curve(track.time, errors) + _scale(errors, times) + tail
    return block(content, testid="track", style="margin:4px 0")


def _millimetres(value: float) -> str:
    """Nothing below a micrometre is told apart."""
    return f"{number(float(value))} mm" if value >= LEAST_SHOWN else "below 0.001 mm"


def _curve(time: np.ndarray, errors: np.ndarray) -> str:
    top = max(float(errors.max()), LEAST_SHOWN)
    x, y = WIDTH * time / time[-1], HEIGHT - (HEIGHT - 12) * errors / top
    line = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT + 12}" width="100%"><title>Error over time</title>'
        f'<polyline points="{line}" fill="none" style="stroke:var(--mantine-color-text)" stroke-width="1.2"/>'
        f'<text x="0" y="9" font-size="9" style="fill:{MUTED}">{number(top)} mm</text>'
        f'<text x="{WIDTH}" y="{HEIGHT + 11}" font-size="9" text-anchor="end" style="fill:{MUTED}">'
        f"{number(float(time[-1]))} s</text></svg>"
    )


def _scale(errors: np.ndarray, times: float) -> str:
    stops = ",".join(css((int(r), int(g), int(b))) for r, g, b in SCALE[::-1])
    return (
        f'<div style="height:8px;border-radius:3px;margin-top:4px;background:linear-gradient(90deg,{stops})">'
        '</div><div style="display:flex;justify-content:space-between">'
        f"<span>{_millimetres(errors.min())}</span><span>{_millimetres(errors.max())}</span></div>"
        f'<div style="color:{MUTED}">The trail shows where the amber arm\'s tool goes, its error '
        f"{'to scale' if times == 1 else f'exaggerated {times:g} times'} (Nominal errors × above).</div>"
    )
