"""The diagnosis: the verdict, errors before and after, the candidates, and where to measure next."""

import numpy as np
import viser

from workbench.arm.joint_units import joint_words
from workbench.base.wording import capital
from workbench.diagnosis.claimed_causes import Confidence
from workbench.diagnosis.report.budget import budget_bars
from workbench.diagnosis.report.table import outlier_words
from workbench.diagnosis.result import Diagnosis
from workbench.session.commands.diagnose import AddEffects, Diagnose, TakeNextPoses
from workbench.session.commands.identify import SetLevelled
from workbench.session.export import next_poses_csv
from workbench.session.state import Session, Tab
from workbench.views.page.html import (
    BAD,
    GOOD,
    MUTED,
    badge,
    block,
    bullets,
    folded,
    heading,
    number,
    table,
    text,
)
from workbench.views.page.panels.events import EventButtons
from workbench.views.page.panels.panel import AbstractPanel, set_value, waiting
from workbench.views.page.panels.result_card import weighed

CANDIDATES, LARGE = 6, 300.0
"""Lines of the ranking; difference of evidence that is large enough [nat]."""
LEVELLED = (
    "The z axis of the measuring frame is vertical, so that the base's orientation in it tells how the arm "
    "stands to gravity."
)
READY = "Ready. Press Diagnose to find what geometry can't explain."
WORSE = {
    Confidence.CERTAIN: "certainly less",
    Confidence.PROBABLE: "probably less",
    Confidence.OPEN: "as likely",
}
"""Of a candidate beside the best one, by the odds of the best against it."""


class DiagnosePanel(AbstractPanel):
    """Search, add, measure on."""

    tab, order = Tab.CALIBRATE, 20
    depends = ("diagnosis", "accepted", "loaded", "levelled", "is_idle")

    def build(self, gui: viser.GuiApi) -> None:
        self._start = self.button(
            Diagnose.title,
            lambda: Diagnose(levelled=self._worker.session.levelled),
            viser.Icon.STETHOSCOPE,
            "Fit the geometry, then find the physical effect that explains the remaining error. Needs at "
            "least 20 rows.",
            main=True,
        )
        self._levelled = gui.add_checkbox("Instrument is levelled", False, hint=LEVELLED)
        self.sends(self._levelled, lambda: SetLevelled(bool(self._levelled.value)))
        self._verdict = gui.add_html("")
        self._events = EventButtons(self, gui, lambda: self._worker.session)
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
        set_value(self._levelled, session.levelled)
        self._start.disabled = session.loaded is None or session.job is not None
        self._add.visible = found is not None and bool(found.effects) and not session.accepted
        self._next.visible = self._save.visible = found is not None and len(found.measure_next) > 0
        self._verdict.content = (
            waiting(session, "verdict", READY) if found is None else _verdict(found, session)
        )
        self._events.show(session)
        self._details.content = "" if found is None else block(_next(found), testid="diagnosis")


def _verdict(found: Diagnosis, session: Session) -> str:
    """One line, the size of each cause, and why; the strip has the sentence."""
    mark = badge(capital(found.verdict_words), GOOD if found.is_good else BAD)
    added = f'<span style="color:{GOOD}"> · now part of the model</span>' if session.accepted else ""
    head = heading("Size of each cause at the tool [mm], and what is left")
    return block(f"{mark}{added}{head}{budget_bars(found)}{_why(found)}", testid="verdict")


def _why(found: Diagnosis) -> str:
    """How the verdict came about; folded."""
    weighing = f'<div style="color:{MUTED}">{text(weighed(found))}</div>'
    return folded(
        "Why?",
        f'<div data-testid="why">{text(found.message)}</div>'
        + weighing
        + _causes(found)
        + folded("Effects of the model, one by one", bullets(_effects(found)))
        + folded("Candidates, each added to the geometry alone", _ranking(found))
        + folded("Notes", _notes(found)),
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
