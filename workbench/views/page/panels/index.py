"""The live numbers: what measurements at these targets would tell about the arm."""

from typing import Any

import numpy as np
import viser

from workbench.plate.indices import INDICES
from workbench.session.state import Score, Session
from workbench.views.appearance.colours import OUT_OF_REACH, css
from workbench.views.drawables.plate import target_colour
from workbench.views.page.html import MUTED, block, change, heading, number, table, text
from workbench.views.page.panels.panel import AbstractPanel

WIDTH, HEIGHT = 340, 46


class IndexPanel(AbstractPanel):
    """Index of each target, indices of the set, predicted error; drawn at every step of a drag."""

    def build(self, server: viser.ViserServer) -> None:
        self._html = server.gui.add_html("")

    def parts(self, session: Session) -> tuple[Any, ...]:
        return session.score, session.first_score, session.states, session.selected

    def show(self, session: Session) -> None:
        now, first = session.score, session.first_score
        self._html.content = block(
            heading("Predicted error in the region after calibration")
            + _measurable(session)
            + _predicted(now, first)
            + heading("Index O of each target")
            + _bars(session)
            + _worst(now)
            + heading("Observability of all targets (larger is better)")
            + _indices(now, first)
            + _rank(now),
            testid="index",
        )


def _measurable(session: Session) -> str:
    """How many targets count, where some don't."""
    lost = [f"target {i}: {s.obstacle}" for i, s in enumerate(session.states, 1) if not s.measurable]
    if not lost:
        return ""
    count = len(session.states)
    return (
        f'<div data-testid="measurable" title="{text("; ".join(lost))}" style="color:{css(OUT_OF_REACH)};'
        f"font-weight:600\">{count - len(lost)} of {count} targets measurable; the others don't count</div>"
    )


def _predicted(now: Score, first: Score) -> str:
    if np.isnan(now.position):
        return f'<div style="color:{MUTED}">The arm does not reach the region.</div>'
    if np.isinf(now.position):
        return (
            f'<div style="color:{css(OUT_OF_REACH)}">Unbounded: these targets leave parameters open that '
            "move the tool there. Bring more targets into reach.</div>"
        )
    better = change(now.position, first.position, larger_is_better=False)
    return (
        '<div style="display:flex;align-items:baseline;gap:8px" title="Mean over the cuboid, in any '
        'orientation and posture, if each target is measured once with the noise below.">'
        f'<span data-testid="predicted" style="font-size:22px;font-weight:650">{number(1e3 * now.position)} '
        f'mm</span><span style="font-size:14px;color:{MUTED}">{number(np.rad2deg(now.rotation))}°</span>'
        f"{better}</div>"
    )


def _bars(session: Session) -> str:
    """One bar per target, full height for O = 1."""
    values, count = session.score.per_target, len(session.states)
    step = WIDTH / max(count, 1)
    parts = []
    for i, (value, state) in enumerate(zip(values, session.states, strict=True)):
        colour = css(target_colour(state, selected=i == session.selected))
        high = 3.0 if np.isnan(value) else max(3.0, HEIGHT * float(value))
        rise = session.score.rises[i]
        words = f"target {i + 1}: " + (state.obstacle or f"O = {value:.3f}")
        words += f"; without it {100 * rise:+.0f} % error" if np.isfinite(rise) else ""
        x = step * i
        parts.append(
            f'<rect x="{x + 0.14 * step:.1f}" y="{HEIGHT - high:.1f}" width="{0.72 * step:.1f}" '
            f'height="{high:.1f}" rx="2" fill="{colour}"><title>{text(words)}</title></rect>'
            f'<text x="{x + 0.5 * step:.1f}" y="{HEIGHT + 13}" text-anchor="middle" font-size="11" '
            f'style="fill:{MUTED}">{i + 1}</text>'
        )
    own, box = values[session.selected], f"0 0 {WIDTH} {HEIGHT + 17}"
    return (
        f'<svg viewBox="{box}" width="100%" data-testid="bars">{"".join(parts)}</svg>'
        f'<div style="color:{MUTED}" title="Inverse condition number of the target alone; 1 is best.">'
        f'Target {session.selected + 1}: <span data-testid="own">{number(own)}</span>'
        f"{_loss(session.score.rises[session.selected])}</div>"
    )


def _loss(rise: float) -> str:
    """What would be lost without the selected target."""
    if np.isnan(rise):
        return ""
    words = "parameters would be undetermined" if np.isinf(rise) else f"{100 * rise:+.0f} % error"
    return f' · without it <span data-testid="loss">{words}</span>'


def _worst(now: Score) -> str:
    """The parameters that are determined worst, by name."""
    if not now.worst:
        return ""
    shown = ", ".join(f"{text(name)} {_spread(error, unit)}" for name, error, unit in now.worst)
    return (
        f'<div data-testid="worst" style="color:{MUTED}" title="Parameters with the largest standard error '
        f'after a calibration here; angles count as arcs at the arm&#39;s reach.">'
        f"Least certain: {shown}</div>"
    )


def _spread(error: float, unit: str) -> str:
    if np.isinf(error):
        return "open"
    return f"±{number(1e3 * error, 2)} mm" if unit == "m" else f"±{number(np.rad2deg(error), 2)}°"


def _indices(now: Score, first: Score) -> str:
    rows = []
    for name, index in INDICES.items():
        label = f'<span title="{text(index.meaning)} — {text(index.source)}">{text(name)}</span>'
        value = f'<span data-testid="{text(name)}">{number(now.indices[name], 4)}</span>'
        rows.append((label, value, change(now.indices[name], first.indices[name], larger_is_better=True)))
    return table(("Index", "now", "change"), rows)


def _rank(now: Score) -> str:
    missing = now.parameters - now.rank
    words = (
        f"Rank {now.rank} of {now.parameters} · condition {number(now.condition)} · {now.measurable} targets"
    )
    colour = MUTED if missing == 0 else css(OUT_OF_REACH)
    more = f"<br>{missing} parameter combinations are undetermined." if missing else ""
    return f'<div data-testid="rank" style="color:{colour};margin-top:4px">{words}{more}</div>'
