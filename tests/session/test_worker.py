"""The worker: order, newest drag wins, long work beside it, errors as messages."""

import logging
import threading
from collections.abc import Hashable
from dataclasses import replace

import pytest
from refusals import mentions

from workbench.base.progress import cancelled, check_cancelled, progress, suspected
from workbench.session import AbstractChange, AbstractTask, replay
from workbench.session.commands.drag import MoveTarget, SelectTarget
from workbench.session.journal import Ending
from workbench.session.page_state import Severity

RPY = (-2.6, 0.0, 0.0)


class Broken(AbstractChange):
    """A command with a bug."""

    title: str = "Broken"
    key: Hashable | None = None

    def apply(self, session):
        raise ZeroDivisionError("oh")


class Slow(AbstractTask):
    """Waits until told to go on, or cancelled."""

    go: threading.Event
    title: str = "Slow work"
    key: Hashable | None = None
    fails: bool = False

    def compute(self, session):
        progress(0.5, "half way")
        self.go.wait(0.2)
        progress(0.3, "begun again")
        suspected({"sag": 3.0})
        suspected({"play": 5.0, "sag": 4.0})
        while not self.go.wait(0.01):
            check_cancelled()
        if self.fails:
            raise ValueError("no")
        return session.selected

    def finish(self, session, result):
        return session.with_message(Severity.INFO, f"selected {result} then, {session.selected} now")


def test_a_bug_is_a_message_and_the_session_stands(worker, do, first, caplog):
    with caplog.at_level(logging.ERROR):
        session = do(Broken(), SelectTarget(3))
    assert session.selected == 3
    assert session.plate is first.plate
    assert "unchanged" in session.page.messages[-1].text
    assert [e.ending for e in worker.journal] == [Ending.FAILED, Ending.DONE]
    assert mentions(caplog.text, "Broken")
    go = threading.Event()
    go.set()
    session = do(Slow(go, fails=True))
    assert session.page.job is None
    assert session.page.messages[-1].severity is Severity.ERROR


def test_what_long_work_suspects_is_known_while_it_goes_on(worker):
    go = threading.Event()
    worker.submit(Slow(go))
    for _ in range(500):
        if (job := worker.session.page.job) is not None and len(job.suspects) == 2:
            break
        go.wait(0.01)
    assert (job.text, job.suspects) == ("half way", {"play": 5.0, "sag": 4.0})
    go.set()
    assert worker.wait(60.0)


def test_waiting_drags_give_way_to_the_newest(worker, view, first):
    view.gate = threading.Event()
    worker.submit(SelectTarget(1))
    for k in range(50):
        worker.submit(MoveTarget(1, (0.5, 0.5, 0.2 + 0.001 * k), RPY, client=1))
    worker.submit(SelectTarget(1))
    worker.submit(MoveTarget(1, (0.5, 0.5, 0.3), RPY, client=1))
    view.gate.set()
    assert worker.wait(60.0)
    moves = [e.command.xyz[2] for e in worker.journal if isinstance(e.command, MoveTarget)]
    assert len(moves) <= 4
    assert moves[-2:] == [pytest.approx(0.249), 0.3]  # the selection between them is a barrier


def test_views_see_snapshots_in_order_and_are_closed(worker, view, do):
    do(*(SelectTarget(i) for i in range(10)))
    revisions = [s.page.revision for s in view.drawn]
    assert revisions == sorted(revisions)
    assert view.drawn[-1] is worker.session
    worker.close()
    assert view.closed


def test_a_failing_view_does_not_stop_the_others(worker, view, do, caplog):
    class Failing(type(view)):
        def draw(self, session):
            raise RuntimeError("no screen")

    worker.add_view(Failing())
    session = do(SelectTarget(2))
    assert view.drawn[-1] is session


def test_a_view_that_is_behind_draws_again_once_nothing_comes(worker, view, do):
    class Behind(type(view)):
        caught_up = threading.Event()

        def draw(self, session):
            super().draw(session)
            self.is_behind = len(self.drawn) < 3
            if not self.is_behind:
                self.caught_up.set()

    behind = Behind()
    worker.add_view(behind)
    session = do(SelectTarget(2))
    assert behind.caught_up.wait(60.0)
    assert behind.drawn[-1] is session
    assert len(view.drawn) == 1


def test_other_commands_go_on_beside_a_task(worker, view, first):
    go = threading.Event()
    worker.submit(Slow(go))
    worker.submit(SelectTarget(4))
    for _ in range(6000):
        if (
            worker.session.selected == 4
            and worker.session.page.job
            and worker.session.page.job.fraction == 0.5
        ):
            break
        threading.Event().wait(0.01)
    assert worker.session.selected == 4
    assert worker.session.page.job.text == "half way"
    worker.submit(Slow(go))
    go.set()
    assert worker.wait(60.0)
    texts = [m.text for m in worker.session.page.messages]
    assert any("still running" in t for t in texts)
    assert "selected 0 then, 4 now" in texts
    assert worker.session.page.job is None
    endings = {(e.command.title, e.ending) for e in worker.journal}
    assert ("Slow work", Ending.REFUSED) in endings
    assert replay(first, worker.journal).page.messages[-1].text == "selected 0 then, 4 now"


def test_cancel_leaves_the_session_as_it_was(worker, first):
    worker.submit(Slow(threading.Event()))
    while worker.session.page.job is None:
        threading.Event().wait(0.005)
    worker.cancel()
    assert worker.wait(60.0)
    assert worker.session.page.job is None
    assert worker.session.plate is first.plate
    assert worker.journal[-1].ending is Ending.CANCELLED


def test_work_may_keep_what_it_had_when_it_was_cancelled(worker, monkeypatch):
    go = threading.Event()
    monkeypatch.setitem(globals(), "check_cancelled", lambda: cancelled() and go.set())
    monkeypatch.setattr(Slow, "stopped", lambda self, result: replace(self, title="Cut short"))
    worker.submit(Slow(go))
    while worker.session.page.job is None:
        threading.Event().wait(0.005)
    worker.cancel()
    assert worker.wait(60.0)
    last, told = worker.journal[-1], [m.text for m in worker.session.page.messages]
    assert (last.command.title, last.ending, told) == ("Cut short", Ending.DONE, ["selected 0 then, 0 now"])
