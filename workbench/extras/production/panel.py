"""Panel: the yield of the current plate."""

import viser

from workbench.extras.production.session import TryPlate
from workbench.session.live_score import PlateTrial
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import MUTED, block, heading, text
from workbench.views.page.panels.panel import AbstractPanel


class YieldPanel(AbstractPanel):
    """A button, and one sentence."""

    tab, order = Tab.PLATE, 22
    depends = ("is_idle", lambda session: session.part(PlateTrial), "tried")

    def build(self, gui: viser.GuiApi) -> None:
        self.button(
            "Try this plate",
            TryPlate,
            viser.Icon.CHART_BAR,
            "Calibrate virtual arms with random manufacturing errors: what 95 % of them keep everywhere in "
            "the region, or how many the required error. Takes half a minute; Cancel stops it.",
            disabled=lambda session: session.page.job is not None,
        )
        self.html(result)


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
