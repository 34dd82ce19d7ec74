"""Window over the scene: colour scale and stage of the measured points, and the selected row."""

from dataclasses import replace
from functools import partial

import numpy as np
import viser

from workbench.arm.joint_units import joint_words
from workbench.arm.robot import Robot
from workbench.session.commands.compare import SetOverlay
from workbench.session.comparison import STAGES, Comparison, Overlay, Stage
from workbench.session.state import Focus, Session
from workbench.views.appearance.colours import (
    ARROW_AFTER,
    ARROW_BEFORE,
    LEFT_OUT,
    SET_APART,
    ErrorScale,
    css,
    gradient,
)
from workbench.views.drawables.measured import error_scale
from workbench.views.page.html import MUTED, badge, block, number, text
from workbench.views.page.panels.panel import AbstractPanel
from workbench.views.page.style import MORE

WIDTH, MARGIN = 340, 15
NAMES = {Stage.NOMINAL: "Nominal", Stage.GEOMETRY: "Geometry", Stage.CAUSES: "Causes"}


class ResidualsPanel(AbstractPanel):
    """A separate window in the lower left corner, shown once errors are known."""

    depends = ("comparison", "overlay", "focus", "row", "left_out")

    def build(self, gui: viser.GuiApi) -> None:
        self._window = gui.add_panel(visible=False)
        with self._window.add_tab("Residuals"):
            self._stages = gui.add_button_group(
                "Errors of",
                list(NAMES.values()),
                hint="Colour the measured points by the errors of the nominal arm, of its calibrated "
                "geometry, or of the geometry with the causes found.",
            )
            self._html = gui.add_html("")
        self._window.float(x=MARGIN, y=-MARGIN, width=WIDTH)
        self.sends_one_of(
            self._stages, {name: partial(self._colour_by, stage) for stage, name in NAMES.items()}
        )

    def _colour_by(self, stage: Stage) -> SetOverlay:
        return SetOverlay(replace(self._worker.session.overlay, stage=stage))

    def show(self, session: Session) -> None:
        rows, overlay = session.comparison, session.overlay
        is_shown = rows is not None and rows.stages and overlay.points and session.focus is not Focus.TRACK
        self._window.visible = bool(is_shown)
        if rows is None or not is_shown:
            return
        self._stages.options = tuple(NAMES[stage] for stage in rows.stages)
        self._html.content = block(
            stage_means(rows, overlay.stage)
            + colour_bar(error_scale(rows))
            + marks(rows, is_left_out=bool(session.left_out))
            + (arrow_factors(rows, overlay) if session.focus in (Focus.ROW, Focus.JOG) else "")
            + (row_errors(rows, session.row, session.robot) if session.focus is Focus.ROW else ""),
            testid="residuals",
            style="margin:2px 0 6px",
        )


def stage_means(rows: Comparison, wanted: Stage) -> str:
    """Mean error at every known stage, the shown one large; of held-out rows where there are any."""
    shown, judged = rows.nearest_stage(wanted), rows.held_out
    seen = np.isfinite(rows.stage_errors[:, STAGES.index(rows.stages[0])])
    kind = "held-out " if (judged & seen).any() else ""
    use = seen & judged if kind else seen
    parts = []
    for stage in rows.stages:
        mean = f"{number(1e3 * float(np.nanmean(rows.stage_errors[use, STAGES.index(stage)])))}"
        style = "font-size:19px;font-weight:650" if stage is shown else f"color:{MUTED}"
        parts.append(f'<span title="{text(stage)}" style="{style}">{mean}</span>')
    arrow = f' <span style="color:{MUTED}">→</span> '
    return (
        f"<div>{arrow.join(parts)} mm</div>"
        f'<div style="color:{MUTED}">Mean of {int(use.sum())} {kind}poses; colours: {text(shown)}</div>'
    )


def colour_bar(scale: ErrorScale) -> str:
    """The scale with its ticks in mm."""
    ticks, last = [], len(scale.ticks) - 1
    for i, tick in enumerate(scale.ticks):
        at = 100.0 * float(scale.shares(np.array(tick)))
        words = ("≤ " if i == 0 else "≥ " if i == last else "") + number(1e3 * tick, 1)
        side = f"left:{at:.1f}%;transform:translateX(-{at:.0f}%)"
        ticks.append(f'<span style="position:absolute;{side}">{words}{" mm" if i == last else ""}</span>')
    return (
        f'<div style="height:10px;border-radius:3px;margin-top:5px;background:{gradient()}"></div>'
        '<div data-testid="colour-bar" style="position:relative;height:19px;white-space:nowrap">'
        f"{''.join(ticks)}</div>"
    )


def marks(rows: Comparison, *, is_left_out: bool) -> str:
    """What round and square points are, and that they answer to a click."""
    kinds = "● fitted ■ held out" if rows.held_out.any() else "● fitted"
    grey = f' <span style="color:{css(LEFT_OUT)}">●</span> excluded' if is_left_out else ""
    if len(rows.set_apart):
        grey += f' <span style="color:{css(SET_APART)}">●</span> {len(rows.set_apart)} that no arm explains'
    return f'<div {MORE} style="color:{MUTED}">{kinds}{grey} · click one for its numbers</div>'


def arrow_factors(rows: Comparison, overlay: Overlay) -> str:
    """How many times longer than the errors the arrows are."""
    if not overlay.arrows or rows.calibrated is None:
        return ""
    return (
        f'<div data-testid="factors" {MORE}>{badge("Nominal", css(ARROW_BEFORE))} × '
        f"{overlay.exaggeration:g} &nbsp; "
        f"{badge('Calibrated', css(ARROW_AFTER))} × {overlay.exaggeration_after:g}</div>"
    )


def row_errors(rows: Comparison, row: int, robot: Robot) -> str:
    """Errors and joint positions of a row."""
    kind = "held out" if rows.held_out[row] else "fitted"
    known = [
        f"{number(1e3 * float(rows.stage_errors[row, STAGES.index(stage)]))} mm {text(stage)}"
        for stage in rows.stages
        if np.isfinite(rows.stage_errors[row, STAGES.index(stage)])
    ]
    errors = ", ".join(known) or "no position was measured"
    return (
        '<div data-testid="row-errors" style="margin-top:4px">'
        f"<b>Data row {int(rows.number[row])}</b> ({kind}): {errors}"
        f'<div {MORE} style="color:{MUTED}">Joints {joint_words(robot, rows.q[row])}</div></div>'
    )
