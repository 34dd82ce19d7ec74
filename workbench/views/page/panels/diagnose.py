"""The diagnosis: the verdict, errors before and after, the candidates, and where to measure next."""

from collections.abc import Iterator
from functools import partial

import numpy as np
import viser

from workbench.arm.joint_units import joint_text
from workbench.base.wording import capital
from workbench.diagnosis.claims.cause import Cause
from workbench.diagnosis.confidence import Confidence
from workbench.diagnosis.report.budget import budget_bars
from workbench.diagnosis.report.table import EXPLAINS, nearly_as_good, outlier_text
from workbench.diagnosis.result import Diagnosis
from workbench.session.commands.diagnose import TakeNextPoses
from workbench.session.commands.sessions import SPLIT, MakeSession, splittable
from workbench.session.export import next_poses_csv
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import MUTED, block, bullets, folded, heading, number, table, text
from workbench.views.page.panels.panel import AbstractPanel
from workbench.views.page.panels.result_card import weighed

TARGETS, FILE = "As targets", "Save (CSV)"
CANDIDATES, LARGE = 6, 300.0
"""Lines of the ranking; difference of evidence that is large enough [nat]."""
HINT = (
    "These rows get their own base and tool, so that nothing has to be measured again; Undo (Ctrl+Z) "
    "reverts this."
)
SPACED = "margin:2px 0 6px"
MAX_BUTTONS = 3
"""Events with a button; of more, those after them once these have been pressed."""
WORSE = {
    Confidence.CERTAIN: "certainly less",
    Confidence.PROBABLE: "probably less",
    Confidence.OPEN: "as likely",
}
"""Of a candidate beside the best one, by the odds of the best against it."""


class DiagnosePanel(AbstractPanel):
    """What was found, and where to measure next."""

    tab, order = Tab.CALIBRATE, 20
    depends = ("results.diagnosis", "results.accepted", "measurements.loaded", "is_idle")

    def build(self, gui: viser.GuiApi) -> None:
        self.html(_verdict)
        for place in range(MAX_BUTTONS):
            self.html(partial(_event, place))
            self.button(
                SPLIT,
                partial(self._split, place),
                viser.Icon.ARROWS_SPLIT_2,
                HINT,
                visible=partial(_event, place),
            )
        self.html(_details)
        self.press_one(
            "Next poses",
            (TARGETS, FILE),
            self._take_or_save,
            "The most informative poses to measure next: as targets of the plate, or their joint "
            "positions as a CSV file.",
            visible=lambda s: s.results.diagnosis is not None and len(s.results.diagnosis.measure_next),
        )

    def _split(self, place: int) -> MakeSession | None:
        steps = list(splittable(self._worker.session))
        return MakeSession(steps[place]) if place < len(steps) else None

    def _take_or_save(self, event: viser.GuiEvent) -> None:
        if event.target.value == FILE:
            self.save(event, next_poses_csv)
        else:
            self.send(TakeNextPoses)


def _event(place: int, session: Session) -> str:
    """What happened to base or tool; nothing if it was less often."""
    steps = [*splittable(session).values()][place : place + 1]
    return "".join(block(text(f"{step}."), testid=f"event-{place + 1}", style=SPACED) for step in steps)


def _details(session: Session) -> str:
    found = session.results.diagnosis
    if found is None:
        return ""
    return block(folded("Where to measure next", _next(found)), testid="diagnosis")


def _verdict(session: Session) -> str:
    """In two words, the size of each cause, and why; the strip has the sentence, and its colour."""
    if (found := session.results.diagnosis) is None:
        return ""
    added = "; now part of the model" if session.results.accepted else ""
    head = heading(f"{capital(found.verdict_text)}{added}. Sizes at the tool [mm], which add in squares")
    return block(f"{head}{budget_bars(found)}{_why(found)}", testid="verdict")


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
        f'<div style="color:{MUTED}">{joint_text(found.calibrated, q)}</div></li>'
        for q, reason in zip(found.measure_next, found.next_reasons, strict=True)
    ]
    return f'<ol data-testid="next-poses" style="margin:0;padding-left:20px">{"".join(lines)}</ol>'


def _causes(found: Diagnosis) -> str:
    lines = [
        f"{text(cause.sentence)} <span style='color:{MUTED}'>({'; '.join(_weight(cause))})</span>"
        for cause in found.causes
    ]
    if found.residual_map is not None:
        lines.append(f"<span style='color:{MUTED}'>{text(found.residual_map.sentence)}</span>")
    defined = f'<div style="color:{MUTED}">{text(EXPLAINS)}</div>' if found.causes else ""
    return heading("Causes, and what each explains") + bullets(lines) + defined if lines else ""


def _weight(cause: Cause) -> Iterator[str]:
    """How sure a cause is, and what it explains."""
    yield str(cause.confidence)
    parts = ((cause.contribution_mm, " mm"), (cause.contribution_deg, "°"))
    if sizes := [f"{number(value)}{unit}" for value, unit in parts if np.isfinite(value)]:
        yield ", ".join(sizes)


def _effects(found: Diagnosis) -> list[str]:
    """The contribution of each effect, and alternatives that fit nearly as well."""
    lines = []
    for accepted in found.effects:
        others = ", ".join(r.effect.label for r in nearly_as_good(accepted)[:2])
        more = f'<div style="color:{MUTED}">Nearly as good: {text(others)}</div>' if others else ""
        fall = f"{accepted.before.text('mean')} → {accepted.after.text('mean')}"
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
    notes = list(found.notes)
    if len(found.outliers):
        notes.insert(0, f"outliers: {outlier_text(found)}")
    return bullets(map(text, notes), style=f"margin:0;color:{MUTED}")
