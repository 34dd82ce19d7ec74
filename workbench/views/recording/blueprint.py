"""Layout of the viewer: the scene on the left, numbers and tables on the right, the log below.

The timeline is `step`, paused.
"""

import numpy as np
import rerun.blueprint as rrb

from workbench.session.state import Session
from workbench.views.recording.canvas import ROW, STEP

GROUND = (246, 248, 251)
NO_LEGEND = rrb.PlotLegend(visible=False)
ERRORS = {f"{arm} {unit}": f"{arm}_{unit}" for arm in ("nominal", "calibrated") for unit in ("mm", "deg")}
ROW_ERRORS = {"nominal mm": "nominal_mm", "calibrated mm": "calibrated_mm"}
PLOTS = {
    "predicted": ("Predicted errors", {"position mm": "position_mm", "rotation deg": "rotation_deg"}),
    "index": ("Indices", {name: name for name in ("O", "O1", "O2", "O3", "O4", "O5")}),
    "error": ("Errors", ERRORS),
    "row_error": (f"By row: set the timeline to {ROW}", ROW_ERRORS),
}
"""Where numbers are, how their tab is called, and their headings."""


def blueprint(session: Session) -> rrb.Blueprint:
    plots = rrb.Tabs(*(_plots(origin, name, series) for origin, (name, series) in PLOTS.items()))
    above = rrb.Horizontal(_scene(session), rrb.Vertical(plots, _tables()), column_shares=[1, 1])
    log = rrb.TextLogView(
        origin="log", name="Steps", columns=rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
    )
    below = rrb.Tabs(log, _document("searches", "Searches"), _document("about", "About"))
    return rrb.Blueprint(
        rrb.Vertical(above, below, row_shares=[4, 1]),
        rrb.TimePanel(state="collapsed", timeline=STEP, play_state="following"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def _tables() -> rrb.Container:
    return rrb.Tabs(
        rrb.BarChartView(origin="target/index_O", name="Index O", plot_legend=NO_LEGEND),
        _document("parameters", "Parameters"),
        _document("diagnosis/words", "Diagnosis"),
        rrb.Spatial2DView(origin="diagnosis/ranking", name="Candidates"),
        rrb.Spatial2DView(origin="figure/before_after", name="Before and after"),
        rrb.Spatial2DView(origin="figure/corrections", name="Corrections"),
    )


def _plots(origin: str, name: str, series: dict[str, str]) -> rrb.Container:
    """Plots by their headings; every number has a scale of its own."""
    views = [
        rrb.TimeSeriesView(origin=f"{origin}/{path}", name=heading, plot_legend=NO_LEGEND)
        for heading, path in series.items()
    ]
    return rrb.Grid(*views, grid_columns=1 if len(views) < 3 else 2, name=name)


def _scene(session: Session) -> rrb.Spatial3DView:
    reach = session.robot.reach
    middle = 0.5 * (session.plate.region.min + session.plate.region.max)
    target = np.array([0.62 * middle[0], 0.62 * middle[1], 0.24 * reach])
    return rrb.Spatial3DView(
        origin="world",
        name=f"{session.robot.name} · {session.plate.name}",
        background=GROUND,
        line_grid=rrb.LineGrid3D(visible=True, spacing=0.1 if reach < 3.0 else 0.5, color=(186, 195, 208)),
        eye_controls=rrb.EyeControls3D(
            position=target + reach * np.array([0.85, -0.73, 0.56]), look_target=target
        ),
    )


def _document(path: str, name: str) -> rrb.TextDocumentView:
    return rrb.TextDocumentView(origin=path, name=name)
