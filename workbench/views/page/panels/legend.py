"""Window over the scene's empty corner: what its colours mean, and the errors of the selected row."""

from collections.abc import Iterable, Mapping
from functools import partial

import numpy as np
import viser

from workbench.report.numbers import compared
from workbench.session.comparison import MAX_TIMES, STAGES, Comparison, ModelStage
from workbench.session.cube_fields import are_shown, drawn_field, inputs
from workbench.session.stages import shown_stage, stage_words
from workbench.session.state import Focus, Session
from workbench.views.appearance import colours
from workbench.views.appearance.colours import ErrorScale, css, gradient
from workbench.views.drawables.arms import model_and_real
from workbench.views.drawables.measured import error_scale
from workbench.views.drawables.real_arm import bending_robot
from workbench.views.drawables.scene_contents import first_view
from workbench.views.page.html import MUTED, badge, block, text
from workbench.views.page.panels.form import Control
from workbench.views.page.panels.panel import AbstractPanel
from workbench.views.page.scene.scene import aim
from workbench.views.page.style import ONLY_TRACK

DECADES = int(np.log10(MAX_TIMES))
"""Of the slider, which is logarithmic."""
MARKS = tuple((float(k), f"{10**k:,}".replace(",", " ")) for k in range(DECADES + 1))
WIDTH, MARGIN = 300, 15
BAR = "height:10px;border-radius:3px;margin-top:5px"
"""Style of a colour scale."""
ENDS = 20.0, 65.0
"""Where along it there is room for words besides those at its ends [%]."""


class LegendPanel(AbstractPanel):
    """A separate window in the upper left corner: what colours mean, and the errors of the selected row."""

    depends = (
        *("plate", "states", "drag", "region", "playback", "measurements", "results", "choices.overlay"),
        *("page.chore", bending_robot, inputs),
    )

    def build(self, gui: viser.GuiApi) -> None:
        def look(event: viser.GuiEvent) -> None:
            if event.client is not None:
                aim(event.client, *first_view(self.session))

        window = gui.add_panel()
        with window.add_tab("Legend"):
            self.html(self._key)
            self.html(lambda s: f"<div {ONLY_TRACK}></div>" if has_errors(s) else "")
            hint = "How many times larger than they are all errors are drawn: of arms, arrows and paths."
            slider = gui.add_slider("Errors ×", 0.0, float(DECADES), 0.01, 0.0, marks=MARKS, hint=hint)
            times = Control(
                slider,
                lambda power: float(f"{10.0**power:.2g}"),
                visible=has_errors,
                label=lambda s: f"Errors × {s.choices.overlay.exaggeration:g}",
                value=lambda s: round(float(np.log10(s.choices.overlay.exaggeration)), 2),
            )
            hint = "Look at the whole arm again, with its plate or its rows."
            self.press("Whole view", look, viser.Icon.HOME, hint)
        self.form(lambda times: self.overlaid(exaggeration=times), self.add(times))
        window.float(x=MARGIN, y=MARGIN, width=WIDTH)
        self._links = {
            stage: self.link(f"stage-{stage.name}", partial(self.send, partial(self.overlaid, stage=stage)))
            for stage in ModelStage
        }

    def _key(self, session: Session) -> str:
        rows, scales = session.seen_rows, cubes_scale(session)
        if rows is not None and rows.stages:  # two scales of the same colours each need a name
            named = '<div style="margin-top:6px">Error at the measured points</div>' if scales else ""
            scales += named + points(session, rows, self._links)
        content = scales + things(session)
        return content and block(content, testid="key", style="margin:2px 0 6px")


def has_errors(session: Session) -> bool:
    """Whether the scene has anything that is drawn larger than it is."""
    return model_and_real(session) is not None and session.playback.focus is not Focus.TARGET


def cubes_scale(session: Session) -> str:
    """Meaning, colours and unit of the cubes."""
    field = drawn_field(session) if are_shown(session) else None
    if field is None:
        return ""
    if (numbers := field.values(session)) is None:
        return f'<div style="color:{MUTED}">{text(field.title)} …</div>' if session.page.chore else ""
    is_better = field.larger_is_better
    low, high = (compared(field.factor * end, 2) for end in (numbers.low, numbers.high))
    if field.is_signed:
        low, high = f"−{high}", f"+{high}"
    first, last = (low, high) if is_better else (f"≤ {low}", f"≥ {high}")
    ends = (0.0, first), (100.0, f"{last} {text(field.unit)}")
    shown = colour_scale(ends, larger_is_better=is_better)
    grey = "no value" if field.is_signed else "not reached"
    kinds = {"not bounded": (colours.UNBOUNDED, np.isinf), grey: (colours.NO_VALUE, np.isnan)}
    beside = {name: css(ink) for name, (ink, is_so) in kinds.items() if is_so(numbers.numbers).any()}
    return f"<div>{text(field.title)}</div>{shown}{named(beside)}"


