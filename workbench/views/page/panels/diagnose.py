"""The diagnosis: the verdict, errors before and after, the candidates, and where to measure next."""

from collections.abc import Mapping
from functools import partial

import viser

from workbench.base.wording import capital
from workbench.diagnosis.report import document
from workbench.report.blocks import Block, Sentence, Tone
from workbench.report.chart import Bar, Bars
from workbench.report.colours import UNNAMED
from workbench.report.result_display import as_html
from workbench.session.commands.diagnose import TakeNextPoses
from workbench.session.commands.sessions import SPLIT, MakeSession, splittable
from workbench.session.export import next_poses_csv
from workbench.session.page_state import Tab
from workbench.session.state import Session
from workbench.views.page.html import block, folded, heading, text
from workbench.views.page.panels.panel import AbstractPanel
from workbench.views.page.panels.result_card import weighed

TARGETS, FILE = "As targets", "Save (CSV)"
HINT = (
    "These rows get their own base and tool, so that nothing has to be measured again; Undo (Ctrl+Z) "
    "reverts this."
)
SPACED = "margin:2px 0 6px"
SUSPECTS = 4
"""Bars of a diagnosis under way."""
MAX_BUTTONS = 3
"""Events with a button; of more, those after them once these have been pressed."""


def _suspects(session: Session) -> Mapping[str, float] | None:
    """What a diagnosis under way may find, and how much speaks for each so far."""
    return None if session.page.job is None else session.page.job.suspects


class DiagnosePanel(AbstractPanel):
    """What was found, and where to measure next."""

    tab, order = Tab.CALIBRATE, 20
    depends = ("results.diagnosis", "results.accepted", "measurements.loaded", "is_idle", _suspects)

    def build(self, gui: viser.GuiApi) -> None:
        self.html(lambda s: _suspected(_suspects(s)))
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


def _suspected(found: Mapping[str, float] | None) -> str:
    """The strongest suspects."""
    ranked = sorted((found or {}).items(), key=lambda pair: -pair[1])[:SUSPECTS]
    if not ranked:
        return ""
    share = 100.0 / max(ranked[0][1], 1e-9)
    bars = [Bar(capital(name), round(share * gain), UNNAMED) for name, gain in ranked]
    return block(heading("Suspects so far, strongest 100 %") + Bars(bars, unit="%").svg(), testid="suspects")


def _event(place: int, session: Session) -> str:
    """What happened to base or tool; nothing if it was less often."""
    steps = [*splittable(session).values()][place : place + 1]
    return "".join(block(text(f"{step}."), testid=f"event-{place + 1}", style=SPACED) for step in steps)


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
    bars = document.budget_bars(found)
    head = heading(f"{capital(found.verdict_text)}{added}. {bars.title}")
    why: list[Block] = [Sentence(found.message), Sentence(weighed(found), tone=Tone.QUIET)]
    parts = document.causes, document.effects, document.alternatives, document.candidates, document.remarks
    for part in parts:
        why += part(found)
    return block(f"{head}{bars.svg()}{folded('Why?', as_html(why))}", testid="verdict")
