"""Of the places of a drag the journal keeps the last, which alone leads to the same session."""

import numpy as np

from workbench.session.command import AbstractTask
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget
from workbench.session.journal import Ending, Entry, replay
from workbench.session.page_state import Severity

RPY = (-2.6, 0.0, 0.0)


def path(first, count=25, target=2):
    """Places along a way on which the arm changes its branch and can't reach for a while."""
    start = first.plate.targets[target].xyz
    for angle in np.linspace(0.0, 2.0 * np.pi, count):
        place = start + np.array([np.cos(angle) - 1.0, np.sin(angle), 0.2])
        yield MoveTarget(target, tuple(place.tolist()), RPY, client=1)


def test_a_drag_is_three_entries_that_lead_to_the_same(first, worker, do):
    live = do(GrabTarget(2, 1), *path(first), DropTarget(1))
    assert [type(e.command) for e in worker.journal] == [GrabTarget, MoveTarget, DropTarget]
    again = replay(first, worker.journal)
    assert [(s.q.tolist(), s.branch) for s in again.states] == [(s.q.tolist(), s.branch) for s in live.states]
    assert again.score.indices == live.score.indices
    *_, last = path(first)
    alone = replay(first, [Entry(c, Ending.DONE, 0, 0.0, 0.0) for c in (GrabTarget(2, 1), last)])
    assert alone.states[2].q.tolist() != live.states[2].q.tolist()  # the way matters


class Noted(AbstractTask):
    """Says where a target stood when it began."""

    title = "Noted"

    def compute(self, session):
        return session.plate.targets[2].xyz

    def finish(self, session, result):
        return session.with_message(Severity.INFO, f"{result.tolist()}")


def test_what_a_task_began_from_is_kept(first, worker, do):
    places = list(path(first))
    live = do(GrabTarget(2, 1), *places[:3], Noted(), *places[3:6], DropTarget(1))
    kinds = [GrabTarget, MoveTarget, MoveTarget, DropTarget, Noted]  # its end waited for that of the drag
    assert [type(e.command) for e in worker.journal] == kinds
    assert [m.text for m in replay(first, worker.journal).page.messages] == [f"{list(places[2].xyz)}"]
    assert live.plate.targets[2].xyz.tolist() == list(places[5].xyz)
