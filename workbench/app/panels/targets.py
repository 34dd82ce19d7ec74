"""The targets: choose one, type its place, take moves back."""

import numpy as np
import viser

from workbench.app.html import MUTED, badge, block, text
from workbench.app.panels.panel import AbstractPanel, on_change, set_value
from workbench.appearance.colours import BLOCKED, OUT_OF_REACH, REACHED, css
from workbench.session.commands import MoveTarget, Redo, ResetTargets, SelectTarget, Undo
from workbench.session.state import Session, TargetState
from workbench.session.worker import Worker
from workbench.types import Vector3

UNDO, REDO, RESET = "Undo", "Redo", "Reset"


class TargetsPanel(AbstractPanel):
    """Place and state of the selected target."""

    def __init__(self, worker: Worker):
        self._worker = worker

    def build(self, server: viser.ViserServer) -> None:
        """Choice, coordinates, state, history."""
        gui, session = server.gui, self._worker.session
        names = [str(i + 1) for i in range(len(session.plate))]
        self._choice = gui.add_dropdown(
            "Target",
            names,
            hint="The target that the arm goes to; clicking a block in the scene does the same.",
        )
        on_change(self._choice, lambda: self._worker.submit(SelectTarget(int(self._choice.value) - 1)))
        self._xyz = gui.add_vector3(
            "Position [mm]",
            (0.0, 0.0, 0.0),
            step=0.1,
            hint="x, y and z of the tool at the target, from the base.",
        )
        self._rpy = gui.add_vector3(
            "Angles [°]",
            (0.0, 0.0, 0.0),
            step=0.1,
            hint="Roll, pitch and yaw of the tool: turned about x, then y, then z of the base.",
        )
        for field in (self._xyz, self._rpy):
            on_change(field, self._typed)
        self._state = gui.add_html("")
        self._history = gui.add_button_group(
            "Moves",
            (UNDO, REDO, RESET),
            hint="Take the last move back, make it again, or put all targets back where they were at first.",
        )
        commands = {UNDO: Undo(), REDO: Redo(), RESET: ResetTargets()}

        @self._history.on_click
        async def _(event: viser.GuiEvent) -> None:
            self._worker.submit(commands[event.target.value])

    def show(self, session: Session) -> None:
        """The selected target."""
        i = session.selected
        target, state = session.plate.targets[i], session.states[i]
        set_value(self._choice, str(i + 1))
        set_value(self._xyz, _millimetres(target.xyz))
        set_value(self._rpy, _degrees(target.rpy))
        self._state.content = block(_state(state), testid="state", style="margin:4px 0 6px")

    def _typed(self) -> None:
        """What was typed; numbers that were not touched keep all their digits."""
        i = int(self._choice.value) - 1
        target = self._worker.session.plate.targets[i]
        xyz = _merge(self._xyz.value, _millimetres(target.xyz), target.xyz, 1e-3)
        rpy = _merge(self._rpy.value, _degrees(target.rpy), target.rpy, float(np.deg2rad(1.0)))
        self._worker.submit(MoveTarget(i, xyz, rpy))


def _millimetres(xyz: Vector3) -> tuple[float, ...]:
    return tuple((np.round(1e3 * xyz, 2) + 0.0).tolist())


def _degrees(rpy: Vector3) -> tuple[float, ...]:
    return tuple((np.round(np.rad2deg(rpy), 3) + 0.0).tolist())


def _merge(typed, shown, exact, unit: float) -> tuple[float, float, float]:
    x, y, z = (
        float(old) if new == was else float(unit * new)
        for new, was, old in zip(typed, shown, exact, strict=True)
    )
    return x, y, z


def _state(state: TargetState) -> str:
    branch = (
        f'<span style="color:{MUTED}" title="Which solution of the inverse kinematics the arm takes. It '
        f'matters for the accuracy as much as the place."> · {text(state.branch)}</span>'
    )
    if state.reached and state.clear:
        return badge("Reached", css(REACHED)) + branch
    if state.reached:
        words = "In this posture the arm would run into the plate."
        return badge("Blocked", css(BLOCKED)) + branch + f'<div style="color:{MUTED}">{words}</div>'
    distance, angle = state.missing
    return (
        badge("Out of reach", css(OUT_OF_REACH))
        + f"<div>{text(state.reason[:1].upper() + state.reason[1:])}.</div>"
        + f'<div style="color:{MUTED}">The arm stops {1e3 * distance:.1f} mm and {np.rad2deg(angle):.1f}° '
        + "short of it. Drag the target back, or press Undo.</div>"
    )
