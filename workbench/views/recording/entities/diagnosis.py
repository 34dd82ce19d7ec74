"""`diagnosis`: what the model lacked, as the diagnosis tells it."""

import rerun as rr

from workbench.diagnosis.report.ranking import ranking
from workbench.report.drawing import png
from workbench.views.recording.canvas import Canvas
from workbench.views.recording.diagnosed import diagnosis_markdown
from workbench.views.recording.entities.entity import AbstractEntity, Moment


class Diagnosed(AbstractEntity):
    """The last diagnosis of the session.

    `diagnosis/words`: verdict, errors, accepted effects. `diagnosis/ranking`: what each candidate brings.
    """

    def __init__(self) -> None:
        self._drawn: object = None

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        found = moment.session.diagnosis
        if found is self._drawn:
            return
        self._drawn = found
        canvas.clear("diagnosis")
        if found is None:
            return
        text = rr.TextDocument(diagnosis_markdown(found), media_type=rr.MediaType.MARKDOWN)
        canvas.log("diagnosis/words", text)
        figure = ranking(found)
        if figure is not None:
            image = rr.EncodedImage(contents=png(figure), media_type="image/png")
            canvas.log("diagnosis/ranking", image)
