"""Layout of the viewer: the scene on the left, numbers and tables on the right, the log below.

The timeline is `step`, paused. In front is what was done last; robot, plate or stage changed: a new layout.
"""

from typing import Any

import rerun.blueprint as rrb

from workbench.session.state import Focus, Session
from workbench.views.drawables.viewpoint import first_view, title, view_of_rows
from workbench.views.recording.canvas import PATHS, STEP

GROUND = (246, 248, 251)
NEARER = 0.62
"""Distance of the eye, as a share of a page's, whose picture is wider."""
NO_LEGEND = rrb.PlotLegend(visible=False)
POSITION, ROTATION = "position [mm]", "rotation [°]"
EACH = f"{POSITION}: grey nominal, blue geometry, orange with what was added"
PLOTS: dict[str, tuple[str, dict[str, tuple[str, ...]]]] = {
    "predicted": ("Predicted errors", {POSITION: ("position_mm",), ROTATION: ("rotation_deg",)}),
    "index": ("Observability", {"O": ("O",)}),
    "error": (
        "Errors",
        {EACH: tuple(f"{p}_mm" for p in PATHS.values()), ROTATION: tuple(f"{p}_deg" for p in PATHS.values())},
    ),
}
"""Where numbers are, how their tab is called, and what each of its plots has, by its heading."""


def subject(session: Session) -> tuple[Any, ...]:
    """What the layout is about: one for all sessions that it suits."""
    return session.robot, session.history.first.plate, title(session), *_in_front(session)


def _in_front(session: Session) -> tuple[int, int, bool]:
    """Which plots and which table, by their place, show what was done last; whether errors have angles."""
    results, found = session.results, session.results.identification
    has_angles = found is None or found.nominal.judged.orientation_deg is not None
    if found is None or (session.playback.focus is Focus.TARGET and session.shows_plate):
        return 0, 0, has_angles
    is_diagnosed = results.diagnosis is not None and not results.accepted
    return 2, 2 if is_diagnosed else 3, has_angles


def blueprint(session: Session) -> rrb.Blueprint:
    plot, table, has_angles = _in_front(session)
    views = [_plots(origin, has_angles=has_angles or origin != "error") for origin in PLOTS]
    beside = rrb.Vertical(rrb.Tabs(*views, active_tab=plot), rrb.Tabs(*_tables(), active_tab=table))
    above = rrb.Horizontal(_scene(session), beside, column_shares=[1, 1])
    log = rrb.TextLogView(
        origin="log", name="Steps", columns=rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
    )
    below = rrb.Tabs(log, _document("about", "About"))
    return rrb.Blueprint(
        rrb.Vertical(above, below, row_shares=[4, 1]),
        rrb.TimePanel(state="collapsed", timeline=STEP, play_state="following"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def _tables() -> tuple[rrb.View, ...]:
    return (
        rrb.BarChartView(origin="target/index_O", name="Observability O", plot_legend=NO_LEGEND),
        _document("parameters", "Parameters"),
        _document("diagnosis/words", "Diagnosis"),
        rrb.BarChartView(origin="before_after", name="Errors, largest first"),
    )


def _plots(origin: str, *, has_angles: bool) -> rrb.Container:
    """Plots by their headings; what has the same unit and meaning has one scale."""
    name, plots = PLOTS[origin]
    views = [
        rrb.TimeSeriesView(
            origin=origin,
            contents=[f"$origin/{path}" for path in paths],
            name=heading,
            plot_legend=NO_LEGEND,
            visible=has_angles or heading != ROTATION,
        )
        for heading, paths in plots.items()
    ]
    return rrb.Grid(*views, grid_columns=1, name=name)


def _scene(session: Session) -> rrb.Spatial3DView:
    rows = session.results.comparison  # steps of one layout have one view: the arm at all rows is in it
    position, target = first_view(session) if rows is None else view_of_rows(session.robot, rows)
    return rrb.Spatial3DView(
        origin="world",
        name=title(session),
        background=GROUND,
        line_grid=rrb.LineGrid3D(
            visible=True, spacing=0.1 if session.robot.reach < 3.0 else 0.5, color=(186, 195, 208)
        ),
        eye_controls=rrb.EyeControls3D(position=target + NEARER * (position - target), look_target=target),
    )


def _document(path: str, name: str) -> rrb.TextDocumentView:
    return rrb.TextDocumentView(origin=path, name=name)
