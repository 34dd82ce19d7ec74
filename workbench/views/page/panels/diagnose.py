"""The diagnosis: the verdict, errors before and after, the candidates, and where to measure next."""

from collections.abc import Mapping
from dataclasses import replace

import viser

from workbench.base.wording import capital
from workbench.diagnosis.report import document
from workbench.report.blocks import Block, Sentence, Tone
from workbench.report.chart import Bar, Bars
from workbench.report.colours import UNNAMED
from workbench.report.result_display import as_html
from workbench.session.export import next_poses_csv
from workbench.session.next_step import POSES, next_step
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import block, folded, heading
from workbench.views.page.panels.panel import AFTERWARDS, AbstractPanel
from workbench.views.page.panels.result_card import weighed

SUSPECTS = 4
"""Bars of a diagnosis under way."""


def _suspects(session: Session) -> Mapping[str, float] | None:
    """What a diagnosis under way may find next, and how much speaks for each."""
    return None if session.page.job is None else session.page.job.suspects


class DiagnosePanel(AbstractPanel):
    """What was found, and where to measure next."""

    tab, order, pause = Tab.CALIBRATE, 20, AFTERWARDS
    depends = ("results.diagnosis", "results.accepted", "measurements", "is_idle", next_step, _suspects)

    def build(self, gui: viser.GuiApi) -> None:
        self.html(_suspected)
        self.html(_verdict)
        self.html(_details)
        self.download(
            "Next poses (CSV)",
            next_poses_csv,
            "Joint positions of the most informative poses to measure next.",
            visible=_has_own_poses,
        )


def _has_own_poses(session: Session) -> bool:
    """Whether there are poses to measure next that the strip doesn't offer."""
    found, step = session.results.diagnosis, next_step(session)
    return found is not None and len(found.measure_next) > 0 and POSES not in (step.next, step.other)


def _suspected(session: Session) -> str:
    """The strongest suspects."""
    named, found = session.measurements.named, _suspects(session) or {}
    ranked = sorted(found.items(), key=lambda pair: -pair[1])[:SUSPECTS]
    if not ranked:
        return ""
    share = 100.0 / max(ranked[0][1], 1e-9)
    bars = [Bar(capital(named(name)), round(share * gain), UNNAMED) for name, gain in ranked]
    return block(
        heading("Suspects for what is left now, strongest 100 %") + Bars(bars, unit="%").svg(),
        testid="suspects",
    )


def _details(session: Session) -> str:
    found = session.results.diagnosis
    if found is None or not found.worth_measuring:
        return ""
    listed = folded("Where to measure next", as_html(document.next_poses(found)))
    return block(listed, testid="diagnosis")


def _verdict(session: Session) -> str:
    """In two words, the size of each cause, and why; the strip has the sentence, and its colour."""
    if (found := session.results.diagnosis) is None:
        return ""
    added = "; now part of the model" if session.results.accepted else ""
    bars, named = document.budget_bars(found), session.measurements.named
    bars = replace(bars, rows=[replace(bar, name=named(bar.name)) for bar in bars.rows])
    head = heading(f"{capital(found.verdict_text)}{added}" + (bars.title and f". {bars.title}"))
    other = [Sentence(weighed(session, found), tone=Tone.QUIET)] if found.effects else []  # else it is shown
    why: list[Block] = [Sentence(found.message), *other]
    why += (b for part in (document.causes, document.effects, document.remarks) for b in part(found))
    read = () if session.measurements.loaded is None else session.measurements.loaded.notes  # said there
    why = [b for b in why if not (isinstance(b, Sentence) and b.text in read)]
    why = [replace(b, text=named(b.text)) if isinstance(b, Sentence) else b for b in why]
    return block(f"{head}{bars.svg()}{folded('Why?', as_html(why))}", testid="verdict")
