"""The diagnosis: the verdict, errors before and after, the candidates, and where to measure next."""

import numpy as np
import viser

from workbench.arm.joint_units import joint_words
from workbench.base.wording import capital
from workbench.diagnosis.claimed_causes import Confidence
from workbench.diagnosis.report.table import outlier_words
from workbench.diagnosis.result import Diagnosis, judged
from workbench.session.commands.diagnose import AddEffects, Diagnose, TakeNextPoses
from workbench.session.export import next_poses_csv
from workbench.session.state import Session
from workbench.views.appearance.colours import AFTER, BEFORE, OUT_OF_REACH, css
from workbench.views.page.html import GOOD, MUTED, badge, block, bullets, folded, heading, number, table, text
from workbench.views.page.panels.panel import AbstractPanel, waiting
from workbench.views.page.panels.result_card import weighed

CANDIDATES, LARGE = 6, 300.0
"""Lines of the ranking; difference of evidence that is large enough [nat]."""
READY = "Ready. Press Diagnose to find what geometry can't explain."
MORE = " (with 'Surprise me' and more poses there is an effect to find)"
WORSE = {
    Confidence.CERTAIN: "certainly less",
    Confidence.PROBABLE: "probably less",
    Confidence.OPEN: "as likely",
}
"""Of a candidate beside the best one, by the odds of the best against it."""
WIDTH, BAR = 340, 18
PLOT = 70
MOST_ROWS = 300
"""Rows in the residual plot at most; of more, evenly chosen ones."""


class DiagnosePanel(AbstractPanel):
    """Search, add, measure on."""

    depends = ("diagnosis", "accepted", "loaded", "is_idle")

    def build(self, gui: viser.GuiApi) -> None:
        self._start = self.button(
            Diagnose.title,
            Diagnose,
            viser.Icon.STETHOSCOPE,
            "Fit the geometry, then find the physical effect that explains the remaining error. Needs at "
            "least 20 rows.",
            main=True,
        )
        self._verdict = gui.add_html("")
        self._add = self.button(
            AddEffects.title,
            AddEffects,
            viser.Icon.PLUS,
            "Identify these effects together with the geometry; Identify, Compare and the saved robot "
            "then include them.",
            main=True,
            visible=False,
        )
        self._details = gui.add_html("")
        self._next = self.button(
            TakeNextPoses.title,
            TakeNextPoses,
            viser.Icon.TARGET,
            "Add to the plate the poses where a measurement would be most informative about these effects.",
            visible=False,
        )
        self._save = self.download(
            "Save the suggested poses (CSV)",
            next_poses_csv,
            "Download their joint positions, with what each pose would determine.",
            visible=False,
        )

    def show(self, session: Session) -> None:
        found = session.diagnosis
        self._start.disabled = session.loaded is None or session.job is not None
        self._add.visible = found is not None and bool(found.effects) and not session.accepted
        self._next.visible = self._save.visible = found is not None and len(found.measure_next) > 0
        self._verdict.content = (
            waiting(session, "verdict", READY, more=MORE) if found is None else _verdict(found, session)
        )
        self._details.content = "" if found is None else _details(found)


def _verdict(found: Diagnosis, session: Session) -> str:
    mark = badge(capital(found.verdict_words), GOOD if found.is_good else css(OUT_OF_REACH))
    added = f'<div style="color:{GOOD}">Now part of the model.</div>' if session.accepted else ""
    return block(f"{mark}<div>{text(found.message)}</div>{added}{_bars(found)}", testid="verdict")


def _bars(found: Diagnosis) -> str:
    """Mean position error on held-out rows, without the nominal arm, which would dwarf the rest."""
    before, after = judged(found.before).position_mm.mean, judged(found.after).position_mm.mean
    rows = [("geometry", before, css(BEFORE)), ("with effects", after, css(AFTER))]
    if np.isnan([before, after]).any():
        return ""
    longest = max(before, after, 1e-12)
    parts = []
    for i, (words, value, colour) in enumerate(rows):
        y, length = i * (BAR + 6), 0.55 * WIDTH * value / longest
        parts.append(
            f'<text x="0" y="{y + 13}" style="fill:{MUTED}" font-size="12">{words}</text>'
            f'<rect x="84" y="{y}" width="{length:.1f}" height="{BAR}" rx="2" fill="{colour}"/>'
            f'<text x="{90 + length:.1f}" y="{y + 13}" style="fill:currentColor" font-size="12">'
            f"{number(value)} mm</text>"
        )
    kind = "held-out" if found.before.held_out else "fitted"
    why = weighed(found)
    head = heading(f"Mean error on {kind} rows, before and after")
    return (
        head + f'<svg viewBox="0 0 {WIDTH} {2 * (BAR + 6)}" width="100%" data-testid="before-after">'
        f"{''.join(parts)}</svg>" + f'<div style="color:{MUTED};margin:4px 0 8px">{text(why)}</div>'
    )


