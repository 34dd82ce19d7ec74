"""What the demo says, with the number that counts, over the scene; and a way out of it."""

from collections.abc import Callable

import viser

from workbench.session.guide import guide
from workbench.session.state import Session
from workbench.session.worker import Worker
from workbench.views.page.html import text
from workbench.views.page.panels.panel import AbstractPanel
from workbench.views.page.style import CAPTION

WITH_MY_ROBOT = "With my robot"


class CaptionPanel(AbstractPanel):
    """Large words where one looks, and a link that does `leave`; the scene behind can be turned."""

    keeps_typed = True
    depends = (guide, "caption")

    def __init__(self, worker: Worker, leave: Callable[[], None]):
        super().__init__(worker)
        self._leave = leave

    def build(self, gui: viser.GuiApi) -> None:
        self._html = gui.add_html("")
        self._address = self.link("with-my-robot", self._leave)

    def show(self, session: Session) -> None:
        self._html.content = caption(session, self._address) if session.caption else ""


def caption(session: Session, address: str) -> str:
    """The overlay in HTML."""
    figure = guide(session).figure
    number = f'<div data-testid="figure-now" class="figure">{text(figure)}</div>' if figure else ""
    way_out = f'<a href="{text(address)}">{WITH_MY_ROBOT}</a>' if address else ""
    words = f'<div data-testid="caption">{text(session.caption)}</div>'
    return f"<div {CAPTION}>{number}{words}{way_out}</div>"
