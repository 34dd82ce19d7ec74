"""Guided measuring on the page: drive, wait for standstill, store, take again, use the rows."""

import queue

import pytest
from playwright.sync_api import expect

from workbench.extras.live.sample import Sample, format_sample
from workbench.extras.live.session import UseRows
from workbench.extras.live.sources import LiveSource
from workbench.session.commands.messages import OpenTab
from workbench.session.page_state import Tab
from workbench.views.appearance.bodies import body_frames

pytestmark = pytest.mark.browser


def test_a_target_is_measured_by_hand(app, look):
    screen = look()
    screen.tab("Measure")
    screen.press("Begin measuring")
    screen.wait_text("progress", "0 of 10")
    screen.shoot("guided-begin")
    store = screen.page.get_by_role("button", name="Store", exact=True)
    expect(store).to_be_disabled()
    at_first = screen.node("/arm/nominal/body3")
    screen.press("Drive the virtual arm there")
    screen.wait_text("standing", "Moves")
    screen.shoot("guided-moves")
    screen.wait_text("standing", "Stands still")
    assert screen.node("/arm/nominal/body3") != at_first
    assert float(screen.text("off_mm").split()[0]) < 3.0
    assert float(screen.text("off_deg").rstrip("°")) < 0.5
    expect(store).to_be_enabled()
    screen.shoot("guided-still")
    store.click()
    screen.wait_text("progress", "1 of 10")
    screen.wait_text("measuring", "Target 2")
    screen.press("Retake")
    screen.wait_text("progress", "0 of 10")
    screen.wait_text("measuring", "Target 1")
    expect(screen.page.get_by_role("tab", name="Plate")).to_have_count(0)  # a mode of its own
    assert screen.box("measuring")["height"] > 250.0
    screen.page.keyboard.press("Space")
    screen.wait_text("progress", "1 of 10")
    screen.shoot("guided-stored")
    screen.press("Use the rows")
    screen.wait_text("preview", "1 of 10 targets")
    screen.shoot("guided-used")
    app.worker.wait()
    assert any(isinstance(entry.command, UseRows) for entry in app.worker.journal)
    the_page_follows_a_real_arm(app, screen)


def the_page_follows_a_real_arm(app, screen):
    """What a live source says moves the arm; its rows and its end: `test_live_source.py`."""
    lines: queue.Queue = queue.Queue()
    app.worker.add_view(LiveSource(app.worker, iter(lines.get, None), name="<b>arm</b>"))
    screen.wait_text("source", "Connected")
    q = app.worker.session.states[2].q
    lines.put(format_sample(Sample(time=0.0, q=q)))
    screen.wait_node("/arm/nominal/body6", body_frames(app.worker.session.robot, q)[-1][:3, 3])
    screen.wait_text("hint", "follows the real one")
    lines.put(None)
    screen.wait_text("source", "Ended")
    app.worker.submit(OpenTab(Tab.PLATE))  # where pages of later tests open
    app.worker.wait()
