"""Residuals along each joint's motion, plotted over its position, with the law of an effect."""

from typing import Any

import numpy as np
import viser

from workbench.arm.joint_units import joint_titles, shown_joints, shown_units
from workbench.report.chart import Chart, Marks
from workbench.session.comparison import STAGES, Comparison, ModelStage
from workbench.session.joint_errors import NO_LAW, along_joints, law_along_joints, shown_effect
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.appearance.colours import BLAMED, STAGE_COLOURS, css
from workbench.views.page.html import MUTED, badge, block, heading, text
from workbench.views.page.panels.panel import AbstractPanel

HEIGHT = 64.0
"""Of a plot."""
MAX_DOTS, BINS, MIN_ROWS = 200, 9, 4
"""Rows drawn, bins of the mean, and rows that a bin has at least."""
MIN_MOVED = float(np.deg2rad(2.0))
"""A joint [rad or m] that moves less has no plot."""


class JointsPanel(AbstractPanel):
    """A plot a joint, and whose law lies over the points."""

    tab, order = Tab.CALIBRATE, 30
    depends = ("results.comparison", "results.diagnosis", "choices.overlay.law")

    def build(self, gui: viser.GuiApi) -> None:
        with self.folder("Errors along each joint", is_open=False, visible=_has_errors):
            law = self.dropdown(
                "Law of",
                _laws,
                "Plot the law of an effect that was found over the errors; its joint glows on the arm.",
                lambda s: NO_LAW if (effect := shown_effect(s)) is None else effect.label,
                visible=lambda s: s.results.diagnosis is not None and s.results.diagnosis.effects,
            )
            self.html(_plots)
        self.form(lambda law: self.overlaid(law=law), law)


def _has_errors(session: Session) -> bool:
    rows = session.results.comparison
    return rows is not None and bool(rows.stages)


def _laws(session: Session) -> list[str]:
    found = session.results.diagnosis
    return [NO_LAW, *(a.effect.label for a in (() if found is None else found.effects))]


def _plots(session: Session) -> str:
    rows = session.results.comparison
    if rows is None or not _has_errors(session):
        return ""
    return block(joint_plots(session, rows), testid="joints", style="margin:2px 0 8px")


def joint_plots(session: Session, rows: Comparison) -> str:
    """All plots and their legend."""
    effect, found, fit = shown_effect(session), session.results.diagnosis, session.results.identification
    robot = (session.robot if fit is None else fit.aligned).with_effects()  # with the tool that was measured
    left = -1e3 * along_joints(robot, rows.q, rows.residuals)
    law = None if effect is None or found is None else law_along_joints(found, effect.label)
    # the plots end where nearly all of what the geometry leaves does; what the nominal arm does before that
    stage = ModelStage.GEOMETRY if ModelStage.GEOMETRY in rows.stages else rows.stages[0]
    size = np.abs(left[..., STAGES.index(stage)])
    top = max(float(np.nanquantile(size, 0.98)), 1e-6) * 1.15 if np.isfinite(size).any() else 1.0
    inks = _inks(rows)
    q, at = shown_joints(robot, rows.q), None if law is None else shown_joints(robot, law[0])
    parts, titles = [], joint_titles(session.robot)
    for j, unit in enumerate(shown_units(robot)):
        mine = None if law is None or at is None else (at[:, j], 1e3 * law[1][:, j])
        is_blamed = effect is not None and j in effect.joints
        name = text(titles[j])
        name = f'<b style="color:{css(BLAMED)}">{name} ◄</b>' if is_blamed else name
        parts.append(f"<div>{name}: {_plot(q[:, j], left[:, j], inks, mine, top, unit)}</div>")
    return "".join(
        (
            heading("Along the motion of the joint [mm], over its position"),
            *parts,
            _legend(rows, "" if effect is None or law is None else effect.plain),
        )
    )


def _plot(x: np.ndarray, left: np.ndarray, inks: dict[int, str], law: Any, top: float, unit: str) -> str:
    """Dots, means and the law, over the joint's position."""
    if np.ptp(x) < MIN_MOVED * (1e3 if unit == " mm" else np.rad2deg(1.0)):
        return "hardly moved"
    if not np.isfinite(left).any():
        return "does not move the tool"
    some = np.unique(np.linspace(0, len(x) - 1, min(len(x), MAX_DOTS)).round().astype(int))
    ends = np.array([x.min(), x.max()])
    marks = [Marks(ends, np.zeros(2), MUTED, is_line=True)]
    marks += [Marks(x[some], _inside(left[some, k], top), f"{ink}73", radius=1.3) for k, ink in inks.items()]
    marks += [Marks(*_means(x, left[:, k]), ink, is_line=True) for k, ink in inks.items()]
    if law is not None:
        marks.append(Marks(law[0], _inside(law[1], top), css(BLAMED), radius=1.6))
    low, high = (f"{end:.0f}{unit}".replace("-", "−") for end in ends)
    return Chart(marks, HEIGHT, (low, high)).svg()


def _inside(values: np.ndarray, top: float) -> np.ndarray:
    """NaN beyond the plot."""
    return np.where(np.abs(values) <= top, values, np.nan)


def _means(x: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means of the rows in equal parts of the joint's range."""
    edges = np.linspace(x.min(), x.max(), BINS + 1)
    part = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    mine = [values[(part == k) & np.isfinite(values)] for k in range(BINS)]
    means = np.array([m.mean() if len(m) >= MIN_ROWS else np.nan for m in mine])
    return 0.5 * (edges[1:] + edges[:-1]), means


def _inks(rows: Comparison) -> dict[int, str]:
    """Colours of the known stages, by their number."""
    return {STAGES.index(stage): css(STAGE_COLOURS[stage]) for stage in rows.stages}


def _legend(rows: Comparison, law: str) -> str:
    marks = [badge(str(STAGES[k]).capitalize(), ink) for k, ink in _inks(rows).items()]
    marks += [badge(f"Law of {law}", css(BLAMED))] if law else []
    return (
        f"<div>{' &nbsp; '.join(marks)}</div>"
        f'<div style="color:{MUTED}">Dots are rows, lines their means. Points off the axes are hidden.</div>'
    )
