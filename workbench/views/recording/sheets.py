"""What a recording shows beside the scene: words, tables and pictures of a session."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from workbench.diagnosis.report.ranking import ranking
from workbench.identification.error_columns import order_of_measuring
from workbench.identification.report.corrections import corrections
from workbench.identification.report.error_plots import before_after
from workbench.report.figures import png
from workbench.session.state import Session
from workbench.views.appearance.colours import SELECTED
from workbench.views.drawables.item import Item
from workbench.views.recording.rerun_sink import Bars, Document, Picture
from workbench.views.recording.sentences import about, diagnosis_markdown, parameters_markdown


def sheets(session: Session) -> Iterator[Item]:
    """The last identification and diagnosis, and index O of each target alone (ARIA eq. 17)."""
    yield from tables(session)
    yield Item("target/index_O", Bars, (np.nan_to_num(session.score.per_target), SELECTED))
    if session.identification is not None:
        found = (session.identification,)
        yield _picture("figure/before_after", lambda f: before_after(f, order_of_measuring(f)), found)
        yield _picture("figure/corrections", lambda f: corrections(f.best), found)
    if session.diagnosis is not None:
        yield Item("diagnosis/words", lambda d: Document(diagnosis_markdown(d)), (session.diagnosis,))
        yield _picture("diagnosis/ranking", ranking, (session.diagnosis,))


def tables(session: Session) -> Iterator[Item]:
    """How to read the recording, and the parameters of the shown fit."""
    yield Item("about", Document, (about(session),))
    inputs = session.identification, session.fit
    yield Item("parameters", lambda found, fit: Document(parameters_markdown(found, fit)), inputs)


def _picture(path: str, plot: Callable[[Any], Any], inputs: tuple[Any, ...]) -> Item:
    def make(found: Any) -> Picture | None:
        figure = plot(found)
        return None if figure is None else Picture(png(figure))

    return Item(path, make, inputs)
