"""How far an error in each constant would move the tool in the arm's current posture (Katana §3.5)."""

import re

import numpy as np
import viser

from workbench.arm.kinematics.influence_of_constants import Influence, first_order_influence
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.session.commands.arm import drawn_joints
from workbench.session.state import Session
from workbench.session.worker import Worker
from workbench.views.appearance.colours import SELECTED, css
from workbench.views.page.html import LINE, MUTED, block, heading, number, text
from workbench.views.page.panels.panel import AbstractPanel

WIDTH, HEIGHT, FOOT = 340, 76, 26
SYMBOLS = {"theta": "θ", "alpha": "α", "beta": "β", "roll": "r", "pitch": "p", "yaw": "w"}


class InfluencePanel(AbstractPanel):
    """One bar per constant for the present pose, a line for the range over the targets in reach."""

    pause = 0.5
    depends = ("robot", drawn_joints, "states")

    def __init__(self, worker: Worker):
        super().__init__(worker)
        self._robot: Robot | None = None
        self._at_targets: Influence | None = None

    def build(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Influence of each constant", expand_by_default=False):
            self._html = gui.add_html("")

    def show(self, session: Session) -> None:
        if session.drag is None or session.robot is not self._robot:
            self._robot, self._at_targets = session.robot, _at_targets(session)
        here = first_order_influence(session.robot, Motion(drawn_joints(session)[None]))
        self._html.content = block(
            heading("Motion of the tool here [mm]") + bars(here, self._at_targets or here) + _legend(),
            testid="influence",
        )


def _at_targets(session: Session) -> Influence | None:
    """At all measurable targets; not computed again at every step of a drag."""
    q = [state.q for state in session.states if state.measurable]
    return first_order_influence(session.robot, Motion(np.stack(q))) if q else None


def bars(here: Influence, there: Influence) -> str:
    """Influences in the present pose, and their range at the targets, as a picture."""
    rows, least, greatest = 1e3 * here.distances, 1e3 * there.least, 1e3 * there.greatest
    top = max(float(rows.max()), float(greatest.max()), 1e-9)
    columns = zip(here.names, rows[0], least, greatest, here.weights[0], strict=True)
    step = WIDTH / len(here.names)
    parts = [_bar(*column, x=step * i, step=step, top=top) for i, column in enumerate(columns)]
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT + FOOT}" width="100%">'
        f'<line x1="0" x2="{WIDTH}" y1="{HEIGHT}" y2="{HEIGHT}" style="stroke:{LINE}"/>{"".join(parts)}'
        f'<text x="0" y="9" font-size="9" style="fill:{MUTED}">{number(top)} mm</text></svg>'
    )


def _bar(
    name: str, here: float, least: float, most: float, weight: float, *, x: float, step: float, top: float
) -> str:
    """What one constant does, here and at the targets [mm]."""

    def level(value: float) -> float:
        return HEIGHT - (HEIGHT - 14) * value / top

    middle, symbol = x + 0.5 * step, short_name(name)
    there = f"{number(least)} to {number(most)} mm at the targets"
    words = f"{name}: {number(here)} mm here (k = {weight:.2f}); {there}"
    return (
        f'<g><title>{text(words)}</title><rect x="{x:.1f}" y="0" width="{step:.1f}" '
        f'height="{HEIGHT + FOOT}" fill="transparent"/>'
        f'<rect x="{x + 0.18 * step:.1f}" y="{level(here):.1f}" width="{0.64 * step:.1f}" '
        f'height="{HEIGHT - level(here):.1f}" rx="1" fill="{css(SELECTED)}"/>'
        f'<line x1="{middle:.1f}" x2="{middle:.1f}" y1="{level(least):.1f}" '
        f'y2="{level(most):.1f}" style="stroke:var(--mantine-color-text)" stroke-width="1"/>'
        f'<text text-anchor="middle" font-size="{min(10.0, 0.78 * step):.1f}" style="fill:{MUTED}">'
        f'<tspan x="{middle:.1f}" y="{HEIGHT + 11}">{text(symbol[0])}</tspan>'
        f'<tspan x="{middle:.1f}" y="{HEIGHT + 22}">{text(symbol[1])}</tspan></text></g>'
    )


def short_name(name: str) -> tuple[str, str]:
    """Symbol and number of a constant: `joint2.alpha` is α and 2, one of a fixed joint carries an f."""
    owner, _, part = name.rpartition(".")
    count = re.search(r"\d+$", owner)
    mark = "f" if owner.startswith("fixed") else ""
    return SYMBOLS.get(part, part[:2]), mark + (count.group() if count else "")


def _legend() -> str:
    return (
        f'<div style="color:{MUTED}">For an error of 0.05° of an angle, or 0.1 mm of a length. Lines: the '
        "range over the targets in reach. Hover over a bar for its numbers.</div>"
    )
