"""Trade-off: error against price of plates that could be made; click a dot or row to open one."""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import viser

from workbench.session.commands.plate import OpenChoice, WeighPlates
from workbench.session.state import Session
from workbench.views.page.html import LINE, MUTED, block, heading, number, text
from workbench.views.page.panels.panel import AFTERWARDS, AbstractPanel, on_press

if TYPE_CHECKING:
    from workbench.plate.tradeoff import Choice, Tradeoff

WIDTH, HEIGHT, LEFT, FOOT, ROOM = 340, 150, 34, 16, 12
MOST = 24
"""Plates that can be opened from the page."""


class TradeoffPanel(AbstractPanel):
    """A button to compare plates, a plot, and a row for each plate that opens it; folded.

    Attributes:
        links: What opens a plate from its dot; none where pages can't tell.
    """

    pause = AFTERWARDS
    depends = ("tradeoff", "is_idle")
    links: tuple[str, ...] = ()

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("What does it buy me", expand_by_default=False):
            self._weigh = self.button(
                "Weigh plates",
                WeighPlates,
                viser.Icon.SCALE,
                "Search plates with 8 and 12 targets, machined, printed, on a breadboard, with a ball-bar, "
                "and plot their predicted error against their price. Takes a few minutes; Cancel stops it.",
            )
            self._html = gui.add_html("")
            self._rows = [
                gui.add_button("–", color="gray", visible=False, hint="Open this plate; Undo reverts this.")
                for _ in range(MOST)
            ]
        for i, row in enumerate(self._rows):
            on_press(row, partial(self.open, i))

    def show(self, session: Session) -> None:
        found = session.tradeoff
        self._weigh.disabled = session.job is not None
        self._html.content = (
            ""
            if found is None
            else block(plot(found, self.links if session.job is None else ()), testid="tradeoff")
        )
        choices = () if found is None else found.choices
        for i, row in enumerate(self._rows):
            row.visible = i < len(choices)
            row.disabled = session.job is not None
            if i < len(choices):
                row.label = row_words(i, choices[i])

    def open(self, i: int) -> None:
        """Open a plate."""
        self._worker.submit(OpenChoice(i))


def row_words(i: int, choice: "Choice") -> str:
    """A plate in one line."""
    error = f"{number(1e3 * choice.design.cost)} mm, {choice.price:.0f} €"
    return f"{i + 1}: {choice.name}: {error}"


def plot(found: "Tradeoff", links: tuple[str, ...] = ()) -> str:
    """Error against price, numbered like the rows; the line joins the plates that nothing beats.

    A click on each of the first dots follows its link.
    """
    from workbench.report.figures import COLOURS  # with matplotlib, which no page needs to begin with

    price = np.log([choice.price for choice in found.choices])
    error = np.array([choice.design.cost for choice in found.choices])
    span = max(float(np.ptp(price)), 1e-9)
    x = LEFT + ROOM + (WIDTH - LEFT - 2 * ROOM) * (price - price.min()) / span
    y = HEIGHT - (HEIGHT - 2 * ROOM) * error / max(float(error.max()), 1e-12)
    colours = dict(zip(dict.fromkeys(choice.manner for choice in found.choices), COLOURS, strict=False))
    front = [found.choices.index(choice) for choice in found.front]
    line = " ".join(f"{x[i]:.1f},{y[i]:.1f}" for i in front)
    dots = "".join(
        (f'<a href="{text(links[i])}">' if any(links[i : i + 1]) else "<a>")
        + f'<circle cx="{x[i]:.1f}" cy="{y[i]:.1f}" r="4" fill="{colours[choice.manner]}">'
        f"<title>{text(row_words(i, choice))}</title></circle></a>"
        f'<text x="{x[i] + 6:.1f}" y="{y[i] - 4:.1f}" font-size="9" style="fill:{MUTED}">{i + 1}</text>'
        for i, choice in enumerate(found.choices)
    )
    ends = (found.choices[0].price, found.choices[-1].price)
    labels = "".join(
        f'<text x="{at:.1f}" y="{high:.1f}" font-size="10" text-anchor="{anchor}" style="fill:{MUTED}">'
        f"{words}</text>"
        for at, high, anchor, words in (
            (x.min(), HEIGHT + FOOT - 3, "middle", f"{ends[0]:.0f} €"),
            (x.max(), HEIGHT + FOOT - 3, "end", f"{ends[1]:.0f} €"),
            (LEFT - 4, 2 * ROOM + 4 - ROOM, "end", number(1e3 * float(error.max()))),
            (LEFT - 4, HEIGHT, "end", "0"),
        )
    )
    legend = " ".join(f'<span style="color:{one}">● {text(name)}</span>' for name, one in colours.items())
    return heading("Predicted error [mm] against price") + (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT + FOOT}" width="100%">'
        f'<path d="M{LEFT} 0V{HEIGHT}H{WIDTH}" fill="none" style="stroke:{LINE}"/>'
        f'<polyline points="{line}" fill="none" style="stroke:{MUTED}" stroke-width="1"/>{dots}{labels}</svg>'
        f"<div>{legend}</div>"
    )
