"""`log`, `about` and `parameters`: what was done in plain words, and tables as text."""

import rerun as rr

from workbench.session.journal.entry import Ending
from workbench.views.recording.canvas import Canvas
from workbench.views.recording.entities.entity import AbstractEntity, Moment
from workbench.views.recording.narrative import about, parameters_markdown, sentence

LEVELS = {Ending.DONE: "INFO", Ending.CANCELLED: "INFO", Ending.REFUSED: "WARN", Ending.FAILED: "ERROR"}


class Log(AbstractEntity):
    """`log`: one line a decision; the many places of a drag are left out."""

    def __init__(self) -> None:
        self._told = 0

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        if moment.entry is None:
            self._told = moment.session.message_count
            words = "The session begins" if moment.step == 0 else "The session goes on"
            canvas.log("log", rr.TextLog(words, level="INFO"))
            return
        says = [m.text for m in moment.session.messages if m.number > self._told]
        self._told = moment.session.message_count
        if moment.is_passing and not says and moment.entry.ending is Ending.DONE:
            return
        text = sentence(moment.entry, moment.session, says)
        canvas.log("log", rr.TextLog(text, level=LEVELS[moment.entry.ending]))


class About(AbstractEntity):
    """`about`: robot, plate, measurements and how to read the views."""

    def __init__(self) -> None:
        self._drawn = ""

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        text = about(moment.session)
        if text != self._drawn:
            self._drawn = text
            canvas.log("about", rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN))


class Parameters(AbstractEntity):
    """`parameters`: nominal, identified, standard error of every constant of the shown fit."""

    def __init__(self) -> None:
        self._drawn: tuple = ()

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        session = moment.session
        if self._drawn and self._drawn == (session.identification, session.fit):
            return
        self._drawn = (session.identification, session.fit)
        text = parameters_markdown(session)
        canvas.log("parameters", rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN))
