"""Panel: the yield of the current plate."""

import viser

from workbench.extras.production.session import MAX_ARMS, TryPlate
from workbench.session.live_score import PlateTrial
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import MUTED, block, heading, text
from workbench.views.page.panels.index import try_plate
from workbench.views.page.panels.panel import AbstractPanel


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
            disabled=lambda session: session.page.job is not None,
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
