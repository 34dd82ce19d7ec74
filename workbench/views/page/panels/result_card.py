"""The result as one card: errors stage by stage, and a histogram of all rows before and after."""

import numpy as np
from jaxtyping import Float

from workbench.diagnosis.result import Diagnosis
from workbench.session.guide import StageErrors, noise_length, stages
from workbench.session.state import Session
from workbench.views.appearance.colours import css, stage_colours
from workbench.views.page.html import MUTED, block, number, on_any_page, text

WIDTH, HEIGHT, FOOT = 420.0, 96.0, 18.0
BINS = 36
TICKS = (1.0, 2.0, 5.0)
MIN_DRAWN_ERROR = 1e-3
"""Errors below this are drawn as this [mm]."""


def result_card(session: Session) -> str:
    """The card in HTML; empty before there is a result."""
    found = session.results.identification
    if found is None:
        return ""
    done = stages(session)
    kind = "held-out" if len(done[0].rows) == len(found.held_out_data) else "fitted"
    fitted = [words for words, parts in (("base", found.frames.base), ("tool", found.frames.tool)) if parts]
    where = f"; {' and '.join(fitted)} fitted in all of them" if fitted else ""
    measured = int(np.isfinite(done[0].rows).sum())
    below = f"Mean position error on {measured} {kind} poses{where}."
    if not measured:
        below = f"No positions were measured{where}."
    return block(
        numbers(done)
        + histogram(done, noise_length(found))
        + f'<div style="color:{MUTED}">{text(below)}</div>',
        testid="result",
        style="margin:8px 0",
    )


def weighed(diagnosis: Diagnosis) -> str:
    """Why its geometry is not quite that of Identify."""
    words = " Geometry as the diagnosis fits it, which expects constants near nominal"
    return f"{words}." if diagnosis.joint_noise is None else f"{words} and weighs poses by the joints' noise."


def numbers(done: tuple[StageErrors, ...]) -> str:
    """The errors, large, with an arrow between two."""
    parts = [
        f'<div style="text-align:center"><div style="font-size:24px;font-weight:650;line-height:1.2">'
        f"{number(stage.error)}</div>"
        f'<div style="color:{on_any_page(colour)};font-weight:600">{text(stage.title)}</div></div>'
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
    values = [np.maximum(1e3 * s.rows[np.isfinite(s.rows)], MIN_DRAWN_ERROR) for s in done]
    if not all(map(len, values)):
        return ""
    ends = [v for some in values for v in (some.min(), some.max())] + ([noise] if noise > 0.0 else [])
    edges = np.geomspace(0.9 * min(ends), 1.1 * max(ends), BINS + 1)
    counts = [np.histogram(some, edges)[0] for some in values]
    top = max(int(c.max()) for c in counts)
    parts = [_axis(edges)]
    for stage, count, colour in zip(done, counts, _colours(done), strict=True):
        parts.append(_steps(count / top, stage.title, colour))
    if noise > 0.0:
        x = _place(noise, edges)
        anchor = "end" if x > 0.5 * WIDTH else "start"
        parts.append(
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="0" y2="{HEIGHT}" style="stroke:currentColor" '
            'stroke-width="1.2" stroke-dasharray="4 3"/>'
            f'<text x="{x + (-4 if anchor == "end" else 4):.1f}" y="11" text-anchor="{anchor}" '
            f'style="fill:currentColor">the instrument: {number(noise, 2)} mm</text>'
        )
    return (
        f'<svg viewBox="0 0 {WIDTH:.0f} {HEIGHT + FOOT:.0f}" width="100%" data-testid="histogram" '
        f'style="font-size:12px;display:block;margin:2px 0">{"".join(parts)}</svg>'
    )


def _colours(done: tuple[StageErrors, ...]) -> tuple[str, ...]:
    return tuple(map(css, stage_colours(len(done))))


def _place(value: float, edges: Float[np.ndarray, " n"]) -> float:
    """Where an error is on the axis."""
    low, high = np.log(edges[[0, -1]])
    return WIDTH * float((np.log(value) - low) / (high - low))


def _axis(edges: Float[np.ndarray, " n"]) -> str:
    """A line with the numbers 1, 2, 5 of each power of ten; fewer where they would touch."""
    powers = np.arange(np.floor(np.log10(edges[0])), np.ceil(np.log10(edges[-1])) + 1)
    shown = TICKS if np.log10(edges[-1] / edges[0]) < 2.2 else TICKS[:1]
    ticks = [t * 10.0**p for p in powers for t in shown if edges[0] < t * 10.0**p < edges[-1]]
    parts = [
        f'<line x1="0" x2="{WIDTH}" y1="{HEIGHT}" y2="{HEIGHT}" style="stroke:{MUTED}" stroke-width="1"/>'
    ]
    for tick in ticks:
        x = _place(tick, edges)
        parts.append(
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{HEIGHT}" y2="{HEIGHT + 4}" style="stroke:{MUTED}"/>'
            f'<text x="{min(max(x, 12), WIDTH - 22):.1f}" y="{HEIGHT + 15}" text-anchor="middle" '
            f'style="fill:{MUTED}">{tick:g}{" mm" if tick == ticks[-1] else ""}</text>'
        )
    return "".join(parts)


def _steps(shares: Float[np.ndarray, " n"], title: str, colour: str) -> str:
    width = WIDTH / BINS
    points = [f"0,{HEIGHT}"]
    for k, share in enumerate(shares):
        y = HEIGHT - (HEIGHT - 14.0) * share
        points += [f"{k * width:.1f},{y:.1f}", f"{(k + 1) * width:.1f},{y:.1f}"]
    points.append(f"{WIDTH},{HEIGHT}")
    return (
        f'<polygon points="{" ".join(points)}" fill="{colour}" fill-opacity=".35" stroke="{colour}" '
        f'stroke-width="1.2"><title>{text(title)}</title></polygon>'
    )
