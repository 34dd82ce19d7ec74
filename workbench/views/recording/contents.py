"""Drawing moments one after the other: the scene, and words, tables and pictures beside it."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import rerun as rr

from workbench.base.types import Vector3
from workbench.diagnosis.report.document import diagnosis_blocks
from workbench.diagnosis.result import Diagnosis
from workbench.identification.report.document import models, parameter_blocks, remarks
from workbench.identification.result import Identification
from workbench.parts import warn_of_broken
from workbench.report.result_display import as_markdown
from workbench.session.stages import stages
from workbench.session.state import Focus, Session
from workbench.session.view import Moment
from workbench.views.appearance.colours import SELECTED, STAGE_COLOURS
from workbench.views.drawables.scene_contents import items
from workbench.views.drawables.sink import Item
from workbench.views.drawables.viewpoint import first_view, occasion
from workbench.views.recording.blueprint import blueprint
from workbench.views.recording.canvas import EYE, PATHS, Canvas
from workbench.views.recording.rerun_sink import RecordingSink, markdown
from workbench.views.recording.sentences import about, headline
from workbench.views.recording.timelines import Log, Series

FIELD = 0.66
"""Height of the picture [rad]."""


class MomentDrawing:
    """Draws moments onto a canvas; what can't be drawn is left out, and the rest goes on."""

    def __init__(self, canvas: Canvas):
        self._canvas = canvas
        self._scene, self._sheets = RecordingSink(canvas, "world/"), RecordingSink(canvas)
        self._timelines = Log(), Series()
        canvas.arrange(blueprint())
        canvas.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        lens = rr.Pinhole(fov_y=FIELD, aspect_ratio=1.0, camera_xyz=rr.ViewCoordinates.RUB, line_width=0.0)
        canvas.log(EYE, lens, static=True)

    def draw(self, moment: Moment) -> None:
        session = moment.session
        self._canvas.at(moment.step, moment.at)
        self._try("scene", self._scene.draw, items(session, on_page=False))
        self._try("sheets", self._sheets.draw, sheets(session))
        for timeline in self._timelines:
            self._try(type(timeline).__name__, timeline.draw, self._canvas, moment)

    def end(self, step: int) -> None:
        """Lay out the viewer for all steps up to the last one."""
        self._canvas.arrange(blueprint(step))

    def _try(self, name: str, draw: Callable[..., None], *args: Any) -> None:
        try:
            draw(*args)
        except Exception as error:
            warn_of_broken(name, error)


def sheets(session: Session) -> Iterator[Item]:
    """Title, legend, result and bars (O as ARIA eq. 17) beside the scene, and the eye that looks at it."""
    results = session.results
    yield Item("title", markdown, (headline(session),))
    yield Item("about", markdown, (about(session),))
    yield Item(EYE, lambda *_: _camera(*first_view(session)), occasion(session))
    yield Item("result", _result, (results.diagnosis, results.identification, results.fit, results.accepted))
    if not (known := stages(session)) or (session.shows_plate and session.playback.focus is Focus.TARGET):
        yield Item("bars/O", _bars, (np.nan_to_num(session.score.per_target), SELECTED))
        return
    for k, stage in enumerate(known):
        rows = stage.errors.position
        if len(errors := 1e3 * rows[np.isfinite(rows)]):
            largest_first = np.quantile(errors, np.linspace(1.0, 0.0, 25))  # more bars are none to the eye
            drawn = largest_first, STAGE_COLOURS[stage.title], 0.3 * k, 0.3  # over others they turn white
            yield Item(f"bars/{PATHS[stage.title]}_mm", _bars, drawn)


def _camera(position: Vector3, target: Vector3) -> rr.Transform3D:
    """It looks at the target, with the z axis upright."""
    forward = target - position
    right = np.cross(forward, [0.0, 0.0, 1.0])
    axes = np.stack([right, np.cross(right, forward), -forward], axis=1)
    return rr.Transform3D(translation=position, mat3x3=axes / np.linalg.norm(axes, axis=0))


def _result(
    diagnosis: Diagnosis | None, found: Identification | None, fit: str, accepted: tuple[Any, ...]
) -> rr.TextDocument:
    """The diagnosis until what it found is added, else the shown fit."""
    if diagnosis is not None and not accepted:
        return markdown(as_markdown(diagnosis_blocks(diagnosis)))
    if found is None:
        return markdown("Nothing has been identified yet.")
    parts = (*models(found), *parameter_blocks(found.runs[fit].fit), *remarks(found))
    return markdown(as_markdown(parts))


def _bars(values: np.ndarray, colour: Any, aside: float = 0.0, width: float = 1.0) -> rr.BarChart:
    """A bar for each value, counted from 1, and so far aside."""
    places = np.arange(1, len(values) + 1) - 0.5 + aside
    return rr.BarChart(values, abscissa=places, color=colour, widths=np.full(len(values), width))
