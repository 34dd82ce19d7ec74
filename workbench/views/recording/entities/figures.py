"""`figure/before_after` and `figure/corrections`: pictures of an identification, as in its report."""

import rerun as rr

from workbench.identification.error_columns import order_of_measuring
from workbench.identification.report.corrections import corrections
from workbench.identification.report.error_plots import before_after
from workbench.report.drawing import png
from workbench.views.recording.canvas import Canvas
from workbench.views.recording.entities.entity import AbstractEntity, Moment


class Figures(AbstractEntity):
    """Drawn once for every identification."""

    def __init__(self) -> None:
        self._drawn: object = None

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        found = moment.session.identification
        if found is self._drawn:
            return
        self._drawn = found
        canvas.clear("figure")
        if found is None:
            return
        figures = {
            "before_after": before_after(found, order_of_measuring(found)),
            "corrections": corrections(found.best),
        }
        for name, figure in figures.items():
            if figure is not None:
                image = rr.EncodedImage(contents=png(figure), media_type="image/png")
                canvas.log(f"figure/{name}", image)
