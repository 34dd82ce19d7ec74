"""How the last steps changed the plate: the predicted error after each."""

from typing import Any

import numpy as np
import viser

from workbench.session.state import Score, Session
from workbench.views.appearance.colours import SELECTED, css
from workbench.views.page.html import GOOD, MUTED, block, heading, number, text
from workbench.views.page.panels.panel import AbstractPanel

WIDTH, HEIGHT, MARGIN = 340, 64, 6
SHOWN = 40
"""Steps drawn at most."""


class HistoryPanel(AbstractPanel):
    """A small plot; the best step is marked."""

    def build(self, server: viser.ViserServer) -> None:
        self._html = server.gui.add_html("")

    def parts(self, session: Session) -> tuple[Any, ...]:
        return (session.history,)

    def show(self, session: Session) -> None:
        scores = session.history[-SHOWN:]
        self._html.content = block(_plot(scores), testid="history") if len(scores) > 1 else ""


def _plot(scores: tuple[Score, ...]) -> str:
    values = np.array([s.position for s in scores])
    words = "Predicted error after each step [mm]"
    if not np.isfinite(values).any():
        values, words = np.array([s.indices["O1"] for s in scores]), "Index O1 after each step"
    finite = np.isfinite(values)
    if finite.sum() < 2:
        return ""
    logs = np.log(np.maximum(np.where(finite, values, np.nan), 1e-12))
    low, high = np.nanmin(logs), np.nanmax(logs)
    x = MARGIN + (WIDTH - 2 * MARGIN) * np.arange(len(values)) / (len(values) - 1)
    y = MARGIN + (HEIGHT - 2 * MARGIN) * (1.0 - (logs - low) / max(high - low, 1e-9))
    line = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x[finite], y[finite], strict=True))
    best = int(np.nanargmin(np.where(finite, values, np.nan)))
    points = enumerate(zip(x.tolist(), y.tolist(), values.tolist(), strict=True))
    dots = "".join(_dot(*point, i == best) for i, point in points if finite[i])
    return heading(words) + (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="100%">'
        f'<polyline points="{line}" fill="none" style="stroke:{MUTED}" stroke-width="1.2"/>{dots}</svg>'
    )


def _dot(x: float, y: float, value: float, is_best: bool) -> str:
    colour, radius = (GOOD, 4.5) if is_best else (css(SELECTED), 2.6)
    words = f"{number(1e3 * value)} mm" + (", the best so far" if is_best else "")
    title = f"<title>{text(words)}</title>"
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" fill="{colour}">{title}</circle>'
