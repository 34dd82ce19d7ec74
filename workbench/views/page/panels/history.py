"""History of the plate: the predicted error after each step, and a way back to any of them."""

from collections.abc import Sequence
from functools import partial

import numpy as np
import viser

from workbench.report.chart import Chart, Marks
from workbench.session.commands.undo import GoBackTo
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.appearance.colours import SELECTED, css
from workbench.views.page.html import GOOD, MUTED, block, heading, number
from workbench.views.page.panels.panel import AbstractPanel

SHOWN = 40
"""Steps drawn at most."""


class HistoryPanel(AbstractPanel):
    """A small plot; the best step is marked, and a click on any of them puts the plate back to it."""

    tab, order = Tab.PLATE, 60
    depends = ("history.past",)

    def build(self, gui: viser.GuiApi) -> None:
        self.html(self._plot)

    def _plot(self, session: Session) -> str:
        past = session.history.past
        first = max(len(past) - SHOWN, 0)
        links = [
            self.link(f"step-{k}", partial(self.send, partial(GoBackTo, k))) for k in range(first, len(past))
        ]
        drawn = plot([step.score.position for step in past[first:]], first, links)
        return block(drawn, testid="history") if len(links) > 1 else ""


def plot(positions: Sequence[float], first: int, links: Sequence[str] = ()) -> str:
    """The error after each step [m]; a click on a point leads back to it."""
    values = 1e3 * np.array(positions)
    if np.isfinite(values).sum() < 2:
        return ""
    x, best = np.arange(len(values), dtype=float), int(np.nanargmin(values))
    titles = [
        f"step {first + k + 1}: {number(float(v))} mm" + (", the best so far" if k == best else "")
        for k, v in enumerate(values)
    ]
    points = Marks(x, values, css(SELECTED), titles, links)
    top = Marks(x[[best]], values[[best]], GOOD, [titles[best]], links[best : best + 1], radius=4.5)
    ends = (f"step {first + 1}", str(first + len(values)))
    line = Marks(x, values, MUTED, is_line=True)
    chart = Chart((line, points, top), 78.0, ends, is_log=True)
    title = "Predicted error after each step, rms [mm]; click one to go back to it"
    return heading(title) + chart.svg()
