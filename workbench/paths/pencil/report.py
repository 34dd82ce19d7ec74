"""A drawn path for people and for machines: the schema `workbench.plotted/1`, a table and a picture."""

import numpy as np
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table, box
from rich.text import Text

from workbench.identification.errors import Spread
from workbench.paths.pencil.reading import PlottedErrors, PlottedProfile
from workbench.report.drawing import (
    COLOURS,
    INK,
    grid,
    look,
    new_figure,
    png,
)
from workbench.report.json import Json, plain
from workbench.report.numbers import short

PLOTTED = "workbench.plotted/1"


def plotted_json(profile: PlottedProfile, errors: PlottedErrors | None, time: np.ndarray | None) -> Json:
    """The reading as plain data; null where nothing was drawn."""
    return plain(
        {
            "schema": PLOTTED,
            "dot_mm": 1e3 * profile.scale,
            "oval": profile.oval,
            "angle_deg": np.rad2deg(profile.angle),
            "out_mm": 1e3 * profile.out,
            "time": time,
            "errors_mm": None if errors is None else 1e3 * errors.vector,
        }
    )


def plotted_table(profile: PlottedProfile, errors: PlottedErrors | None) -> RenderableType:
    """Mean, rms and greatest of what was read."""
    table = Table(box=box.SIMPLE_HEAD, title_justify="left")
    for heading in ("from the path", "mean [mm]", "rms [mm]", "max [mm]"):
        table.add_column(escape(heading), justify="left" if heading.startswith("f") else "right")
    rows = [("drawn line, outside", profile.out)]
    if errors is not None:
        rows += [("tool, outside", errors.out), ("tool, above", errors.above), ("tool", errors.distance)]
    for words, values in rows:
        spread = Spread.of(1e3 * np.abs(values[np.isfinite(values)]))
        table.add_row(words, *(short(v) for v in (spread.mean, spread.rms, spread.max)))
    missing = f"{100 * (1.0 - profile.drawn.mean()):.0f} % of the circle was not drawn"
    return Group(table, Text(f"one dot is {1e3 * profile.scale:.4f} mm; {missing}"))


def plotted_picture(profile: PlottedProfile, errors: PlottedErrors | None, time: np.ndarray | None) -> bytes:
    """The line around the circle, and errors over time, as a PNG file."""
    with look():
        figure = new_figure(9.0 if errors is not None else 5.0, 3.2)
        panels = figure.subplots(1, 1 if errors is None else 2, squeeze=False)[0]
        panels[0].plot(np.rad2deg(profile.angle), 1e3 * profile.out, color=COLOURS[0])
        panels[0].axhline(0.0, color=INK, lw=0.6)
        panels[0].set_xticks(range(0, 361, 90))
        panels[0].set_xlabel("angle from the mark of the beginning, counter-clockwise [°]")
        panels[0].set_ylabel("drawn outside the circle [mm]")
        if errors is not None and time is not None:
            for words, values, colour in zip(
                ("outside", "above"), (errors.out, errors.above), COLOURS, strict=False
            ):
                panels[1].plot(time, 1e3 * values, color=colour, label=words)
            panels[1].axhline(0.0, color=INK, lw=0.6)
            panels[1].set_xlabel("time [s]")
            panels[1].set_ylabel("error of the tool [mm]")
            panels[1].legend()
        for axes in panels:
            grid(axes)
    return png(figure)
