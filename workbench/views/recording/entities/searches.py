"""`searches`: what each search of a whole plate came to, one row each."""

from collections.abc import Iterator

import numpy as np
import rerun as rr

from workbench.report.numbers import short
from workbench.session.commands.plate import ClusterTargets, ImprovePlate
from workbench.session.journal.entry import Ending
from workbench.session.state import Score, Session
from workbench.views.recording.canvas import Canvas
from workbench.views.recording.entities.entity import AbstractEntity, Moment

HEAD = (
    "| step | search | targets reached | index O of a target | predicted error [mm] |",
    "|---:|---|---|---|---|",
)


class Searches(AbstractEntity):
    """The table of searches, each against the plate before it; equal O is what a search of poses is after."""

    def __init__(self) -> None:
        self._before: Session | None = None
        self._rows: list[str] = []

    def draw(self, canvas: Canvas, moment: Moment) -> None:
        entry, before, self._before = moment.entry, self._before, moment.session
        if entry is None or before is None or entry.ending is not Ending.DONE:
            return
        if isinstance(entry.command, ClusterTargets | ImprovePlate):
            now = moment.session.score
            cells = [f"{moment.step}", entry.command.title, *_changes(before.score, now)]
            self._rows.append(f"| {' | '.join(cells)} |")
            text = "\n".join([*HEAD, *self._rows])
            canvas.log("searches", rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN))


def _changes(before: Score, now: Score) -> Iterator[str]:
    for words in (_reached, _spread, _error):
        yield f"{words(before)} → {words(now)}"


def _reached(score: Score) -> str:
    return f"{score.reached} of {len(score.per_target)}"


def _spread(score: Score) -> str:
    seen = score.per_target[np.isfinite(score.per_target)]
    return f"{seen.min():.4f} … {seen.max():.4f}" if len(seen) else "–"


def _error(score: Score) -> str:
    return short(1e3 * score.position)
