"""`diagnosis` and `error/diagnosed_…`: what the model lacked, as the diagnosis tells it."""

import math

import rerun as rr

from workbench.appearance.colours import ARROW_AFTER, ARROW_BEFORE
from workbench.diagnose.record import judged
from workbench.record.canvas import Canvas
from workbench.record.diagnosed import diagnosis_markdown
from workbench.record.entities.entity import AbstractEntity, Moment
from workbench.report.diagnosis.ranking import ranking
from workbench.report.drawing import png

LINES = {"geometry": ARROW_BEFORE, "effects": ARROW_AFTER}


class Diagnosed(AbstractEntity):
    """The last diagnosis of the session.

    `diagnosis/words`: verdict, errors, accepted effects. `diagnosis/ranking`: what each candidate brings.
    `error/diagnosed_geometry_mm` and `error/diagnosed_effects_mm`: mean errors on held-out rows, or on the
    fitted ones where none were, of the geometry alone and with the accepted effects.
    """

    def __init__(self) -> None:
        self._drawn: object = None

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        """Draw a new diagnosis; take an old one away when its measurements go."""
        found = moment.session.diagnosis
        if found is self._drawn:
            return
        self._drawn = found
        canvas.clear("diagnosis")
        if found is None:
            _show_errors(canvas, dict.fromkeys(LINES, math.nan))
            return
        text = rr.TextDocument(diagnosis_markdown(found), media_type=rr.MediaType.MARKDOWN)
        canvas.log("diagnosis/words", text)
        figure = ranking(found)
        if figure is not None:
            image = rr.EncodedImage(contents=png(figure), media_type="image/png")
            canvas.log("diagnosis/ranking", image)
        fits = {"geometry": found.before, "effects": found.after}
        _show_errors(canvas, {name: judged(fit).position_mm.mean for name, fit in fits.items()})


def _show_errors(canvas: Canvas, errors: dict[str, float]) -> None:
    step = rr.components.InterpolationMode.StepAfter
    for name, value in errors.items():
        path, words = f"error/diagnosed_{name}_mm", f"diagnosed: {name} mm"
        line = rr.SeriesLines(names=words, colors=LINES[name], interpolation_mode=step)
        canvas.log(path, line, static=True)
        canvas.log(path, rr.Scalars(value))
