"""Identification: start it, inspect its results."""

import numpy as np
import viser

from workbench.identification.algorithms import ALGORITHMS, USUAL
from workbench.identification.result import Identification, judged
from workbench.session.commands.compare import ShowFit
from workbench.session.commands.identify import Identify
from workbench.session.judgement import arm_judgement
from workbench.session.state import Session, Tab
from workbench.session.worker import Worker
from workbench.views.appearance.colours import OUT_OF_REACH, css
from workbench.views.page.html import CAREFUL, GOOD, INKS, MUTED, block, bullets, heading, number, table, text
from workbench.views.page.panels.figure import error_figure
from workbench.views.page.panels.index import WantedPanel
from workbench.views.page.panels.panel import AbstractPanel, on_change, set_value, sheet, waiting
from workbench.views.page.panels.result_card import result_card
from workbench.views.page.panels.saving import ArmFiles
from workbench.views.page.style import WIDE

POSITION, ORIENTATION = "Position [mm]", "Orientation [°]"
READY = "Ready. Press Identify to fit the parameters."
FRAMES = {
    "Decide from the data": "auto",
    "Shared by all sessions": "shared",
    "Separate for each session": "per-session",
}


class FitPanel(AbstractPanel):
    """Algorithms side by side on the same rows."""

    tab, order = Tab.CALIBRATE, 10
    depends = ("identification", "fit", "loaded", "wanted", "is_idle")

    def __init__(self, worker: Worker):
        super().__init__(worker)
        self._wanted = WantedPanel(worker)

    def build(self, gui: viser.GuiApi) -> None:
        self._start = self.button(
            "Identify",
            self._identify,
            viser.Icon.PLAYER_PLAY,
            "Fit the parameters to the measurements with every ticked algorithm.",
            main=True,
        )
        with gui.add_folder("Options", expand_by_default=False):
            self._chosen = {
                name: gui.add_checkbox(algorithm.title, name in USUAL, hint=algorithm.summary)
                for name, algorithm in ALGORITHMS.items()
            }
            self._held_out = self.slider(
                "Held out [%]",
                20,
                (5, 50, 5),
                "Share of the rows held out of the fit; rely on the error there. A virtual arm has its own "
                "checking poses instead.",
            )
            self._frames = gui.add_dropdown(
                "Base and tool",
                list(FRAMES),
                hint="Whether all measurement sessions share the same base and tool frames.",
            )
        self._card = gui.add_html("")
        self._judging = gui.add_folder(None, visible=False)
        with self._judging:
            self._wanted.make(gui)
        self._requirement = gui.add_html("", visible=False)
        self._warnings = gui.add_html("", visible=False)
        self._files = ArmFiles(self, gui)
        self._details = gui.add_folder("Details", expand_by_default=False, visible=False)
        with self._details:
            self._build_details(gui)

    def _build_details(self, gui: viser.GuiApi) -> None:
        """Algorithms side by side, errors axis by axis, and every parameter."""
        self._errors = gui.add_html("")
        self._fit = gui.add_dropdown(
            "Shown fit",
            list(_titles().values()),
            hint="The fit whose parameters and arm are shown and saved.",
        )
        names = {title: name for name, title in _titles().items()}
        self.sends(self._fit, lambda: ShowFit(names[self._fit.value]))
        self._errors_of = gui.add_dropdown(
            "Errors of",
            (POSITION, ORIENTATION),
            hint="Errors plotted below, axis by axis; hover over a stem to see its row.",
        )
        on_change(self._errors_of, self._draw_figure)
        self._figure = gui.add_html("")
        self._drawn_figure: tuple[Identification, bool, str] | None = None
        wide = gui.add_button(
            "All algorithms, full width",
            icon=viser.Icon.ARROWS_MAXIMIZE,
            color="gray",
            hint="Errors of all algorithms, axis by axis, as wide as the window.",
        )
        wide.on_click(self._show_wide)
        self._parameters = gui.add_html("")
        self._remarks = gui.add_html("")

    def show(self, session: Session) -> None:
        self._start.disabled = session.loaded is None or session.job is not None
        found = session.identification
        self._wanted.show(session)
        self._files.show(session)
        for part in (self._judging, self._requirement, self._warnings, self._details):
            part.visible = found is not None
        self._card.content = waiting(session, "result", READY) if found is None else result_card(session)
        if found is not None:
            self._errors.content = _errors(found, session.fit)
            self._fit.options = [_titles()[name] for name in found.runs]
            set_value(self._fit, _titles()[session.fit])
            self._requirement.content = _requirement(session)
            self._draw_figure()
            self._parameters.content = _parameters(found, session.fit)
            self._warnings.content = block(
                _list("Warnings", found.warnings, CAREFUL), testid="warnings", style="margin-bottom:8px"
            )
            self._remarks.content = block(_remarks(found), testid="remarks", style="margin-bottom:10px")

    def _identify(self) -> Identify:
        algorithms = tuple(name for name, box in self._chosen.items() if box.value)
        share = 0.01 * float(self._held_out.value)
        levelled = self._worker.session.levelled
        return Identify(algorithms, share, FRAMES[self._frames.value], levelled=levelled)

    def _draw_figure(self) -> None:
        """Draw the errors of the shown fit, unless they are drawn: every message comes by here."""
        session, rotation = self._worker.session, self._errors_of.value == ORIENTATION
        found = session.identification
        if found is None or self._drawn_figure == (found, rotation, session.fit):
            return
        self._drawn_figure = found, rotation, session.fit
        drawing = error_figure(found, rotation=rotation, fits=(session.fit,)) or "Not measured."
        self._figure.content = block(drawing, style="margin:4px 0 8px")

    def _show_wide(self, event: viser.GuiEvent) -> None:
        found = self._worker.session.identification
        if found is not None:
            parts = (error_figure(found, rotation=turned) for turned in (False, True))
            sheet(event, "Errors, axis by axis", f"<div {WIDE}>{''.join(parts)}</div>")


