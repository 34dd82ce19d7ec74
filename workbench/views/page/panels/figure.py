"""The paper's array of error plots as an interactive drawing (ARIA Figs. 7 and 11).

Rows X, Y, Z and norm; columns NOM and every algorithm. Every stem tells its row and its error; held-out
rows are pink. The nominal column has a scale of its own where its errors are much larger.
"""

import numpy as np

from workbench.identification.result import ArmErrors, Identification, columns_of, order_of_measuring
from workbench.views.appearance.colours import FITTED, HELD_OUT, css
from workbench.views.page.html import MUTED, label, text

LABELS = ("X", "Y", "Z", "norm")
CELL, GAP, LEFT, TOP = (150.0, 78.0), 12.0, 46.0, 18.0
"""Size of one plot, room between two, and room for words."""
MAX_STEMS = 400
"""Rows drawn at most; of more, evenly chosen ones."""


def error_figure(found: Identification, *, rotation: bool = False, fits: tuple[str, ...] = ()) -> str:
    """The drawing as SVG, of these fits or all beside the nominal arm; empty if no row has such errors."""
    first, *others = columns_of(found)
    shown = [c for name, c in zip(found.runs, others, strict=True) if not fits or name in fits]
    columns, place = [first, *shown], order_of_measuring(found)
    scale = float(np.rad2deg(1.0)) if rotation else 1e3
    tables = [scale * _errors(column, rotation) for column in columns]
    if not np.isfinite(tables[0]).any():
        return ""
    held = np.arange(len(place)) >= len(columns[0].train)
    unit = "°" if rotation else "mm"
    width = LEFT + len(columns) * (CELL[0] + GAP)
    height = TOP + 4 * (CELL[1] + GAP) + 6
    parts = [
        label(LEFT + j * (CELL[0] + GAP) + 0.5 * CELL[0], 12.0, column.title, anchor="middle")
        for j, column in enumerate(columns)
    ]
    for i in range(4):
        common = max(_span(t[:, i]) for t in tables[1:]) if len(tables) > 1 else _span(tables[0][:, i])
        y = TOP + i * (CELL[1] + GAP)
        parts.append(label(2.0, y + 0.5 * CELL[1], LABELS[i]))
        parts.append(label(2.0, y + 0.5 * CELL[1] + 12, unit))
        for j, table in enumerate(tables):
            span = _span(table[:, i]) if j == 0 else common
            parts.append(_cell(LEFT + j * (CELL[0] + GAP), y, table[:, i], place, held, span, i, unit))
    return (
        f'<svg viewBox="0 0 {width:.0f} {height:.0f}" width="100%" data-testid="figure" '
        f'style="font-size:12px">{"".join(parts)}</svg>'
    )


def _errors(column: ArmErrors, rotation: bool) -> np.ndarray:
    """X, Y, Z and norm of every row."""
    both = [c.rotation if rotation else c.position for c in (column.train, column.held_out)]
    axes = np.concatenate(both)
    return np.column_stack([axes, np.linalg.norm(axes, axis=1)])


def _span(values: np.ndarray) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return max(float(finite.max()), 1e-9) if len(finite) else 1.0


def _cell(x, y, values, place, held, span: float, row: int, unit: str) -> str:
    """One plot: a frame, its zero line, its scale, and a stem for every row."""
    is_norm = row == 3
    zero = y + (CELL[1] if is_norm else 0.5 * CELL[1])
    room = (CELL[1] if is_norm else 0.5 * CELL[1]) - 3
    step = CELL[0] / max(float(place.max()), 1.0)
    parts = [
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{CELL[0]}" height="{CELL[1]}" fill="none" '
        f'style="stroke:{MUTED}" stroke-width=".5"/>',
        f'<line x1="{x:.1f}" x2="{x + CELL[0]:.1f}" y1="{zero:.1f}" y2="{zero:.1f}" style="stroke:{MUTED}" '
        'stroke-width=".5"/>',
        label(x + 3, y + 10, f"±{span:.2g}" if not is_norm else f"{span:.2g}"),
    ]
    for k in np.flatnonzero(np.isfinite(values))[:: max(1, -(-len(values) // MAX_STEMS))]:
        at, end = x + step * (place[k] - 0.5), zero - room * values[k] / span
        colour = css(HELD_OUT if held[k] else FITTED)
        kind = "held out" if held[k] else "fitted"
        words = f"measurement {place[k]}: {values[k]:.3g} {unit}, {kind}"
        parts.append(
            f'<g stroke="{colour}"><title>{text(words)}</title>'
            f'<line x1="{at:.1f}" x2="{at:.1f}" y1="{zero:.1f}" y2="{end:.1f}" stroke-width="1.2"/>'
            f'<circle cx="{at:.1f}" cy="{end:.1f}" r="1.4" fill="{colour}"/></g>'
        )
    return "".join(parts)
