"""History of the plate: the predicted error after each step, and a way back to any of them."""

import numpy as np
import viser

from workbench.session.commands.undo import GoBackTo
from workbench.session.state import Score, Session
from workbench.views.appearance.colours import SELECTED, css
from workbench.views.page.html import GOOD, LINE, MUTED, block, heading, label, number, text
from workbench.views.page.panels.panel import AbstractPanel, set_options

WIDTH, HEIGHT, LEFT, FOOT, MARGIN = 340, 78, 38, 14, 6
SHOWN = 40
"""Steps drawn at most."""
HERE = "–"


class HistoryPanel(AbstractPanel):
    """A small plot with its numbers; the best step is marked, and any step can be restored."""

    depends = ("history",)

    def build(self, gui: viser.GuiApi) -> None:
        self._html = gui.add_html("")
        self._back = gui.add_dropdown(
            "Go back to",
            [HERE],
            visible=False,
            hint="Put the plate back to how it was after one of these steps; Undo reverts this.",
        )
        self.sends(self._back, self._go_back)

    def show(self, session: Session) -> None:
        first = max(len(session.history) - SHOWN, 0)
        scores = session.history[first:]
        is_shown = len(scores) > 1
        self._html.content = block(_plot(scores, first), testid="history") if is_shown else ""
        self._back.visible = is_shown
        set_options(self._back, [HERE, *step_names(scores, first)], HERE)

    def _go_back(self) -> GoBackTo | None:
        name = self._back.value
        return None if name == HERE else GoBackTo(int(name.split()[1].rstrip(":")) - 1)


def values_of(scores: tuple[Score, ...]) -> tuple[np.ndarray, str, str]:
    """A number for every step, its unit, and what it is."""
    values = 1e3 * np.array([s.position for s in scores])
    if np.isfinite(values).any():
        return values, "mm", "Predicted error after each step, rms [mm]"
    return np.array([s.indices["O1"] for s in scores]), "", "Index O1 after each step"


def step_names(scores: tuple[Score, ...], first: int) -> list[str]:
    """The steps in words, the latest first; the present one is left out."""
    values, unit, _ = values_of(scores)
    best = _best(values, unit)
    names = [
        f"Step {first + i + 1}: {number(float(value))} {unit}".rstrip() + (" (best)" if i == best else "")
        for i, value in enumerate(values[:-1])
    ]
    return names[::-1]


def _best(values: np.ndarray, unit: str) -> int:
    known = np.where(np.isfinite(values), values, np.nan)
    if np.isnan(known).all():
        return -1
    return int(np.nanargmin(known) if unit else np.nanargmax(known))


def _plot(scores: tuple[Score, ...], first: int) -> str:
    values, unit, words = values_of(scores)
    finite = np.isfinite(values)
    if finite.sum() < 2:
        return ""
    logs = np.log(np.maximum(np.where(finite, values, np.nan), 1e-12))
    low, high = np.nanmin(logs), np.nanmax(logs)
    room = HEIGHT - 2 * MARGIN
    x = LEFT + MARGIN + (WIDTH - LEFT - 2 * MARGIN) * np.arange(len(values)) / (len(values) - 1)
    y = MARGIN + room * (1.0 - (logs - low) / max(high - low, 1e-9))
    line = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x[finite], y[finite], strict=True))
    best = _best(values, unit)
    points = enumerate(zip(x.tolist(), y.tolist(), values.tolist(), strict=True))
    dots = "".join(_dot(first + i + 1, *point, unit, i == best) for i, point in points if finite[i])
    ends = [(MARGIN + 4, np.nanmax(values)), (HEIGHT - MARGIN + 4, np.nanmin(values))]
    numbers = "".join(label(LEFT - 4, at, number(float(value)), anchor="end") for at, value in ends)
    steps = label(LEFT + MARGIN, HEIGHT + FOOT - 2, f"step {first + 1}")
    steps += label(WIDTH - 2, HEIGHT + FOOT - 2, f"{first + len(values)}", anchor="end")
    return heading(words) + (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT + FOOT}" width="100%">'
        f'<path d="M{LEFT} 0V{HEIGHT}H{WIDTH}" fill="none" style="stroke:{LINE}"/>{numbers}{steps}'
        f'<polyline points="{line}" fill="none" style="stroke:{MUTED}" stroke-width="1.2"/>{dots}</svg>'
    )


def _dot(step: int, x: float, y: float, value: float, unit: str, is_best: bool) -> str:
    colour, radius = (GOOD, 4.5) if is_best else (css(SELECTED), 2.6)
    words = f"step {step}: {number(value)} {unit}" + (", the best so far" if is_best else "")
    title = f"<title>{text(words)}</title>"
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" fill="{colour}">{title}</circle>'
