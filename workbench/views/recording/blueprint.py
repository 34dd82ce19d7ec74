"""Layout of the viewer: the scene on the left, curves, bars and the result on the right, the log below.

The viewer has one layout for all steps, so what differs between them is drawn instead: the eye is a camera
that moves in the scene, the title a text, and bars and result are those of the step.
"""

import rerun as rr
import rerun.blueprint as rrb

from workbench.views.recording.canvas import EYE, PATHS, STEP

GROUND = (246, 248, 251)
NO_LEGEND = rrb.PlotLegend(visible=False)
EACH = "grey nominal, blue geometry, orange with what was added"
PLOTS: dict[str, dict[str, tuple[str, tuple[str, ...]]]] = {
    "Position": {
        "predicted error [mm]": ("predicted", ("position_mm",)),
        f"error [mm]: {EACH}": ("error", tuple(f"{path}_mm" for path in PATHS.values())),
    },
    "Observability": {"O": ("index", ("O",))},
    "Orientation": {
        "predicted error [°]": ("predicted", ("rotation_deg",)),
        f"error [°]: {EACH}": ("error", tuple(f"{path}_deg" for path in PATHS.values())),
    },
}
"""Tabs of curves: by its heading, where each one's numbers are."""


def blueprint(steps: int | None = None) -> rrb.Blueprint:
    """The layout; once it is known how many steps there are, their curves have room for the last points."""
    bars = rrb.BarChartView(origin="bars", name="Targets by O, or rows by error [mm]", plot_legend=NO_LEGEND)
    at, axis = rr.TimeRangeBoundary.absolute, None
    if steps is not None:
        room = 1 + steps // 50
        axis = rrb.TimeAxis(view_range=rr.TimeRange(start=at(seq=-room), end=at(seq=steps + room)))
    plots = (
        rrb.Grid(*(_plot(each, where, axis) for each, where in of.items()), grid_columns=1, name=tab)
        for tab, of in PLOTS.items()
    )
    result = rrb.TextDocumentView(origin="result", name="Result")
    beside = rrb.Vertical(rrb.Tabs(*plots), bars, result, row_shares=[3, 2, 3])
    scene = rrb.Spatial3DView(
        origin="world",
        name="Scene",
        background=GROUND,
        line_grid=rrb.LineGrid3D(visible=True, spacing=0.25, color=(186, 195, 208)),
        eye_controls=rrb.EyeControls3D(tracking_entity=EYE),
    )
    left = rrb.Vertical(rrb.TextDocumentView(origin="title", name="Session"), scene, row_shares=[1, 5])
    log = rrb.TextLogView(
        origin="log", name="Steps", columns=rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
    )
    below = rrb.Tabs(log, rrb.TextDocumentView(origin="about", name="About"))
    return rrb.Blueprint(
        rrb.Vertical(rrb.Horizontal(left, beside, column_shares=[5, 4]), below, row_shares=[5, 1]),
        rrb.TimePanel(state="collapsed", timeline=STEP, play_state="following"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def _plot(heading: str, where: tuple[str, tuple[str, ...]], axis: rrb.TimeAxis | None) -> rrb.TimeSeriesView:
    """What has the same unit and meaning has one scale."""
    origin, paths = where
    contents = [f"$origin/{path}" for path in paths]
    return rrb.TimeSeriesView(
        origin=origin, contents=contents, name=heading, plot_legend=NO_LEGEND, axis_x=axis
    )
