"""Calibration: identify, diagnose, add what was found; the result, and what stands behind it."""

from collections.abc import Callable

import viser

from workbench.base.wording import first_of, plural
from workbench.identification.algorithms import ALGORITHMS, DEFAULT_ALGORITHMS
from workbench.identification.report.document import parameter_blocks
from workbench.identification.result import Identification
from workbench.report.blocks import Sentence, Tone, lines
from workbench.report.result_display import as_html
from workbench.session.commands.compare import ShowFit
from workbench.session.commands.diagnose import AddEffects, Diagnose
from workbench.session.commands.identify import Identify, SetLevelled
from workbench.session.next_step import BEYOND_NOISE
from workbench.session.page_state import Tab
from workbench.session.stages import arm_judgement, share_of_noise
from workbench.session.state import Session
from workbench.views.page.html import CAREFUL, INKS, block, bullets, folded, text
from workbench.views.page.panels.form import Control, Make, Shown
from workbench.views.page.panels.panel import AbstractPanel
from workbench.views.page.panels.plate import build_wanted
from workbench.views.page.panels.result_card import result_card

HOW_TO_FIT = (
    "Identify: the arm's geometry from the rows. Diagnose: what that can't explain. Add effects: both."
)
FRAMES = {
    "Decide from the data": "auto",
    "Shared by all sessions": "shared",
    "Separate for each session": "per-session",
}
LEVELLED = (
    "The z axis of the measuring frame is vertical, so that the base's orientation in it determines the "
    "direction of gravity."
)
IF_NOISE = "± of the constants hold if the error that is left is noise; find its cause first."
SEEN, MAX_OUT = 2, 8
"""Warnings that are not folded, and rows that are named in one."""


class FitPanel(AbstractPanel):
    """The steps of a calibration, their options, and the result."""

    tab, order = Tab.CALIBRATE, 10
    depends = (
        "results.identification",
        "results.fit",
        "measurements.loaded",
        "choices.wanted",
        "measurements.levelled",
        "measurements.left_out",
        "is_idle",
    )

    def build(self, gui: viser.GuiApi) -> None:
        steps: dict[str, Make] = {"Identify": self._identify, "Diagnose": Diagnose, "Add effects": AddEffects}
        self.buttons("Calculate", steps, HOW_TO_FIT, visible=lambda s: s.measurements.loaded)
        with gui.add_folder("Options", expand_by_default=False):
            build_wanted(self)
            self.form(SetLevelled, self.checkbox("Levelled", LEVELLED, lambda s: s.measurements.levelled))
            hint = "Share of the rows held out for checking."
            self._held_out = self.slider("Held out [%]", (5, 50, 5), hint, unit=0.01, value=20)
            self._frames = self.dropdown("Base and tool", FRAMES, "Whether sessions share base and tool.")
            self._algorithms = gui.add_folder("Algorithms", expand_by_default=False)
            self._chosen = dict[str, Control]()
        self.html(result_card)
        self.html(_requirement)
        self.html(_of_fit(_warnings))

    def show(self, session: Session) -> None:
        with self._algorithms:  # one may have been registered since
            for name in filter(lambda name: name not in self._chosen, ALGORITHMS):
                title, hint = ALGORITHMS[name].title, ALGORITHMS[name].summary
                self._chosen[name] = self.checkbox(title, hint, value=name in DEFAULT_ALGORITHMS)

    def _identify(self) -> Identify:
        algorithms = tuple(name for name in ALGORITHMS if name in self._chosen and self._chosen[name].typed)
        return Identify(algorithms, self._held_out.typed, self._frames.typed)


class FitDetailsPanel(AbstractPanel):
    """Every parameter of a fit; folded."""

    tab, order = Tab.CALIBRATE, 40
    depends = ("results.identification", "results.fit", "results.diagnosis")

    def build(self, gui: viser.GuiApi) -> None:
        with self.folder("Details", is_open=False, visible=lambda s: s.results.identification is not None):
            fits = self.dropdown(
                "Shown fit", _fits, "The fit that is shown and saved.", lambda s: s.results.fit
            )
            self.html(_of_fit(_details))
        self.form(ShowFit, fits)


def _of_fit(make: Callable[[Identification, Session], str]) -> Shown:
    """What is said of an identification; nothing without one."""

    def shown(session: Session) -> str:
        found = session.results.identification
        return "" if found is None else make(found, session)

    return shown


def _fits(session: Session) -> dict[str, str]:
    """Those that there are, by title; all algorithms before there are any."""
    found = session.results.identification
    names = ALGORITHMS if found is None else found.runs
    return {ALGORITHMS[name].title: name for name in names}


def _requirement(session: Session) -> str:
    """Pass or fail of the shown fit against the required error."""
    if (judged := arm_judgement(session)) is None:
        return ""
    style = f"margin:4px 0;color:{INKS[judged.tone]};font-weight:600"
    return block(text(judged.text), testid="requirement", style=style)


def _warnings(found: Identification, session: Session) -> str:
    """Rows that are not fitted, and the first warnings, which name wrong ones; folded, what more there is."""
    said = {outlier.row for outlier in found.outliers}
    out = [f"{row} ({why})" for row, why in found.excluded if row not in said]
    first = [f"not fitted: data row{'s' * (len(out) > 1)} {first_of(out, MAX_OUT)}"] if out else []
    kept = [c.text for c in found.best.fit.weakly_observable]  # among the details: nothing is to be done
    told = (one for one in (*first, *found.warnings) if not any(text in one for text in kept))
    style, listed = f"margin:0;color:{CAREFUL}", [text(session.measurements.named(one)) for one in told]
    seen, more = (bullets(part, style=style) for part in (listed[:SEEN], listed[SEEN:]))
    return seen and block(seen + folded(plural(len(listed) - SEEN, "more warning"), more), testid="warnings")


def _details(found: Identification, session: Session) -> str:
    """Every parameter, and what is to be known of the rows."""
    is_open = not share_of_noise(session, found) <= BEYOND_NOISE and session.results.diagnosis is None
    before = [Sentence(IF_NOISE, tone=Tone.CAREFUL)] * is_open
    fit = found.runs[session.results.fit].fit
    kept = lines("barely observable, kept near nominal", [c.text for c in fit.weakly_observable])
    remarks = [*lines("not identifiable", found.unidentifiable), *kept, *lines("note", found.notes)]
    made = as_html([*before, *parameter_blocks(fit), *remarks])
    return block(made, testid="parameters", style="margin-bottom:10px")
