"""Panels: the yield of the current plate; plates of several sizes and ways to make them, to open one."""

from functools import partial

import viser

from workbench.extras.production.session import MAX_ARMS, OpenChoice, TryPlate, WeighPlates, choices_of
from workbench.extras.production.tradeoff import Choice
from workbench.session.state import Session, Tab
from workbench.views.page.html import MUTED, block, heading, number, text
from workbench.views.page.panels.index import try_plate
from workbench.views.page.panels.panel import AFTERWARDS, AbstractPanel, on_press

MAX_OPENED_PLATES = 24
"""Plates that can be opened from the page."""


class YieldPanel(AbstractPanel):
    """A number of arms, a button, and one sentence."""

    tab, order = Tab.PLATE, 50
    depends = ("is_idle", "trial", "tried")

    def build(self, gui: viser.GuiApi) -> None:
        self.press(
            "Try this plate",
            self._pressed,
            viser.Icon.CHART_BAR,
            "Calibrate virtual arms with random manufacturing errors on it: the share that meets the "
            "required error everywhere in the region, and which error source dominates. Takes about a "
            "minute; Cancel stops it.",
            disabled=_is_busy,
        )
        self.html(result)
        self._arms = self.number(
            "Virtual arms",
            (1, MAX_ARMS, 1),
            "Number of arms to try. More arms give a narrower interval and take longer.",
            value=TryPlate.arms,
        )

    def _pressed(self, event: viser.GuiEvent) -> None:
        try_plate(event, self._worker, TryPlate(self._arms.typed))


def _is_busy(session: Session) -> bool:
    return session.page.job is not None


def result(session: Session) -> str:
    """The last yield as text, if there is one."""
    trial = session.trial
    if trial is None:
        return ""
    content = heading("Yield") + f"<div>{text(trial.text)}.</div>"
    if session.tried is None:
        note = "The plate, the instrument or the required error has changed since; try again."
        content += f'<div style="color:{MUTED}">{note}</div>'
    return block(content, testid="yield", style="margin:4px 0")


class TradeoffPanel(AbstractPanel):
    """A button to compare plates, and a row for each plate that opens it; folded."""

    tab, order = Tab.PLATE, 76
    pause = AFTERWARDS
    depends = ("parts", "is_idle")

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Cost and accuracy of plates", expand_by_default=False):
            self.button(
                "Compare plates",
                WeighPlates,
                viser.Icon.SCALE,
                "Search plates with 8 and 12 targets, machined, printed, on a breadboard, with a ball-bar, "
                "and compare their predicted errors. Takes a few minutes; Cancel stops it.",
                disabled=_is_busy,
            )
            self._rows = [
                gui.add_button("–", color="gray", visible=False, hint="Open this plate; Undo reverts this.")
                for _ in range(MAX_OPENED_PLATES)
            ]
        for i, row in enumerate(self._rows):
            on_press(row, partial(self._open, i))

    def show(self, session: Session) -> None:
        choices = choices_of(session)
        for i, row in enumerate(self._rows):
            row.visible = i < len(choices)
            row.disabled = session.page.job is not None
            if i < len(choices):
                row.label = row_text(i, choices[i])

    def _open(self, i: int) -> None:
        self._worker.submit(OpenChoice(i))


def row_text(i: int, choice: Choice) -> str:
    """A plate in one line."""
    return f"{i + 1}: {choice.name}: {number(1e3 * choice.design.cost)} mm"