def _details(found: Diagnosis) -> str:
    return block(
        _causes(found)
        + heading("Remaining error, row by row [mm]")
        + _residuals(found)
        + _next(found)
        + folded("Effects of the model, one by one", bullets(_effects(found)))
        + folded("Candidates, each added to the geometry alone", _ranking(found))
        + folded("Notes", _notes(found)),
        testid="diagnosis",
        style="margin-bottom:10px",
    )


def _next(found: Diagnosis) -> str:
    """Poses to measure next, with what each would determine once those above it are measured."""
    if not found.worth_measuring:
        return ""
    lines = [
        f"<li>{text(capital(reason.sentence))}"
        f'<div style="color:{MUTED}">{joint_words(found.calibrated, q)}</div></li>'
        for q, reason in zip(found.measure_next, found.next_reasons, strict=True)
    ]
    items = f'<ol data-testid="next-poses" style="margin:0;padding-left:20px">{"".join(lines)}</ol>'
    return heading("Measure next") + items


def _causes(found: Diagnosis) -> str:
    lines = [
        f"{text(cause.sentence)} <span style='color:{MUTED}'>({cause.confidence}"
        + (f"; {number(cause.contribution_mm)} mm" if np.isfinite(cause.contribution_mm) else "")
        + ")</span>"
        for cause in found.causes
    ]
    if found.residual_map is not None:
        lines.append(f"<span style='color:{MUTED}'>{text(found.residual_map.sentence)}</span>")
    return heading("Causes") + bullets(lines) if lines else ""


def _effects(found: Diagnosis) -> list[str]:
    """The contribution of each effect, and alternatives that fit nearly as well."""
    lines = []
    for accepted in found.effects:
        others = ", ".join(r.effect.label for r in accepted.alternatives[:2])
        more = f'<div style="color:{MUTED}">Nearly as good: {text(others)}</div>' if others else ""
        fall = f"{number(accepted.before_mm)} → {number(accepted.after_mm)} mm"
        lines.append(f"{text(accepted.effect.label)} <span style='color:{MUTED}'>({fall})</span>{more}")
    return lines


def _residuals(found: Diagnosis) -> str:
    """Position errors of the fitted rows: geometry alone, and with the effects."""
    before, after = (1e3 * rows[0].position for rows in (found.before_rows, found.after_rows))
    if not np.isfinite(before).any():
        return ""
    top = float(np.nanmax(before, initial=1e-9))
    parts = []
    for values, colour in ((before, css(BEFORE)), (after, css(AFTER))):
        shown = np.flatnonzero(np.isfinite(values))[:: max(1, -(-len(values) // MOST_ROWS))]
        for k in shown:
            x, y = WIDTH * (k + 0.5) / len(values), PLOT - (PLOT - 4) * min(values[k] / top, 1.0)
            title = f"<title>{values[k]:.3g} mm</title>"
            parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2" fill="{colour}">{title}</circle>')
    axis = f'<line x1="0" x2="{WIDTH}" y1="{PLOT}" y2="{PLOT}" style="stroke:{MUTED}" stroke-width=".5"/>'
    limit = f'<text x="2" y="10" font-size="10" style="fill:{MUTED}">{top:.2g}</text>'
    return f'<svg viewBox="0 0 {WIDTH} {PLOT + 2}" width="100%">{axis}{limit}{"".join(parts)}</svg>'


def _ranking(found: Diagnosis) -> str:
    """The first candidates: whether they are as likely as the best one, and the error with each."""
    shown = found.ranking[:CANDIDATES]
    tried = any(ranked.held_out_mm is not None for ranked in shown)
    rows = []
    for ranked in shown:
        worse = float(np.exp(min(shown[0].gain - ranked.gain, LARGE)))
        likely = "the best" if ranked is shown[0] else WORSE[Confidence.of(worse)]
        left = "–" if ranked.held_out_mm is None else number(ranked.held_out_mm)
        rows.append((text(ranked.effect.label), likely, *((left,) if tried else ())))
    columns = ("", "how likely", *(("error with it [mm]",) if tried else ()))
    return table(columns, rows, testid="ranking") if rows else ""


def _notes(found: Diagnosis) -> str:
    words = list(found.notes)
    if len(found.outliers):
        words.insert(0, f"outliers: {outlier_words(found)}")
    return bullets(map(text, words), style=f"margin:0;color:{MUTED}")
