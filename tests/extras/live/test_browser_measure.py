"""Guided measuring on the page: wait for standstill, store, take again, use the rows."""

import json
import queue
import time

import pytest
from playwright.sync_api import expect

from workbench import Motion, tool_poses
from workbench.extras.live.sample import Sample
from workbench.extras.live.session import UseRows
from workbench.extras.live.sources import LiveSource
from workbench.session.commands.messages import OpenTab
from workbench.session.page_state import Tab
from workbench.views.appearance.bodies import body_frames

pytestmark = pytest.mark.browser


def test_a_target_of_a_real_arm_is_measured_by_hand(app, look):
    """A source's lines move the arm; the row is stored by hand, taken again, and used."""
    screen, first = look(), app.worker.session
    lines: queue.Queue = queue.Queue()
    app.worker.add_view(LiveSource(app.worker, iter(lines.get, None), name="<b>arm</b>"))

    def stand(q, begin):
        pose = tool_poses(first.robot, Motion(q[None]))[0]
        for k in range(12):
            seen = {"position": pose[:3, 3], "rotation": pose[:3, :3]}
            lines.put(json.dumps(Sample(time=begin + 0.1 * k, q=q, **seen).plain()))
            time.sleep(0.06)

    screen.tab("Measure")
    screen.wait_text("source", "Connected")
    stand(first.states[2].q, 0.0)
    screen.wait_node("/arm/nominal/body6", body_frames(first.robot, first.states[2].q)[-1][:3, 3])
    screen.wait_text("hint", "follows the real one")
    screen.press("Measure the real arm")
    screen.wait_text("progress", "0 of 10")
    screen.shoot("guided-begin")
    store = screen.page.get_by_role("button", name="Store", exact=True)
    expect(store).to_be_disabled()
    stand(first.states[0].q, 10.0)
    screen.wait_text("standing", "Stands still")
    assert float(screen.text("off_mm").split()[0]) < 0.1
    expect(store).to_be_enabled()
    store.click()
    screen.wait_text("progress", "1 of 10")
    screen.wait_text("measuring", "Target 2")
    screen.press("Retake")
    screen.wait_text("progress", "0 of 10")
    expect(screen.page.get_by_role("tab", name="Plate")).to_have_count(0)  # a mode of its own
    assert screen.box("measuring")["height"] > 250.0
    screen.page.keyboard.press("Space")
    screen.wait_text("progress", "1 of 10")
    screen.shoot("guided-stored")
    screen.press("Use the rows")
    screen.wait_text("preview", "1 of 10 targets")
    app.worker.wait()
    assert any(isinstance(entry.command, UseRows) for entry in app.worker.journal)
    lines.put(None)
    screen.wait_text("source", "Ended")
    app.worker.submit(OpenTab(Tab.PLATE))  # where pages of later tests open
    app.worker.wait()
