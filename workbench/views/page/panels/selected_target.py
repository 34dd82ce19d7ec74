"""The selected target: its pose, state, branch and lock."""

import viser

from workbench.base.wording import capital
from workbench.plate.collision import unobstructed
from workbench.plate.plate import AUTO, Target
from workbench.session.commands.drag import MoveTarget, SelectTarget
from workbench.session.commands.edit import AddTarget, ChooseBranch, DeleteTarget, LockTarget, free_place
from workbench.session.commands.undo import RestoreBest
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.session.target_postures import TargetState, branches_to, clearance
from workbench.views.appearance.colours import BLOCKED, OUT_OF_REACH, REACHED, css
from workbench.views.page.html import MUTED, badge, block, text
from workbench.views.page.panels.form import ANGLE, LENGTH
from workbench.views.page.panels.panel import AbstractPanel


class TargetsPanel(AbstractPanel):
    """Place and state of the selected target; the posture in which the arm reaches it, folded while the
    program chooses it."""

    tab, order = Tab.PLATE, 10
    depends = ("robot", "plate", "selected", "states", "drag", "shows_plate", "choices.overlay")

    def build(self, gui: viser.GuiApi) -> None:
        chosen = self.dropdown(
            "Target",
            lambda s: {str(k + 1): k for k in range(len(s.plate))},
            "The target that the arm goes to; clicking a block in the scene does the same.",
            lambda s: s.selected,
        )
        self.form(SelectTarget, chosen)
        hint = "x, y and z of the tool at the target, in the base frame."
        xyz = self.coordinates("x, y, z", LENGTH, hint, lambda s: _target(s).xyz, disabled=_is_fixed)
        hint = "Roll, pitch and yaw of the tool: turned about x, then y, then z of the base."
        rpy = self.coordinates("Angles", ANGLE, hint, lambda s: _target(s).rpy, disabled=_is_fixed)
        self.form(lambda *pose: MoveTarget(chosen.typed, *pose), xyz, rpy)
        self.html(_selected)
        hint = "Keep this target fixed when others are moved."
        locked = self.checkbox("Locked", hint, lambda s: _target(s).locked, disabled=_is_hidden)
        self.sends(locked, lambda: LockTarget(chosen.typed, locked.typed))
        self.buttons(
            "Target",
            {
                "Add": lambda: AddTarget(free_place(self._worker.session)),
                "Delete": lambda: DeleteTarget(chosen.typed),
                "Back to the best plate": RestoreBest,
            },
            "Add a target like the selected one in a free place of the region, or delete the selected one; "
            "go back to the plate with the lowest predicted error so far.",
            visible=lambda s: s.shows_plate,
        )
        with gui.add_folder("Branch of the arm", expand_by_default=False):
            branch = self.dropdown(
                "Branch",
                _branches,
                "The arm's posture there; it is as important as the position.",
                lambda s: _target(s).branch,
                disabled=_is_hidden,
            )
            hint = "Show the other branches that reach the target as faint arms."
            ghosts = self.checkbox(
                "Show the others", hint, lambda s: s.choices.overlay.ghosts, disabled=_is_hidden
            )
        self.form(lambda is_on: self.overlaid(ghosts=is_on), ghosts)
        self.form(lambda name: ChooseBranch(self._worker.session.selected, name), branch)


def _is_hidden(session: Session) -> bool:
    return not session.shows_plate


def _target(session: Session) -> Target:
    return session.plate.targets[session.selected]


def _is_fixed(session: Session) -> bool:
    return _is_hidden(session) or _target(session).locked


def _selected(session: Session) -> str:
    """State of the selected target; nothing while the plate is hidden, which the strip says."""
    if not session.shows_plate:
        return ""
    shown = _state(state := session.states[session.selected])
    if state.measurable and (gap := clearance(session.robot, session.plate, state.q)):
        shown += f'<div data-testid="clearance" style="color:{MUTED}">{capital(gap)}.</div>'
    return block(shown, testid="state", style="margin:4px 0 6px")


def _branches(session: Session) -> dict[str, str]:
    """Branches of the selected target, by what they are called on the page."""
    target = _target(session)
    found = () if session.drag is not None else branches_to(session.robot, target)
    free = {branch.name for branch in unobstructed(session.robot, session.plate, session.selected, found)}
    known = {branch.name: branch.name + " · blocked" * (branch.name not in free) for branch in found}
    mine = {} if target.branch in (AUTO, *known) else {target.branch: target.branch}
    names = {AUTO: "automatic", **mine, **known}
    return {shown: name for name, shown in names.items()}


def _state(state: TargetState) -> str:
    branch = state.branch and f'<span style="color:{MUTED}"> · {text(state.branch)}</span>'
    if state.measurable:
        return badge("Reached", css(REACHED)) + branch
    named = badge("Blocked", css(BLOCKED)) if state.reached else badge("Out of reach", css(OUT_OF_REACH))
    why = f"In this posture {state.hit}" if state.reached else capital(state.reason)
    way = f'<div style="color:{MUTED}">Choose another branch, or move the target.</div>'
    return f"{named}{branch}<div>{text(why)}.</div>{way}"
