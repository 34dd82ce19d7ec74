"""Comparison: step through the measured poses, choose the overlays in the scene."""

from dataclasses import replace
from typing import Any

import numpy as np
import viser

from workbench.session.commands.compare import MAX_EXAGGERATION, MIN_EXAGGERATION, SetOverlay, ShowRow
from workbench.session.commands.identify import LeaveRowsOut
from workbench.session.comparison import Comparison
from workbench.session.state import Session, Tab
from workbench.views.appearance.colours import CALIBRATED, NOMINAL, css
from workbench.views.page.camera import aim
from workbench.views.page.first_view import view_of_rows
from workbench.views.page.html import MUTED, badge, block, number, table, text
from workbench.views.page.panels.panel import AbstractPanel, set_value

SWITCHES = {
    "ghosts": ("Other branches", "Show the other branches that reach the selected target as faint arms."),
    "nominal": ("Nominal arm", "Show the solid arm at the measured joint positions."),
    "calibrated": ("Calibrated arm", "Show the orange shell, with the identified parameters."),
    "points": (
        "Measured points",
        "Show the measured tool positions, coloured by their error once there is a fit.",
    ),
    "frames": ("Frames", "Show the measured tool orientations."),
    "arrows": ("Error arrows", "From measured to predicted positions: grey nominal, orange calibrated."),
}
OF_ROWS = ("points", "frames")
"""Switches for what rows show before anything is identified."""
FACTORS = {
    "exaggeration": (
        "Nominal ×",
        "Exaggeration of the nominal arm's error arrows, and of errors along a trajectory.",
    ),
    "exaggeration_after": ("Calibrated ×", "Exaggeration of the calibrated arm's error arrows."),
}


class ComparePanel(AbstractPanel):
    """Scrubber, switches, errors at the pose."""

    tab, order = Tab.COMPARE, 10
    depends = ("results", "choices.overlay", "measurements", "track")

    def build(self, gui: viser.GuiApi) -> None:
        self._row = gui.add_slider(
            "Pose", 1, 2, 1, 1, visible=False, hint="Step through the measured poses; the arms follow."
        )
        self.sends(self._row, lambda: ShowRow(int(self._row.value) - 1))
        self._readout = gui.add_html("")
        self._leave = gui.add_checkbox(
            "Exclude this row",
            False,
            hint="Exclude this row from the next identification, such as a wrong measurement.",
        )
        self.sends(self._leave, self._leave_out)
        overlay = self._worker.session.choices.overlay
        with gui.add_folder("Shown in the scene"):
            self._switches = {
                name: gui.add_checkbox(label, getattr(overlay, name), hint=hint)
                for name, (label, hint) in SWITCHES.items()
            }
            self._times, self._times_after = (
                self.number(label, getattr(overlay, name), (MIN_EXAGGERATION, MAX_EXAGGERATION, 1.0), hint)
                for name, (label, hint) in FACTORS.items()
            )
        for control in (*self._switches.values(), self._times, self._times_after):
            self.sends(control, self._set)
        hint = "Move the camera to show the robot and all measured positions."
        self._look = self.press("View all measurements", self._look_at_all, viser.Icon.FOCUS_2, hint)

    def show(self, session: Session) -> None:
        comparison, overlay = session.results.comparison, session.choices.overlay
        for part in (self._row, self._readout, self._leave, self._look):
            part.visible = comparison is not None
        if comparison is not None:
            if self._row.value > len(comparison):
                set_value(self._row, 1)
            self._row.max = max(len(comparison), 2)
            set_value(self._row, session.results.row + 1)
        for name, box in self._switches.items():
            set_value(box, getattr(overlay, name))
        for name, control in zip(FACTORS, (self._times, self._times_after), strict=True):
            set_value(control, getattr(overlay, name))
        is_fitted = session.results.identification is not None
        for name, box in self._switches.items():
            box.visible = name == "ghosts" or is_fitted or (comparison is not None and name in OF_ROWS)
        self._times.visible = is_fitted or session.track is not None
        self._times_after.visible = is_fitted
        self._readout.content = _readout(session)
        fitted = comparison is not None and not comparison.held_out[session.results.row]
        can_leave = fitted and session.measurements.loaded is not None
        self._leave.disabled = not can_leave
        number = int(comparison.number[session.results.row]) if comparison is not None and can_leave else -1
        set_value(self._leave, number in session.measurements.left_out)

    def _look_at_all(self, event: viser.GuiEvent) -> None:
        session = self._worker.session
        if event.client is not None and session.results.comparison is not None:
            aim(event.client, *view_of_rows(session.robot, session.results.comparison))

    def _leave_out(self) -> LeaveRowsOut | None:
        session = self._worker.session
        if session.results.comparison is None:
            return None
        number = {int(session.results.comparison.number[session.results.row])}
        left_out = session.measurements.left_out
        rows = left_out | number if self._leave.value else left_out - number
        return LeaveRowsOut(tuple(sorted(rows)))

    def _set(self) -> SetOverlay:
        switches = {name: bool(box.value) for name, box in self._switches.items()}
        factors = map(float, (self._times.value, self._times_after.value))
        chosen: dict[str, Any] = switches | dict(zip(FACTORS, factors, strict=True))
        return SetOverlay(replace(self._worker.session.choices.overlay, **chosen))


def _readout(session: Session) -> str:
    comparison, row = session.results.comparison, session.results.row
    if comparison is None:
        return ""
    kind = "held out" if comparison.held_out[row] else "fitted"
    head = f"Pose {row + 1} of {len(comparison)} · data row {int(comparison.number[row])}"
    if session.results.identification is None:
        return block(f"{head}{_as_opened(comparison, row)}", testid="row", style="margin:6px 0")
    before, after = comparison.errors[row]
    if np.isnan(before):
        sentence = "No position was measured here."
        return block(f"{head} · {kind}<br>{sentence}", testid="row", style="margin:6px 0")
    rows = [
        (badge("Nominal", css(NOMINAL)), f"{number(1e3 * before)} mm"),
        (badge("Calibrated", css(CALIBRATED)), f"{number(1e3 * after)} mm"),
    ]
    return block(
        f'<div style="color:{MUTED}">{text(head)} · {kind}</div>' + table(("Position error", ""), rows),
        testid="row",
        style="margin:6px 0",
    )


def _as_opened(comparison: Comparison, row: int) -> str:
    """Errors of the robot as opened: a few poses show whether an old calibration is still valid."""
    errors = 1e3 * np.linalg.norm(comparison.measured - comparison.nominal[:, :3, 3], axis=1)
    if not np.isfinite(errors).any():
        return "<br>No position was measured."
    rows = [
        ("here", f"{number(float(errors[row]))} mm"),
        ("mean", f"{number(float(np.nanmean(errors)))} mm"),
        ("maximum", f"{number(float(np.nanmax(errors)))} mm"),
    ]
    sentence = (
        "Nothing has been identified yet. If this robot is already calibrated, a few poses show whether "
        "the calibration is still valid; otherwise identify it first."
    )
    return (
        table(("Error of the robot as opened", ""), rows)
        + f'<div style="color:{MUTED};margin-top:4px">{sentence}</div>'
    )
