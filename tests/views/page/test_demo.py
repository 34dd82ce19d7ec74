"""The demo as a film: it waits, shows the tab where each scene's outcome is seen."""

import time

import pytest

from workbench.session import Worker
from workbench.session.commands.drag import SelectTarget
from workbench.session.commands.messages import SetCaption, Steer, SteerDemo
from workbench.session.page_state import Tab
from workbench.views.page import demo
from workbench.views.page.demo import Demo, DemoScene


@pytest.fixture
def film(first, monkeypatch):
    """Play a film of three scenes and pause it as a scene begins; the film and its worker."""
    scenes = (DemoScene("one"), DemoScene("two", (SelectTarget(3),), tab=Tab.MEASURE), DemoScene("three"))
    monkeypatch.setattr(demo, "story", lambda now: iter(scenes))
    worker, begun = Worker(first), []

    def play(paused_at: str) -> tuple[Demo, Worker]:
        stops = [paused_at]

        def pause(command):
            if isinstance(command, SetCaption) and command.text in stops:
                stops.clear()
                worker.submit(SteerDemo(Steer.PAUSE))

        worker.listen(pause)
        begun.append(Demo(worker, pace=0.05))
        until(lambda: worker.session.page.caption == paused_at)  # where it stays
        worker.submit(SteerDemo(Steer.PAUSE))
        until(lambda: worker.session.page.is_paused)
        return begun[0], worker

    yield play
    for playing in begun:
        playing.stop()
        playing.join(60.0)
    worker.close()


def until(holds, timeout: float = 60.0) -> None:
    end = time.monotonic() + timeout
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_it_waits_and_goes_on(film):
    playing, worker = film("two")
    time.sleep(0.5)  # longer than the scene
    assert worker.session.page.caption == "two"
    worker.submit(SteerDemo(Steer.ON))
    until(lambda: playing.is_finished)
    worker.wait()
    said = [e.command.text for e in worker.journal if isinstance(e.command, SetCaption)]
    assert said == ["one", "two", "three"]
    assert not worker.session.page.is_paused


def test_anything_else_ends_it_even_where_it_waits(film):
    playing, worker = film("one")
    worker.submit(SelectTarget(5))
    playing.join(60.0)
    until(lambda: worker.session.page.caption == "")
    assert not playing.is_finished
