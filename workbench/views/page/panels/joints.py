"""Residuals along each joint's motion, plotted over its position, with the law of an effect."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import viser
from jaxtyping import Float

from workbench.arm.joint_units import shown_joints, shown_units
from workbench.session.commands.compare import SetOverlay
from workbench.session.comparison import STAGES, Comparison, ModelStage
from workbench.session.joint_errors import NO_LAW, along_joints, candidates, law_along_joints, shown_effect
from workbench.session.state import Session, Tab
from workbench.views.appearance.colours import BLAMED, css, stage_colours
from workbench.views.page.html import LINE, MUTED, badge, block, heading, label, number
from workbench.views.page.panels.panel import AbstractPanel, set_options

COLUMNS, CELL, PLOT = 2, (190.0, 108.0), (150.0, 70.0)
"""Plots in a row, size of each with its words, and of its frame."""
LEFT, TOP = 34.0, 18.0
MAX_DOTS, BINS, MIN_DOTS = 200, 9, 4
"""Rows drawn, bins of the mean, and rows that a bin has at least."""
MIN_MOVED = float(np.deg2rad(2.0))
"""A joint [rad or m] that moves less has no plot."""


class JointsPanel(AbstractPanel):
    """A plot a joint, and whose law lies over the points."""

    tab, order = Tab.CALIBRATE, 30
    depends = ("comparison", "diagnosis", "overlay.law")

    def build(self, gui: viser.GuiApi) -> None:
        self._folder = gui.add_folder("Errors along each joint", visible=False)
        with self._folder:
            self._law = gui.add_dropdown(
                "Law of",
                [NO_LAW],
                visible=False,
                hint="Plot this effect's law over the errors; its joint glows on the arm. Candidates that "
                "were not added are fitted to the residuals of the geometry.",
            )
            self.sends(self._law, self._choose)
            self._html = gui.add_html("")

    def show(self, session: Session) -> None:
        rows, found, effect = session.comparison, session.diagnosis, shown_effect(session)
        self._folder.visible = rows is not None and bool(rows.stages)
        self._law.visible = found is not None
        labels = () if found is None else tuple(e.label for e in candidates(found))
        set_options(self._law, [NO_LAW, *labels], NO_LAW if effect is None else effect.label)
        if rows is not None and rows.stages:
            self._html.content = block(joint_plots(session, rows), testid="joints", style="margin:2px 0 8px")

    def _choose(self) -> SetOverlay:
        return SetOverlay(replace(self._worker.session.overlay, law=str(self._law.value)))


def joint_plots(session: Session, rows: Comparison) -> str:
    robot, effect, found = session.robot.with_effects(), shown_effect(session), session.diagnosis
    left = -1e3 * along_joints(robot, rows.q, rows.residuals)
    law = None if effect is None or found is None else law_along_joints(found, effect.label)
    top = _top(left, rows)
    cells = []
    q, at = shown_joints(robot, rows.q), None if law is None else shown_joints(robot, law[0])
    for j, unit in enumerate(shown_units(robot)):
        mine = None if law is None or at is None else (at[:, j], 1e3 * law[1][:, j])
        is_blamed = effect is not None and j in effect.joints
        cells.append(_cell(j, q[:, j], left[:, j], _inks(rows), mine, top, unit, is_blamed=is_blamed))
    lines = -(-len(cells) // COLUMNS)
    placed = "".join(
        f'<g transform="translate({CELL[0] * (j % COLUMNS):.0f} {CELL[1] * (j // COLUMNS):.0f})">{cell}</g>'
        for j, cell in enumerate(cells)
    )
    return (
        heading("Along the motion of the joint [mm], over its position")
        + f'<svg viewBox="0 0 {COLUMNS * CELL[0]:.0f} {lines * CELL[1]:.0f}" width="100%">{placed}</svg>'
        + _legend(rows, "" if effect is None or law is None else effect.label)
    )


def _top(left: Float[np.ndarray, "rows n stages"], rows: Comparison) -> float:
    """Where the plots end [mm]: nearly all of what the geometry leaves; of the nominal arm before that."""
    stage = ModelStage.GEOMETRY if ModelStage.GEOMETRY in rows.stages else rows.stages[0]
    values = np.abs(left[..., STAGES.index(stage)])
    return max(float(np.nanquantile(values, 0.98)), 1e-6) * 1.15 if np.isfinite(values).any() else 1.0


def _cell(
    j: int,
    x: np.ndarray,
    left: np.ndarray,
    inks: dict[int, str],
    law: Any,
    top: float,
    unit: str,
    *,
    is_blamed: bool,
) -> str:
    """One plot: frame, zero, dots, means and the law."""
    title = f"Joint {j + 1}" + (" ◄" if is_blamed else "")
    colour = css(BLAMED) if is_blamed else MUTED
    low, high = float(x.min()), float(x.max())
    parts = [
        label(LEFT, 12, title, size=12, fill=f"{colour};font-weight:{700 if is_blamed else 400}"),
        f'<rect x="{LEFT}" y="{TOP}" width="{PLOT[0]}" height="{PLOT[1]}" fill="none" '
        f'style="stroke:{colour if is_blamed else LINE}" stroke-width="{1.6 if is_blamed else 0.8}"/>',
    ]
    if high - low < MIN_MOVED * (1e3 if unit == " mm" else np.rad2deg(1.0)):
        return "".join([*parts, label(LEFT + 8, TOP + 0.5 * PLOT[1], "hardly moved")])
    if not np.isfinite(left).any():
        return "".join([*parts, label(LEFT + 8, TOP + 0.5 * PLOT[1], "does not move the tool")])
    px = LEFT + PLOT[0] * (x - low) / (high - low)
    some = np.unique(np.linspace(0, len(x) - 1, min(len(x), MAX_DOTS)).round().astype(int))
    for k, ink in inks.items():
        parts.append(_dots(px[some], _level(left[some, k], top), ink, 0.45))
    parts += [_means(px, left[:, k], top, ink) for k, ink in inks.items()]
    if law is not None:
        at = LEFT + PLOT[0] * (law[0] - low) / (high - low)
        parts.append(_dots(at, _level(law[1], top), css(BLAMED), 0.9, wide=2.6))
    zero = TOP + 0.5 * PLOT[1]
    parts.append(f'<path d="M{LEFT} {zero}h{PLOT[0]}" style="stroke:{MUTED}" stroke-width=".6"/>')
    for y, words in ((TOP + 8, f"+{number(top, 2)}"), (TOP + PLOT[1], f"−{number(top, 2)}")):
        parts.append(label(LEFT - 3, y, words, anchor="end"))
    for x_end, anchor, words in ((LEFT, "start", f"{low:.0f}"), (LEFT + PLOT[0], "end", f"{high:.0f}{unit}")):
        parts.append(label(x_end, TOP + PLOT[1] + 11, words.replace("-", "−"), anchor=anchor))
    return "".join(parts)


def _level(values: np.ndarray, top: float) -> np.ndarray:
    """Height on the plot; NaN beyond it."""
    inside = np.where(np.abs(values) <= top, values, np.nan)
    return TOP + 0.5 * PLOT[1] * (1.0 - inside / top)


def _dots(x: np.ndarray, y: np.ndarray, colour: str, opacity: float, *, wide: float = 2.0) -> str:
    """Many dots as one path."""
    seen = np.isfinite(y)
    if not seen.any():
        return ""
    path = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(x[seen], y[seen], strict=True))
    return (
        f'<path d="{path}" stroke="{colour}" stroke-width="{wide}" stroke-linecap="round" '
        f'stroke-opacity="{opacity}" fill="none"/>'
    )


def _means(x: np.ndarray, values: np.ndarray, top: float, colour: str) -> str:
    """A line through the means of the rows in equal parts of the joint's range."""
    line = " ".join(f"{a:.1f},{b:.1f}" for a, b in _bins(x, values, top))
    return f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="1.8"/>' if line else ""


def _bins(x: np.ndarray, values: np.ndarray, top: float) -> Iterator[tuple[float, float]]:
    part = np.minimum((BINS * (x - LEFT) / PLOT[0]).astype(int), BINS - 1)
    for k in range(BINS):
        mine = values[(part == k) & np.isfinite(values)]
        if len(mine) >= MIN_DOTS and abs(mean := float(mine.mean())) <= top:
            yield LEFT + PLOT[0] * (k + 0.5) / BINS, float(_level(np.array(mean), top))


def _inks(rows: Comparison) -> dict[int, str]:
    """Colours of the known stages, by their number."""
    colours = map(css, stage_colours(len(rows.stages)))
    return dict(zip(map(STAGES.index, rows.stages), colours, strict=True))


def _legend(rows: Comparison, law: str) -> str:
    marks = [badge(str(STAGES[k]).capitalize(), ink) for k, ink in _inks(rows).items()]
    marks += [badge(f"Law of {law}", css(BLAMED))] if law else []
    return (
        f"<div>{' &nbsp; '.join(marks)}</div>"
        f'<div style="color:{MUTED}">Dots are rows, lines their means. Points off the axes are hidden.</div>'
    )