def colour_scale(ticks: Iterable[tuple[float, str]], *, larger_is_better: bool = False) -> str:
    """The colours from end to end, with words below at some places [%]."""
    words = (
        f'<span style="position:absolute;left:{at:.1f}%;transform:translateX(-{at:.0f}%)">{shown}</span>'
        for at, shown in ticks
    )
    return (
        f'<div style="{BAR};background:{gradient(larger_is_better=larger_is_better)}"></div>'
        '<div style="position:relative;height:19px;white-space:nowrap">'
        f"{''.join(words)}</div>"
    )


def things(session: Session) -> str:
    """Colours of what stands and moves in the scene."""
    overlay, focus, rows = session.choices.overlay, session.playback.focus, session.seen_rows
    has_plate, is_bent = session.shows_plate, has_errors(session)
    marks = (
        ("measured", colours.FITTED, rows is not None and not rows.stages),
        ("target", colours.REACHED, has_plate),
        ("selected", colours.SELECTED, has_plate),
        ("out of reach", colours.OUT_OF_REACH, has_plate and any(not s.reached for s in session.states)),
        ("blocked", colours.BLOCKED, has_plate and any(s.reached and s.hit for s in session.states)),
        ("model", colours.JOINT, is_bent),
        ("real arm", colours.CALIBRATED, is_bent),
        ("nominal error", colours.NOMINAL, is_bent and overlay.arrows and focus in (Focus.ROW, Focus.JOG)),
        ("other branches", colours.BRANCH, overlay.ghosts and focus is Focus.TARGET),
    )
    content = named({label: css(colour) for label, colour, is_seen in marks if is_seen})
    return content and f'<span data-testid="things">{content}</span>'


def named(inks: Mapping[str, str]) -> str:
    """Dots of these colours, each with what it means."""
    style = "white-space:nowrap;margin-right:10px"
    return "".join(f'<span style="{style}">{badge("", ink)}{name}</span> ' for name, ink in inks.items())


def points(session: Session, rows: Comparison, links: Mapping[ModelStage, str]) -> str:
    """Errors of the measured points, and their colours; a click on another stage of the model shows its."""
    words, shown, stages = stage_words(session), shown_stage(session, rows), []
    for stage in rows.stages:
        style = "font-weight:650;color:inherit" if stage is shown else f"color:{MUTED}"
        name = f'title="Show the errors of this model" style="{style}">{words[stage]}'
        stages.append(f'<a href="{text(links[stage])}" {name}</a>')
    parts = (
        f"<div>Error: {' · '.join(stages)}</div>",
        f'<div data-testid="colour-bar">{colour_bar(error_scale(rows))}</div>',
        marks(rows, session.measurements.left_out),
        row_errors(session, rows, words) if session.playback.focus is Focus.ROW else "",
    )
    return f'<div data-testid="residuals">{"".join(parts)}</div>'


def colour_bar(scale: ErrorScale) -> str:
    """The scale with its ticks in mm."""
    ticks, last = [], len(scale.ticks) - 1
    for i, tick in enumerate(scale.ticks):
        at = 100.0 * float(scale.shares(np.array(tick)))
        if i in (0, last) or ENDS[0] < at < ENDS[1]:
            shown = ("≤ " if i == 0 else "≥ " if i == last else "") + compared(1e3 * tick, 1)
            ticks.append((at, shown + (" mm" if i == last else "")))
    return colour_scale(ticks)


def marks(rows: Comparison, left_out: frozenset[int]) -> str:
    """What round and square points are, and that they answer to a click."""
    kinds = "● fitted ■ held out" if rows.held_out.any() else "● fitted"
    grey = f' <span style="color:{css(colours.EXCLUDED)}">●</span> excluded' if left_out else ""
    if count := len({*rows.number[rows.set_apart].tolist()} - left_out):
        grey += f' <span style="color:{css(colours.SET_APART)}">●</span> {count} that no arm explains'
    return f'<div style="color:{MUTED}">{kinds}{grey} · click one for its numbers</div>'


def row_errors(session: Session, rows: Comparison, words: Mapping[ModelStage, str]) -> str:
    """Errors of the shown row."""
    row = session.results.row
    number, kind = int(rows.number[row]), "held out" if rows.held_out[row] else "fitted"
    name = session.measurements.row_name(number)
    kind = "excluded" if rows.kept_out[row] or number in session.measurements.left_out else kind
    each = ((words[stage], 1e3 * float(rows.errors[row, STAGES.index(stage)])) for stage in rows.stages)
    known = [f"{compared(error)} mm {name}" for name, error in each if np.isfinite(error)]
    errors = ", ".join(known) or "no position was measured"
    counted = "from 0; " * (name == f"{number}")
    content = f"{badge('', css(colours.MARK))}<b>Data row {text(name)}</b> ({counted}{kind}): {errors}"
    return f'<div data-testid="row-errors" style="margin-top:4px">{content}</div>'
