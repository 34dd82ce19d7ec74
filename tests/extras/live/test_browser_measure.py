"""Guided measuring on the page: drive, wait for standstill, store, take again, use the rows."""

import queue
from dataclasses import replace

import numpy as np
import pytest
from playwright.sync_api import expect

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.extras.live.sample import Sample, format_sample
from workbench.extras.live.session import Measuring, UseRows
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
    follow_and_measure_a_real_arm(app, screen)


def follow_and_measure_a_real_arm(app, screen):
    """The same page, with a live source: what it says moves the arm, and its rows are stored."""
    lines: queue.Queue = queue.Queue()
    app.worker.add_view(LiveSource(app.worker, iter(lines.get, None), name="<b>arm</b>"))
    screen.wait_text("source", "Connected")
    q = app.worker.session.states[2].q
    pose = tool_poses(app.worker.session.robot, Motion(q[None]))[0]
    still = Sample(time=0.0, q=q, position=pose[:3, 3], rotation=pose[:3, :3])
    lines.put(format_sample(still))
    screen.until(
        lambda session: session.playback.jogged is not None and np.allclose(session.playback.jogged, q)
    )
    frame = body_frames(app.worker.session.robot, q)[-1]
    screen.page.wait_for_function(
        "p => Math.abs(window.__viserMutable.nodePoseData['/arm/nominal/body6'].position[0] - p) < 1e-5",
        arg=float(frame[0, 3]),
    )
    screen.wait_text("hint", "follows the real one")
    screen.press("Measure the real arm")
    screen.wait_text("progress", "0 of 10")
    for k in range(1, 14):
        lines.put(format_sample(replace(still, time=0.1 * k, capture=k == 13)))
        screen.page.wait_for_timeout(60)
    screen.wait_text("place", "This looks like target 3")  # the current one is the first
    expect(screen.page.get_by_role("button", name="Store", exact=True)).to_be_disabled()
    screen.shoot("elsewhere")
    screen.press("Store as target 3")
    screen.wait_text("progress", "1 of 10")
    screen.wait_text("measuring", "Target 4")
    screen.shoot("live")
    lines.put(None)
    screen.wait_text("source", "Ended")
    screen.wait_text("message", "has ended")
    screen.press("Stop measuring")
    screen.until(lambda session: session.part(Measuring) is None)
    app.worker.submit(OpenTab(Tab.PLATE))  # where pages of later tests open
    app.worker.wait()
