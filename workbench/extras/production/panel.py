"""Panels: the yield of the current plate; plates of several sizes and ways to make them, to open one."""

from functools import partial

import viser

from workbench.extras.production.session import MAX_ARMS, OpenChoice, TryPlate, WeighPlates, choices_of
from workbench.session.live_score import PlateTrial
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import MUTED, block, heading, number, text
from workbench.views.page.panels.index import try_plate
from workbench.views.page.panels.panel import AFTERWARDS, AbstractPanel

MAX_OPENED_PLATES = 24
"""Plates that can be opened from the page."""


class YieldPanel(AbstractPanel):
    """A number of arms, a button, and one sentence."""

    tab, order = Tab.PLATE, 50
    depends = ("is_idle", lambda session: session.part(PlateTrial), "tried")

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
    trial = session.part(PlateTrial)
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
            for i in range(MAX_OPENED_PLATES):
                row, hint = partial(row_text, i), "Open this plate; Undo reverts this."
                open_it = partial(OpenChoice, i)
                self.button("–", open_it, None, hint, visible=row, disabled=_is_busy, label=row)


def row_text(i: int, session: Session) -> str:
    """A plate in one line; nothing if there are fewer."""
    found = choices_of(session)[i : i + 1]
    return "".join(f"{i + 1}: {one.name}: {number(1e3 * one.design.cost)} mm" for one in found)
