"""Panels: the yield of the current plate; plates of several sizes and ways to make them, to open one."""

from functools import partial

import numpy as np
import viser

from workbench.extras.production.session import MAX_ARMS, OpenChoice, TryPlate, WeighPlates, choices_of
from workbench.extras.production.tradeoff import Choice
from workbench.session.commands.identify import SetWanted
from workbench.session.state import Session, Tab
from workbench.views.page.html import MUTED, block, heading, number, text
from workbench.views.page.panels.index import FIELDS
from workbench.views.page.panels.panel import AFTERWARDS, AbstractPanel, ask, on_press

TIMES = 3.0
"""Required error that is offered where none is set, as a multiple of the predicted one, then rounded up."""
MAX_OPENED_PLATES = 24
"""Plates that can be opened from the page."""


class YieldPanel(AbstractPanel):
    """A number of arms, a button, and one sentence."""

    tab, order = Tab.PLATE, 50
    depends = ("is_idle", "trial", "tried")

    def build(self, gui: viser.GuiApi) -> None:
        self._try = self.press(
            "Try this plate",
            self._pressed,
            viser.Icon.CHART_BAR,
            "Calibrate virtual arms with random manufacturing errors on it: the share that meets the "
            "required error everywhere in the region, and which error source dominates. Takes about a "
            "minute; Cancel stops it.",
        )
        self._result = gui.add_html("", visible=False)
        self._arms = self.number(
            "Virtual arms",
            TryPlate.arms,
            (1, MAX_ARMS, 1),
            "Number of arms to try. More arms give a narrower interval and take longer.",
        )

    def _pressed(self, event: viser.GuiEvent) -> None:
        """Try the plate; ask first what the arms have to keep, if that is not known."""
        session, arms = self._worker.session, int(self._arms.value)
        if session.choices.wanted is not None:
            self._worker.submit(TryPlate(arms))
            return
        predicted = 1e3 * session.score.position
        offered = _round_up(TIMES * predicted) if np.isfinite(predicted) else 1.0
        fields: list[viser.GuiNumberHandle] = []

        def build(gui: viser.GuiApi) -> None:
            field = gui.add_number(
                FIELDS[0][0], offered, min=0.001, max=1000.0, step=0.001, hint=FIELDS[0][1]
            )
            fields.append(field)

        def begin() -> None:
            self._worker.submit(SetWanted(1e-3 * float(fields[0].value)))
            self._worker.submit(TryPlate(arms))

        known = f" {number(predicted)} mm rms are predicted." if np.isfinite(predicted) else ""
        question = f"How accurate must every arm be, everywhere in the region?{known}"
        ask(event, "Required error", question, "Try with this", begin, build=build)

    def show(self, session: Session) -> None:
        self._try.disabled = session.page.job is not None
        self._result.visible = session.trial is not None
        self._result.content = result(session)


def _round_up(value: float) -> float:
    """The next of 1, 2, 5, 10 … ."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= value))


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
            self._weigh = self.button(
                "Compare plates",
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
        self._weigh.disabled = session.page.job is not None
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
