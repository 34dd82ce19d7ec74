"""The selected target: its pose, state, branch and lock; undo and redo."""

import numpy as np
import viser

from workbench.arm.inverse.branch import LIMIT_MARGIN
from workbench.arm.robot import Robot
from workbench.base.wording import capital
from workbench.plate.collision import unobstructed
from workbench.plate.plate import AUTO, Target
from workbench.session.commands.drag import MoveTarget, SelectTarget
from workbench.session.commands.edit import (
    AddTarget,
    ChooseBranch,
    CopyTarget,
    DeleteTarget,
    LockTarget,
    free_place,
)
from workbench.session.commands.undo import Redo, ResetTargets, RestoreBest, Undo
from workbench.session.reach import from_limit
from workbench.session.state import Session, Tab
from workbench.session.target_state import TargetState
from workbench.session.worker import Worker
from workbench.views.appearance.colours import BLOCKED, OUT_OF_REACH, REACHED, css
from workbench.views.page.html import CAREFUL, MUTED, badge, block, text
from workbench.views.page.panels.coordinates import Coordinates, Measure
from workbench.views.page.panels.panel import AbstractPanel, set_options, set_value

LEFT_TO_PROGRAM = "automatic"
MARK = " · blocked"
ROUNDED = 1e-6
HIDDEN = "The scene shows measured rows; plate and targets are hidden."


class TargetsPanel(AbstractPanel):
    """Place and state of the selected target."""

    tab, order = Tab.PLATE, 10
    depends = ("plate", "selected", "states", "drag", "page.units", "shows_plate")

    def build(self, gui: viser.GuiApi) -> None:
        self._choice = gui.add_dropdown(
            "Target",
            ["1"],
            hint="The target that the arm goes to; clicking a block in the scene does the same.",
        )
        self.sends(self._choice, lambda: SelectTarget(self._number))
        self._xyz = Coordinates(
            gui, "x, y, z", Measure.LENGTH, hint="x, y and z of the tool at the target, in the base frame."
        )
        self._rpy = Coordinates(
            gui,
            "Angles",
            Measure.ANGLE,
            hint="Roll, pitch and yaw of the tool: turned about x, then y, then z of the base.",
        )
        for field in (self._xyz, self._rpy):
            self.sends(field.control, self._typed)
        self._state = gui.add_html("")
        self._show_plate = self.button(
            "Show the plate",
            lambda: SelectTarget(self._number),
            viser.Icon.EYE,
            "Show plate and targets in the scene again, instead of the measured rows.",
            visible=False,
        )
        self._locked = gui.add_checkbox("Locked", False, hint="Keep this target fixed when others are moved.")
        self.sends(self._locked, lambda: LockTarget(self._number, self._locked.value))
        self._build_buttons(gui)

    def show(self, session: Session) -> None:
        i = session.selected
        target, state = session.plate.targets[i], session.states[i]
        set_options(self._choice, [str(k + 1) for k in range(len(session.plate))], str(i + 1))
        self._xyz.show(target.xyz, session.page.units)
        self._rpy.show(target.rpy, session.page.units)
        set_value(self._locked, target.locked)
        is_hidden = not session.shows_plate
        self._show_plate.visible = is_hidden
        self._edit.visible = not is_hidden
        self._locked.disabled = is_hidden
        for field in (self._xyz, self._rpy):
            field.control.disabled = is_hidden or target.locked
        sentence = text(HIDDEN) if is_hidden else _state(target, state) + near_limit(session.robot, state)
        self._state.content = block(sentence, testid="state", style="margin:4px 0 6px")

    @property
    def _number(self) -> int:
        return int(self._choice.value) - 1

    def _build_buttons(self, gui: viser.GuiApi) -> None:
        self._edit = gui.add_button_group(
            "Target",
            ("Add", "Copy", "Delete"),
            hint="Add a target in a free place of the region, copy the selected one, or delete it.",
        )
        self.sends_one_of(
            self._edit,
            {
                "Add": lambda: AddTarget(free_place(self._worker.session)),
                "Copy": lambda: CopyTarget(self._number),
                "Delete": lambda: DeleteTarget(self._number),
            },
        )
        self.sends_one_of(
            gui.add_button_group(
                "Steps",
                ("Undo", "Redo", "Best", "Reset"),
                hint="Undo or redo the last step, go back to the best plate so far (lowest "
                "predicted error), or to the plate as loaded.",
            ),
            {"Undo": Undo, "Redo": Redo, "Best": RestoreBest, "Reset": ResetTargets},
        )

    def _typed(self) -> MoveTarget:
        return MoveTarget(self._number, self._xyz.typed, self._rpy.typed)


