"""Panel: search plates of several sizes and ways to make them, and open one."""

from functools import partial

import viser

from workbench.extras.production.session import OpenChoice, WeighPlates, choices_of
from workbench.extras.production.tradeoff import Choice
from workbench.session.state import Session, Tab
from workbench.views.page.html import number
from workbench.views.page.panels.panel import AFTERWARDS, AbstractPanel, on_press

MAX_OPENED_PLATES = 24
"""Plates that can be opened from the page."""


class TradeoffPanel(AbstractPanel):
    """A button to compare plates, and a row for each plate that opens it; folded."""

    tab, order = Tab.PLATE, 76
    pause = AFTERWARDS
    depends = ("parts", "is_idle")

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("What does it buy me", expand_by_default=False):
            self._weigh = self.button(
                "Weigh plates",
                WeighPlates,
                viser.Icon.SCALE,
                "Search plates with 8 and 12 targets, machined, printed, on a breadboard, with a ball-bar, "
                "and compare their predicted errors. Takes a few minutes; Cancel stops it.",
            )
            self._rows = [
                gui.add_button("–", color="gray", visible=False, hint="Open this plate; Undo reverts this.")
                for _ in range(MAX_OPENED_PLATES)
            ]
        for i, row in enumerate(self._rows):
            on_press(row, partial(self._open, i))

    def show(self, session: Session) -> None:
        choices = choices_of(session)
        self._weigh.disabled = session.job is not None
        for i, row in enumerate(self._rows):
            row.visible = i < len(choices)
            row.disabled = session.job is not None
            if i < len(choices):
                row.label = row_words(i, choices[i])

    def _open(self, i: int) -> None:
        self._worker.submit(OpenChoice(i))


def row_words(i: int, choice: Choice) -> str:
    """A plate in one line."""
    return f"{i + 1}: {choice.name}: {number(1e3 * choice.design.cost)} mm"
