"""Figures of constants: correction and its significance, influence on the tool (Katana fig.
3.8)."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from workbench.identification.report.parameters import unseen
from workbench.identification.result import Run
from workbench.report.figures import COLOURS, INK, grid, look, new_figure
from workbench.report.numbers import signed

SIGNIFICANT_ERRORS = 2.0
"""Standard errors above which a correction is significant."""


def corrections(run: Run) -> Figure | None:
    """Identified minus nominal value of every constant in standard errors; None if no constant is free."""
    fit = run.fit
    hidden = unseen(fit)
    shown = [
        i for i, p in enumerate(fit.parameters) if p.is_geometry and p.name not in hidden and fit.std[i] > 0.0
    ]
    if not shown:
        return None
    change = np.array([fit.x[i] - fit.parameters[i].nominal for i in shown])
    ratio = change / fit.std[shown]
    angle = np.array([fit.parameters[i].unit == "rad" for i in shown])
    place = np.arange(len(shown))[::-1]
    with look():
        figure = new_figure(10.0, 0.8 + 0.19 * len(shown))
        axes = figure.subplots()
        axes.set_xscale("symlog", linthresh=10.0, linscale=1.5)
        axes.axvspan(-SIGNIFICANT_ERRORS, SIGNIFICANT_ERRORS, color=INK, alpha=0.08, lw=0)
        axes.axvline(0.0, color=INK, lw=0.6)
        kinds = ((angle, COLOURS[0], "o", "angles"), (~angle, COLOURS[1], "s", "lengths"))
        for mine, colour, marker, text in kinds:
            if mine.any():
                style: Any = {"fmt": marker, "ms": 4, "color": colour, "elinewidth": 1.2, "label": text}
                axes.errorbar(ratio[mine], place[mine], xerr=1.0, **style)
        axes.xaxis.set_major_formatter("{x:g}")
        width = max(1.5 * float(np.abs(ratio).max()), 12.0)
        axes.set_xlim(-width, width)
        axes.set_ylim(-0.7, len(shown) - 0.3)
        axes.set_yticks(place, [fit.parameters[i].name for i in shown])
        axes.set_xlabel("correction in standard errors")
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
        right = axes.secondary_yaxis("right")
        sizes = [
            f"{signed(1e3 * c, 3)} ± {1e3 * fit.std[i]:.3f} {'mrad' if a else 'mm'}"
            for c, i, a in zip(change.tolist(), shown, angle, strict=True)
        ]
        right.set_yticks(place, sizes)
        right.tick_params(length=0)
        right.spines["right"].set_visible(False)
        grid(axes, "both")
    return figure