class BranchesPanel(AbstractPanel):
    """The posture in which the arm reaches the selected target; folded while the program chooses it."""

    tab, order = Tab.PLATE, 12
    depends = ("plate", "selected", "branches", "branches_of", "drag", "shows_plate")

    def __init__(self, worker: Worker):
        super().__init__(worker)
        self._names = {AUTO: LEFT_TO_PROGRAM}

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Branch of the arm", expand_by_default=False):
            self._branch = gui.add_dropdown(
                "Branch",
                [LEFT_TO_PROGRAM],
                hint="The arm's posture there; it is as important as the position.",
            )
            self.sends(self._branch, self._choose_branch)

    def show(self, session: Session) -> None:
        target = session.plate.targets[session.selected]
        known = {b.name: b.name for b in session.branches} if session.branches_of is target else {}
        if known and session.drag is None:
            known |= {name: name + MARK for name in blocked_branches(session)}
        mine = {} if target.branch in (AUTO, *known) else {target.branch: target.branch}
        self._names = {AUTO: LEFT_TO_PROGRAM, **mine, **known}
        set_options(self._branch, list(self._names.values()), self._names[target.branch])
        self._branch.disabled = not session.shows_plate

    def _choose_branch(self) -> ChooseBranch:
        names = {shown: name for name, shown in self._names.items()}
        return ChooseBranch(self._worker.session.selected, names[self._branch.value])


def blocked_branches(session: Session) -> tuple[str, ...]:
    """Names of the selected target's branches in which the arm would run into something."""
    branches = session.branches
    free = unobstructed(session.robot, session.plate, session.selected, branches)
    return tuple(branch.name for branch in branches if not any(branch is other for other in free))


def near_limit(robot: Robot, state: TargetState) -> str:
    """Which joint hardly has room: manufacturing errors may then put the target out of reach."""
    near = from_limit(robot, state.q)
    if not state.reached or near.distance >= LIMIT_MARGIN - ROUNDED:
        return ""
    sentence = f"Joint {near.joint + 1} is {near.text} from its limit; Improve keeps 10° on every joint."
    return f'<div data-testid="near-limit" style="color:{CAREFUL}">{sentence}</div>'


def _state(target: Target, state: TargetState) -> str:
    if state.measurable:
        return badge("Reached", css(REACHED)) + f'<span style="color:{MUTED}"> · {text(state.branch)}</span>'
    if state.reached:
        sentence = "Choose another branch, or move the target."
        return (
            badge("Blocked", css(BLOCKED))
            + f'<span style="color:{MUTED}"> · {text(state.branch)}</span>'
            + f"<div>In this posture {text(state.hit)}.</div>"
            + f'<div style="color:{MUTED}">{sentence}</div>'
        )
    distance, angle = state.missing
    if " off" in state.reason:  # it says how far, for the nearest orientation there
        distance = angle = 0.0
    short = (
        f"The arm stops {1e3 * distance:.1f} mm and {np.rad2deg(angle):.1f}° short of it. Drag the target "
        "back, or press Undo."
        if distance > 1e-6 or angle > 1e-6
        else "Turn or move the target, or press Undo."
        if target.branch == AUTO
        else "Choose another branch, or set the branch to automatic."
    )
    return (
        badge("Out of reach", css(OUT_OF_REACH))
        + f"<div>{text(capital(state.reason))}.</div>"
        + f'<div style="color:{MUTED}">{short}</div>'
    )
