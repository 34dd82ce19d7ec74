"""The arm's deflection in its current posture, and the factor by which it is drawn."""

from dataclasses import replace

import numpy as np
import viser

from workbench.arm.joint_units import shown_joints, shown_units
from workbench.arm.robot import Robot
from workbench.session.commands.arm import drawn_joints
from workbench.session.commands.compare import MIN_EXAGGERATION, SetOverlay
from workbench.session.deflection import MAX_DRAWN, Bending, bend, bending_robot, drawable_bending
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.appearance.colours import DEFLECTED, css
from workbench.views.page.html import MUTED, badge, block, table, text
from workbench.views.page.panels.panel import AbstractPanel

MAX_BENDING = 500


class BendingPanel(AbstractPanel):
    """A switch, a factor, and one line per joint, where the model bends."""

    tab, order = Tab.COMPARE, 30
    depends = (
        bending_robot,
        "choices.overlay",
        lambda session: bending_robot(session) and drawn_joints(session),
    )

    def build(self, gui: viser.GuiApi) -> None:
        with self.folder("Deflection under load", visible=lambda s: bending_robot(s) is not None):
            hint = "Show the violet arm, deflected by the effects of its model."
            is_on = self.checkbox("Deflected arm", hint, lambda s: s.choices.overlay.is_deflected)
            limits, hint = (
                (int(MIN_EXAGGERATION), MAX_BENDING, 1),
                "Exaggeration of the violet arm's deflection.",
            )
            times = self.slider("Deflection ×", limits, hint, lambda s: s.choices.overlay.deflection)
            self.html(_bending)
        self.form(self._set, is_on, times)

    def _set(self, is_on: bool, times: int) -> SetOverlay:
        overlay = self._worker.session.choices.overlay
        return SetOverlay(replace(overlay, is_deflected=is_on, deflection=float(times)))


def _bending(session: Session) -> str:
    robot, q = bending_robot(session), drawn_joints(session)
    if robot is None:
        return ""
    bending = bend(robot, q)
    if bending.outcome.ok:
        content = _joints(robot, bending) + _drawn(robot, q, session.choices.overlay.deflection)
    else:
        content = "The arm can't hold its load here, so it is drawn straight: its effects are too large."
    return block(content, testid="bending", style="margin:4px 0")


def _drawn(robot: Robot, q: np.ndarray, wanted: float) -> str:
    """How much the bending is exaggerated, where that is less than was asked for."""
    times = drawable_bending(robot, q, wanted)
    if times == wanted:
        return ""
    return (
        f'<div style="color:{MUTED}">Drawn × {times:.3g} here: more would displace the arm by over '
        f"{MAX_DRAWN * robot.reach * 1e3:.0f} mm.</div>"
    )


def _joints(robot: Robot, bending: Bending) -> str:
    """One line per joint: what it carries, and by how much it bends."""
    rows = []
    columns = zip(shown_joints(robot, bending.about), shown_units(robot), strict=True)
    for i, (turned, unit) in enumerate(columns):
        about = f"{turned:+.4f}{unit}" if turned else "0"
        loads = ("", "") if bending.moment is None else (f"{m:.2f}" for m in bending.moment[i].round(2) + 0.0)
        tipped = f"{np.rad2deg(bending.across[i]):.4f}°" if bending.across[i] else "0"
        cells = (f"Joint {i + 1}", *loads, about, tipped)
        rows.append(tuple(cell.replace("-", "−") for cell in cells))
    names = ", ".join(dict.fromkeys(str(effect.name) for effect in robot.effects))
    return (
        table(("", "N m about", "across", "turned", "tilted"), rows)
        + f'<div style="margin-top:4px">{badge("Deflected arm", css(DEFLECTED))} '
        f'<span style="color:{MUTED}">by {text(names)}</span></div>'
    )
