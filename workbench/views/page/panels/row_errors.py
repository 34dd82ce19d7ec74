"""Error of every row in the order of measuring: a click on one puts the arm there. Which are excluded. Errors
of the models; step through the measured poses, choose the overlays in the scene."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import viser

from workbench.arm.effects.events import AbstractEvent
from workbench.identification.algorithms import ALGORITHMS
from workbench.report.blocks import ResultTable
from workbench.report.chart import Chart, Marks, Upright
from workbench.report.numbers import compared
from workbench.report.result_display import as_html
from workbench.session.command import AbstractCommand
from workbench.session.commands.compare import ShowRow
from workbench.session.commands.identify import LeaveRowsOut
from workbench.session.comparison import STAGES, Comparison, ModelStage
from workbench.session.loaded_measurements import BY_HAND
from workbench.session.page_state import Tab
from workbench.session.stages import stage_words, stages, without_suspects
from workbench.session.state import Session
from workbench.views.appearance.colours import EVENT, EXCLUDED, SET_APART, STAGE_COLOURS, css
from workbench.views.page.html import block, heading, text
from workbench.views.page.panels.panel import AbstractPanel

MAX_BARS, WORST, MAX_OUTLIERS = 250, 3, 8
"""Rows that are drawn at most, of more evenly chosen ones; the worst ones and outliers that are named."""


class RowErrorsPanel(AbstractPanel):
    """A chart, the worst rows, and a link that leaves the shown one out, or uses it again."""

    tab, order = Tab.CALIBRATE, 25
    depends = ("results.comparison", "results.row", "measurements.left_out")

    def build(self, gui: viser.GuiApi) -> None:
        self.html(self._chart)
        self._out = self.link("exclude", lambda: self.send(lambda: exclude(self._worker.session)))

    def _chart(self, session: Session) -> str:
        rows = session.results.comparison
        if rows is None or len(rows.stages) < 2:
            return ""

        def link(k: int) -> str:
            return self.link(f"row-{k}", partial(self.send, partial(ShowRow, k)))

        links = {k: link(k) for k in shown(rows)}
        found, excluded = session.results.diagnosis, set(session.measurements.left_out)
        if found is not None:
            excluded |= {number for number, _ in found.excluded}
        happened, name = () if found is None else found.events, session.measurements.row_name
        drawing = chart(rows, session.results.row, links, stage_words(session), excluded, happened, name)
        out = f'<a href="{text(self._out)}" style="color:inherit">{text(_exclusion(session, rows))}</a>'
        return block(drawing + _named(session, rows, link) + out, testid="row-chart")


def exclude(session: Session) -> LeaveRowsOut | None:
    """Leaves the shown row out, or takes it back; None for one that is only for checking, or out anyway."""
    now, rows, row = session.measurements, session.results.comparison, session.results.row
    if now.loaded is None or session.results.is_empty or rows is None:
        return None
    number, found = int(rows.number[row]), session.results.identification or session.results.diagnosis
    out = {} if found is None else dict(found.excluded)
    is_own = number in now.loaded.dataset.row and out.get(number, BY_HAND) == BY_HAND
    return LeaveRowsOut(tuple(sorted(now.left_out ^ {number}))) if is_own else None


def _exclusion(session: Session, rows: Comparison) -> str:
    """What `exclude` does."""
    number, now = int(rows.number[row := session.results.row]), session.measurements
    why = " (no arm explains it)" * bool(rows.set_apart[row])
    does = f"Exclude {{}}{why}" if number not in now.left_out else "Use {} again"
    return does.format(f"data row {now.row_name(number)}") if exclude(session) else ""


def _named(session: Session, rows: Comparison, link: Callable[[int], str]) -> str:
    """The worst rows, those kept out by hand and those set apart as outliers; a click shows one."""
    errors = 1e3 * rows.stage_errors[:, STAGES.index(rows.stages[-1])]
    found, by_hand = session.results.identification, session.measurements.left_out
    name = session.measurements.row_name
    off = () if found is None else [outlier for outlier in found.outliers if outlier.row not in by_hand]
    place = {number: k for k, number in enumerate(rows.number.tolist())}
    worst = [k for k in rows.worst.tolist() if rows.number[k] not in by_hand]
    named = {
        "Worst": [(k, f"{name(rows.number[k])} ({errors[k]:.3g} mm)") for k in worst[:WORST]],
        "Excluded by hand": [(place[number], name(number)) for number in sorted(by_hand)],
        "Outliers": [
            (place[outlier.row], outlier.text.replace(f"{outlier.row}", name(outlier.row), 1))
            for outlier in off[:MAX_OUTLIERS]
        ],
    }
    said = (
        f"<div>{title}: rows "
        + ", ".join(
            f'<a href="{text(link(k))}" style="color:inherit">{text(words)}</a>' for k, words in listed
        )
        + "</div>"
        for title, listed in named.items()
        if listed
    )
    return f'<div style="margin-bottom:6px">{"".join(said)}</div>'


def shown(rows: Comparison) -> list[int]:
    """Rows of the chart, in the order of measuring."""
    order = np.argsort(rows.number, kind="stable")
    order = order[~rows.kept_out[order]]
    return order[np.linspace(0, len(order) - 1, min(len(order), MAX_BARS)).astype(int)].tolist()


def chart(
    rows: Comparison,
    row: int,
    links: dict[int, str],
    words: Mapping[ModelStage, str],
    excluded: Collection[int] = (),
    happened: Sequence[AbstractEvent] = (),
    name: Callable[[int], str] = str,
) -> str:
    """Errors of what was identified, stage by stage; without the nominal arm, which would dwarf them.

    Excluded rows are grey, those that no arm explains red: both at the upper edge where they lie beyond that
    of the others. A line stands before the first row after something happened.
    """
    stages = tuple(s for s in rows.stages if s is not ModelStage.NOMINAL)
    errors, order = 1e3 * rows.stage_errors, shown(rows)
    x, marks, is_out = rows.number[order].astype(float), [], np.isin(rows.number[order], list(excluded))
    is_wrong = rows.set_apart[order] & ~is_out
    top = np.nanmax(errors[order][~(is_wrong | is_out), 1:], initial=0.0)
    for stage in stages:
        y = errors[order, STAGES.index(stage)]
        kinds = ("held out" if out else "fitted" for out in rows.held_out[order])
        told = zip(rows.number[order].tolist(), kinds, y.tolist(), strict=True)
        titles = [f"row {name(k)} ({kind}): {error:.3g} mm {words[stage]}" for k, kind, error in told]
        leads = [links[k] for k in order]
        ink, model = css(STAGE_COLOURS[stage]), words[stage].capitalize()
        marks.append(Marks(x, np.where(is_out | is_wrong, np.nan, y), ink, titles, leads, name=model))
        for chosen, colour, size in ((is_wrong, SET_APART, 4.0), (is_out, EXCLUDED, 2.6)):
            edge = np.where(chosen, np.minimum(y, top), np.nan)
            marks.append(Marks(x, edge, css(colour), titles, leads, radius=size))
    ends = [(x.min(), f"row {name(int(x.min()))}"), (x.max(), name(int(x.max())))]
    now = float(rows.number[row])
    uprights = [Upright(event.row - 0.5, event.mark, css(EVENT)) for event in happened]
    for place, kind, chosen in ((-2, "No arm explains", is_wrong), (-1, "Excluded", is_out)):
        above = ", beyond the edge" * bool(np.nanmax(errors[order][chosen, 1:], initial=0.0) > top)
        marks[place] = replace(marks[place], name=f"{kind}{above}" * bool(chosen.any()))
    uprights += [Upright(now, "", "currentColor")] if x.min() <= now <= x.max() else []
    drawing = Chart(marks, 90.0, ends, floor=0.0, uprights=uprights).svg()
    counted = ", from 0" * (name(0) == "0")
    return heading(f"Remaining error by row{counted} [mm]; a click puts the arm there") + drawing


class ComparePanel(AbstractPanel):
    """Errors of the models, scrubber, switches."""

    tab, order = Tab.COMPARE, 10
    depends = ("results", "choices.overlay", "measurements", "playback.focus")

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
            min=lambda s: int(numbers(s).min()),
        )
        self.form(lambda n: ShowRow(int(np.abs(numbers(self._worker.session) - n).argmin())), row)
        with self.folder("Shown in the scene", visible=has_rows):
            hint = "Show the measured tool positions, coloured by their error once there is a fit."
            points = self.checkbox("Measured points", hint, lambda s: s.seen_rows is not None)
            hint = "From predicted to measured positions: grey nominal, orange the model now."
            arrows = self.checkbox("Error arrows", hint, lambda s: s.choices.overlay.arrows)
        self.form(self._with_points, points)
        self.form(lambda is_on: self.overlaid(arrows=is_on), arrows)

    def _with_points(self, is_on: bool) -> AbstractCommand:
        """Shown again, or in place of the plate that is looked at."""
        is_asked = is_on and self.session.choices.overlay.points
        return ShowRow(self.session.results.row) if is_asked else self.overlaid(points=is_on)


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
