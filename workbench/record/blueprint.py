"""How the viewer is laid out: the scene on the left, numbers and tables on the right, the log below.

The timeline is `step`, paused.
"""

import numpy as np
import rerun.blueprint as rrb

from workbench.record.canvas import STEP
from workbench.session.state import Session

GROUND = (246, 248, 251)


def blueprint(session: Session) -> rrb.Blueprint:
    """The layout for one session."""
    return _page(rrb.Horizontal(_left(session), _right(), column_shares=[3, 2]))


def side_by_side(first: Session, second: Session) -> rrb.Blueprint:
    """The layout for two sessions, whose entities lie below `A/` and `B/`, and the table of differences."""
    return _page(
        rrb.Vertical(
            rrb.Horizontal(_scene(first, "A/", "A"), _scene(second, "B/", "B")),
            rrb.Horizontal(_tables("A/"), _tables("B/"), _document("differences", "Differences")),
            rrb.Horizontal(_log("A/"), _log("B/")),
            row_shares=[4, 3, 2],
        )
    )


def _page(contents: rrb.Container) -> rrb.Blueprint:
    return rrb.Blueprint(
        contents,
        rrb.TimePanel(state="collapsed", timeline=STEP, play_state="following"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def _left(session: Session) -> rrb.Container:
    return rrb.Vertical(_scene(session), _log(), row_shares=[3, 1])


def _right(prefix: str = "") -> rrb.Container:
    return rrb.Vertical(
        rrb.Tabs(
            _plots(prefix, "predicted", "Predicted errors", ("position_mm", "rotation_deg")),
            _plots(prefix, "index", "Indices", ("O", "O1", "O2", "O3", "O4", "O5")),
            rrb.TimeSeriesView(origin=f"{prefix}error", name="Errors"),
            rrb.TimeSeriesView(origin=f"{prefix}row_error", name="By row"),
        ),
        _tables(prefix),
    )


def _tables(prefix: str = "") -> rrb.Container:
    return rrb.Tabs(
        rrb.BarChartView(origin=f"{prefix}target/index_O", name="Index O"),
        _document(f"{prefix}parameters", "Parameters"),
        rrb.Vertical(
            _document(f"{prefix}diagnosis/words", "Verdict"),
            rrb.Spatial2DView(origin=f"{prefix}diagnosis/ranking", name="Candidates"),
            name="Diagnosis",
        ),
        rrb.Spatial2DView(origin=f"{prefix}figure/before_after", name="Before and after"),
        rrb.Spatial2DView(origin=f"{prefix}figure/corrections", name="Corrections"),
        _document(f"{prefix}searches", "Searches"),
        _document(f"{prefix}about", "About"),
    )


def _plots(prefix: str, group: str, name: str, series: tuple[str, ...]) -> rrb.Container:
    views = [rrb.TimeSeriesView(origin=f"{prefix}{group}/{s}", name=s.replace("_", " ")) for s in series]
    return rrb.Grid(*views, grid_columns=1 if len(series) < 3 else 2, name=name)


def _scene(session: Session, prefix: str = "", name: str = "") -> rrb.Spatial3DView:
    reach = session.robot.reach
    middle = 0.5 * (session.plate.region.min + session.plate.region.max)
    target = np.array([0.62 * middle[0], 0.62 * middle[1], 0.24 * reach])
    return rrb.Spatial3DView(
        origin=f"{prefix}world",
        name=f"{name} {session.robot.name} · {session.plate.name}".strip(),
        background=GROUND,
        line_grid=rrb.LineGrid3D(visible=True, spacing=0.1 if reach < 3.0 else 0.5, color=(186, 195, 208)),
        eye_controls=rrb.EyeControls3D(
            position=target + reach * np.array([1.0, -0.86, 0.66]), look_target=target
        ),
    )


def _log(prefix: str = "") -> rrb.TextLogView:
    return rrb.TextLogView(
        origin=f"{prefix}log",
        name=f"{prefix.strip('/')} What was done".strip(),
        columns=rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"]),
    )


def _document(path: str, name: str) -> rrb.TextDocumentView:
    return rrb.TextDocumentView(origin=path, name=name)
