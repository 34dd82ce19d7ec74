"""Comparison: step through the measured poses, choose the overlays in the scene."""

import numpy as np
import viser

from workbench.identification.algorithms import ALGORITHMS
from workbench.report.blocks import ResultTable
from workbench.report.numbers import compared
from workbench.report.result_display import as_html
from workbench.session.commands.compare import ShowRow
from workbench.session.page_state import Tab
from workbench.session.stages import stages, without_suspects
from workbench.session.state import Session
from workbench.views.page.html import block, heading
from workbench.views.page.panels.panel import AbstractPanel


class ComparePanel(AbstractPanel):
    """Errors of the models, scrubber, switches."""

    tab, order = Tab.COMPARE, 10
    depends = ("results", "choices.overlay", "measurements")

    def build(self, gui: viser.GuiApi) -> None:
        self.html(_errors)
        has_rows = lambda s: s.results.comparison is not None  # noqa: E731
        row = self.slider(
            "Data row",
            (0, 1, 1),
            "Step through the measured rows, by the file's own numbers or from 0; the arms follow.",
            lambda s: int(numbers(s)[s.results.row]),
            visible=has_rows,
            label=_heading,
            max=lambda s: max(int(numbers(s).max()), 1),
        )
        self.form(lambda n: ShowRow(int(np.abs(numbers(self._worker.session) - n).argmin())), row)
        with self.folder("Shown in the scene", visible=has_rows):
            hint = "Show the measured tool positions, coloured by their error once there is a fit."
            points = self.checkbox("Measured points", hint, lambda s: s.choices.overlay.points)
            hint = "From predicted to measured positions: grey nominal, orange the model now."
            arrows = self.checkbox("Error arrows", hint, lambda s: s.choices.overlay.arrows)
        self.form(lambda *shown: self.overlaid(points=shown[0], arrows=shown[1]), points, arrows)


def _errors(session: Session) -> str:
    """Mean and maximum error of every model that there is, on the same rows."""
    found, shown = session.results.identification, session.results.fit
    if found is None:
        return ""
    models = [(stage.words, stage.errors) for stage in stages(session)]
    models += [(ALGORITHMS[n].title, run.judged) for n, run in found.runs.items() if n != shown]
    kind = "held-out" if len(found.held_out_data) else "fitted"
    title = f"Errors of {len(models[0][1])} {kind} poses{without_suspects(session)}"
    cells = [(words, *(compared(v) for v in (e.main.mean, e.main.max))) for words, e in models]
    unit = "mm" if np.isfinite(models[0][1].position_mm.mean) else "°"
    table = ResultTable("", ("model", f"mean [{unit}]", f"max [{unit}]"), cells, words=1)
    return block(heading(title) + as_html([table]), testid="comparison", style="margin:4px 0 8px")


def numbers(session: Session) -> np.ndarray:
    """Numbers of the shown rows in the data, the file's own if it has some."""
    rows, loaded = session.results.comparison, session.measurements.loaded
    if rows is None or loaded is None:
        return np.zeros(1, int)
    own = loaded.numbers
    return np.array([own[row] if row < len(own) else row for row in rows.number.tolist()])


def _heading(session: Session) -> str:
    """What the file calls these numbers."""
    loaded = session.measurements.loaded
    return "Data row" if loaded is None or loaded.counter is None else loaded.counter.heading
