"""The result as one card: the error before and after, and a histogram of all rows for both."""

import numpy as np
from jaxtyping import Float

from workbench.base.wording import capital
from workbench.diagnosis.result import Diagnosis
from workbench.report.chart import Chart, Marks, Upright
from workbench.report.numbers import compared
from workbench.session.comparison import ModelStage
from workbench.session.stages import StageErrors, expected_elsewhere, noise_length, stages, without_suspects
from workbench.session.state import Session
from workbench.views.appearance.colours import STAGE_COLOURS, css
from workbench.views.page.html import CAREFUL, MUTED, block, text

HEIGHT, BINS = 84.0, 36
TICKS = (1.0, 2.0, 5.0)
MIN_DRAWN_ERROR = 1e-3
"""Errors below this are drawn as this [mm]."""


def result_card(session: Session) -> str:
    """The card in HTML; empty before there is a result."""
    found = session.results.identification
    if found is None:
        return ""
    done = first, *_ = stages(session)
    kind = "held-out" if len(found.held_out_data) else "fitted"
    fitted = [frame for frame, parts in (("base", found.frames.base), ("tool", found.frames.tool)) if parts]
    where = f"; each arm with its own fitted {' and '.join(fitted)}" if fitted else ""
    measured, aside = int(np.isfinite(first.errors.position).sum()), without_suspects(session)
    below = f"Mean position error on {measured} {kind} poses{aside}{where}; the chart counts them by error."
    if not measured:
        below = f"No positions were measured{where}."
    elsewhere = ""
    if np.isfinite(expected := expected_elsewhere(session)):
        says = (
            f"{compared(expected)} mm expected" if expected < first.error else "not certain to beat nominal"
        )
        hint = text(capital(found.transfer_warning()))
        elsewhere = f'<div title="{hint}" style="color:{CAREFUL}">{says} elsewhere</div>'
    return block(
        numbers(done)
        + elsewhere
        + histogram(done, noise_length(found))
        + f'<div style="color:{MUTED}">{text(below)}</div>',
        testid="result",
        style="margin:8px 0",
    )


def weighed(session: Session, diagnosis: Diagnosis) -> str:
    """Why its geometry is not quite that of Identify."""
    more = diagnosis.remaining.joint_noise and " and weights poses by the noise of the joint readings"
    own = f"The diagnosis keeps constants near nominal{more or ''}: its geometry alone leaves "
    known = [s.error for s in stages(session) if s.title is ModelStage.GEOMETRY]
    saved = "; until these are added, files hold that arm" * (not session.results.accepted)
    other = f", that of Identify {compared(known[0])} mm{saved}" if known else ""
    return f"{own}{compared(diagnosis.before.judged.position_mm.mean)} mm{other}."


def numbers(done: tuple[StageErrors, ...]) -> str:
    """The errors, large, with an arrow between them; in colours that read on light and on dark pages."""
    parts = [
        f'<div style="text-align:center"><div style="font-size:24px;font-weight:650;line-height:1.2">'
        f"{compared(stage.error)}</div>"
        f'<div style="color:color-mix(in srgb,{colour} 60%,currentColor);font-weight:600;max-width:9em">'
        f"{text(stage.words)}</div></div>"
        for stage, colour in zip(done, _colours(done), strict=True)
    ]
    arrow = f'<div style="font-size:20px;color:{MUTED}">→</div>'
    return (
        '<div data-testid="stages" style="display:flex;gap:12px;align-items:flex-start;margin-bottom:6px">'
        f'{arrow.join(parts)}<div style="font-size:16px;margin-top:6px">mm</div></div>'
    )


def histogram(done: tuple[StageErrors, ...], noise: float) -> str:
    """How many rows have which error, on one logarithmic axis.

    `noise` is the mean length of the instrument's errors [mm], NaN where it is unknown.
    """
    rows = (stage.errors.position for stage in done)
    values = [np.maximum(1e3 * some[np.isfinite(some)], MIN_DRAWN_ERROR) for some in rows]
    if not all(map(len, values)):
        return ""
    ends = [v for some in values for v in (some.min(), some.max())] + ([noise] if noise > 0.0 else [])
    edges = np.geomspace(0.9 * min(ends), 1.1 * max(ends), BINS + 1)
    marks, x = [], np.repeat(np.log(edges), 2)
    for stage, some, ink in zip(done, values, _colours(done), strict=True):
        steps = np.pad(np.repeat(np.histogram(some, edges)[0].astype(float), 2), 1)  # between two edges
        marks.append(Marks(x, steps, ink, (stage.words,), is_line=True, is_filled=True))
    seen = [Upright(float(np.log(noise)), f"the instrument: {compared(noise, 2)} mm", "currentColor")]
    lines = seen if noise > 0.0 else ()
    return Chart(marks, HEIGHT, ticks=_ticks(edges), uprights=lines, floor=0.0, testid="histogram").svg()


def _colours(done: tuple[StageErrors, ...]) -> tuple[str, ...]:
    return tuple(css(STAGE_COLOURS[stage.title]) for stage in done)


def _ticks(edges: Float[np.ndarray, " n"]) -> list[tuple[float, str]]:
    """The numbers 1, 2, 5 of each power of ten; fewer where they would touch."""
    powers = np.arange(np.floor(np.log10(edges[0])), np.ceil(np.log10(edges[-1])) + 1)
    shown = TICKS if np.log10(edges[-1] / edges[0]) < 2.2 else TICKS[:1]
    ticks = [t * 10.0**p for p in powers for t in shown if edges[0] < t * 10.0**p < edges[-1]]
    return [(float(np.log(t)), f"{t:g}" + (" mm" if t == ticks[-1] else "")) for t in ticks]
