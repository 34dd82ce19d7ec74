"""Drawing moments one after the other: the scene, and words, tables and pictures beside it."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import rerun as rr

from workbench.identification.report.document import models, remarks
from workbench.identification.report.parameters import parameter_blocks
from workbench.identification.result import Identification
from workbench.parts import warn_of_broken
from workbench.report.result_display import as_markdown
from workbench.session.stages import stages
from workbench.session.state import Session
from workbench.views.appearance.colours import SELECTED, STAGE_COLOURS
from workbench.views.drawables.scene_contents import in_recordings
from workbench.views.drawables.sink import Item, is_same
from workbench.views.recording.blueprint import blueprint, subject
from workbench.views.recording.canvas import PATHS, Canvas
from workbench.views.recording.recorded_step import Moment
from workbench.views.recording.rerun_sink import RecordingSink, markdown
from workbench.views.recording.sentences import about
from workbench.views.recording.timelines import TIMELINES


class MomentDrawing:
    """Draws moments onto a canvas; what can't be drawn is left out, and the rest goes on."""

    def __init__(self, canvas: Canvas):
        self._canvas = canvas
        self._scene, self._sheets = RecordingSink(canvas, "world/"), RecordingSink(canvas)
        self._timelines = tuple(kind() for kind in TIMELINES)
        self._subject: tuple[Any, ...] = ()
        canvas.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)

    def draw(self, moment: Moment) -> None:
        session = moment.session
        about = subject(session)
        if len(self._subject) != len(about) or not all(map(is_same, about, self._subject)):
            self._try("layout", lambda: self._canvas.arrange(blueprint(session)))
            self._subject = about
        self._canvas.at(moment.step, moment.at)
        self._try("scene", self._scene.draw, in_recordings(session))
        self._try("sheets", self._sheets.draw, sheets(session))
        for timeline in self._timelines:
            self._try(type(timeline).__name__, timeline.draw, self._canvas, moment)

    def _try(self, name: str, draw: Callable[..., None], *args: Any) -> None:
        try:
            draw(*args)
        except Exception as error:
            warn_of_broken(name, error)


def sheets(session: Session) -> Iterator[Item]:
    """How to read the recording, index O of each target alone (ARIA eq. 17), the shown fit, the diagnosis."""
    yield Item("about", markdown, (about(session),))
    yield Item("parameters", _fitted, (session.results.identification, session.results.fit))
    yield Item("target/index_O", _bars, (np.nan_to_num(session.score.per_target), SELECTED))
    for k, stage in enumerate(stages(session)):
        if len(known := 1e3 * stage.rows[np.isfinite(stage.rows)]):
            largest_first = np.quantile(known, np.linspace(1.0, 0.0, 25))  # more bars are none to the eye
            drawn = largest_first, STAGE_COLOURS[stage.title], 0.3 * k, 0.3  # over others they turn white
            yield Item(f"before_after/{PATHS[stage.title]}_mm", _bars, drawn)
    if (diagnosis := session.results.diagnosis) is not None:
        yield Item("diagnosis/words", lambda d: markdown(as_markdown(d.blocks())), (diagnosis,))


def _fitted(found: Identification | None, fit: str) -> rr.TextDocument:
    if found is None:
        return markdown("Nothing has been identified yet.")
    parts = (*models(found), *parameter_blocks(found.runs[fit].fit), *remarks(found))
    return markdown(as_markdown(parts))


def _bars(values: np.ndarray, colour: Any, aside: float = 0.0, width: float = 1.0) -> rr.BarChart:
    """A bar for each value, counted from 1, and so far aside."""
    places = np.arange(1, len(values) + 1) - 0.5 + aside
    return rr.BarChart(values, abscissa=places, color=colour, widths=np.full(len(values), width))
