"""Of the places of a drag the journal keeps the last, which alone leads to the same session."""

from dataclasses import dataclass

import numpy as np
import pytest

from workbench.session import Worker
from workbench.session.command import AbstractTask
from workbench.session.commands import (
    DropTarget,
    GrabTarget,
    MoveTarget,
    SelectTarget,
    Undo,
)
from workbench.session.journal import Ending, Entry, replay
from workbench.session.state import Severity
from workbench.session.thinning import in_one

RPY = (-2.6, 0.0, 0.0)


def way(first, count=25, target=2):
    """Places along a way on which the arm changes its branch and can't reach for a while."""
    start = first.plate.targets[target].xyz
    for angle in np.linspace(0.0, 2.0 * np.pi, count):
        place = start + np.array([np.cos(angle) - 1.0, np.sin(angle), 0.2])
        yield MoveTarget(target, tuple(place.tolist()), RPY, client=1)


def test_a_drag_is_three_entries_that_lead_to_the_same(first, worker, do):
    live = do(GrabTarget(2, 1), *way(first), DropTarget(1))
    assert [type(e.command) for e in worker.journal] == [GrabTarget, MoveTarget, DropTarget]
    again = replay(first, worker.journal)
    assert [s.q.tolist() for s in again.states] == [s.q.tolist() for s in live.states]
    assert [s.branch for s in again.states] == [s.branch for s in live.states]
    assert again.score.indices == live.score.indices
    *_, last = way(first)
    alone = replay(first, [Entry(c, Ending.DONE, 0, 0.0, 0.0) for c in (GrabTarget(2, 1), last)])
    assert alone.states[2].q.tolist() != live.states[2].q.tolist()  # the way matters


@dataclass(frozen=True)
class Noted(AbstractTask):
    """Says where a target stood when it began."""

    title = "Noted"
    key = None

    def check(self, session):
        pass

    def compute(self, session, *, progress, cancel):
        return session.plate.targets[2].xyz

    def finish(self, session, result):
        return session.tell(Severity.INFO, f"{result.tolist()}")


def test_what_a_task_began_from_is_kept(first, worker, do):
    places = list(way(first))
    live = do(GrabTarget(2, 1), *places[:3], Noted(), *places[3:6], DropTarget(1))
    kinds = [type(e.command) for e in worker.journal]
    assert kinds == [GrabTarget, MoveTarget, Noted, MoveTarget, DropTarget]
    said = [m.text for m in replay(first, worker.journal).messages]
    assert said == [f"{list(places[2].xyz)}"]
    assert live.plate.targets[2].xyz.tolist() == list(places[5].xyz)


def test_what_was_read_from_a_recording_is_kept(first):
    place, *_ = way(first)
    before = [Entry(c, Ending.DONE, 0, 0.0, 0.0) for c in (GrabTarget(2, 1), place)]
    worker = Worker(replay(first, before), journal=before)
    for command in (GrabTarget(2, 1), place, place):
        worker.submit(command)
        worker.wait()
    worker.close()
    kinds = [type(e.command) for e in worker.journal]
    assert kinds == [GrabTarget, MoveTarget, DropTarget, GrabTarget, MoveTarget]


@pytest.mark.parametrize("ending", [Ending.REFUSED, Ending.FAILED])
def test_only_places_of_the_same_hand_in_one_drag_are_thinned(first, ending):
    place = next(iter(way(first)))
    held = GrabTarget(2, 1).apply(first)
    assert in_one(Entry(place, Ending.DONE, 0, 0.0, 0.0), place, held).start is not None
    assert in_one(Entry(place, ending, 0, 0.0, 0.0), place, held) is None
    assert in_one(Entry(place, Ending.DONE, 0, 0.0, 0.0), place, first) is None
    assert in_one(Entry(SelectTarget(2), Ending.DONE, 0, 0.0, 0.0), place, held) is None
    assert in_one(Entry(place, Ending.DONE, 0, 0.0, 0.0), Undo(), held) is None
    other = MoveTarget(2, place.xyz, RPY, client=3)
    assert in_one(Entry(other, Ending.DONE, 0, 0.0, 0.0), place, held) is None
    assert in_one(Entry(place, Ending.DONE, 0, 0.0, 0.0), other, held) is None