def _titles() -> dict[str, str]:
    """Of all algorithms that there are by now."""
    return {name: algorithm.title for name, algorithm in ALGORITHMS.items()}


def _errors(found: Identification, shown: str) -> str:
    """Errors on held-out rows, before and after, one line per algorithm."""
    rows = [("Nominal arm", *_cells(found.nominal), "")]
    for name, run in found.runs.items():
        label = _titles()[name] if name != shown else f"<b>{_titles()[name]}</b>"
        outcome = "✓" if run.fit.outcome.ok else "✗"
        colour = GOOD if run.fit.outcome.ok else css(OUT_OF_REACH)
        mark = f'<span title="{text(run.fit.outcome)}" style="color:{colour}">{outcome}</span>'
        rows.append((label, *_cells(run), mark))
    held = len(found.held_out_data)
    title = f"Error on {held} held-out poses" if held else "Error on the fitted poses (none held out)"
    header = ("", "mean [mm]", "max [mm]", "mean [°]", "")
    return block(heading(title) + table(header, rows, testid="errors"))


def _cells(validation) -> tuple[str, str, str]:
    errors = judged(validation)
    turned = "–" if errors.orientation_deg is None else number(errors.orientation_deg.mean)
    return number(errors.position_mm.mean), number(errors.position_mm.max), turned


def _requirement(session: Session) -> str:
    """Pass or fail of the shown fit against the required error."""
    judged = arm_judgement(session)
    if judged is None:
        return ""
    colour = INKS[judged.tone]
    return block(
        text(judged.text), testid="requirement", style=f"margin:4px 0;color:{colour};font-weight:600"
    )


def _remarks(found: Identification) -> str:
    """Remarks in addition to the numbers."""
    return "".join(
        _list(head, items, colour)
        for head, items, colour in (
            ("Not identifiable from these poses; kept near nominal", found.unidentifiable, CAREFUL),
            ("Notes", found.notes, MUTED),
        )
    )


def _list(head: str, items: tuple[str, ...], colour: str) -> str:
    if not items:
        return ""
    return heading(head) + bullets(map(text, items), style=f"margin:0;color:{colour}")


def _uncertain(std: float) -> str:
    """A standard error: three decimals, or two figures of one that would look like none."""
    return f"{std:.3f}" if std >= 0.0005 or std == 0.0 else f"{std:.1g}"


def _parameters(found: Identification, shown: str) -> str:
    """Nominal, identified and standard error, in mm and degrees."""
    fit = found.runs[shown].fit
    rows = []
    for parameter, value, std in zip(fit.parameters, fit.x, fit.std, strict=True):
        scale, unit = {"rad": (np.rad2deg(1.0), "°"), "m": (1e3, "mm")}.get(
            parameter.unit, (1e6, f"10⁻⁶ {parameter.unit}")
        )
        rows.append(
            (
                f'{text(parameter.text)} <span style="color:{MUTED}">{unit}</span>',
                f"{scale * parameter.nominal:.3f}".replace("-", "−"),
                f"{scale * value:.3f}".replace("-", "−"),
                "–" if parameter.text in fit.idle else f"±{_uncertain(scale * std)}",
            )
        )
    header = ("Parameter", "nominal", "identified", "std. error")
    return block(
        heading(f"Parameters identified by {_titles()[shown]}") + table(header, rows, testid="parameters"),
        style="margin-bottom:10px",
    )
