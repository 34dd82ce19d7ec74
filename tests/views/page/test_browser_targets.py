"""Editing targets in a real Chromium: copies, locks, branches, tables, patterns, keys."""

from itertools import count
from time import sleep

import numpy as np
import pytest

from workbench.base.progress import check_cancelled, progress
from workbench.session.commands.drag import MoveTarget, SelectTarget
from workbench.session.target_postures import branches_to

pytestmark = pytest.mark.browser


def until_cancelled(*_, **__):
    """A search that is still at work whenever the page comes to show it."""
    for k in count():
        progress(k / (k + 100.0), "searching")
        check_cancelled()
        sleep(0.02)


def test_targets_are_edited_with_buttons_tables_and_keys(app, look, monkeypatch):
    monkeypatch.setattr("workbench.plate.design.optimise_plate", until_cancelled)
    screen = look()
    page = screen.page

    def strip_height() -> float:
        return page.get_by_role("tab", name="Plate").bounding_box()["y"] - screen.box("hint")["y"]

    first, height = app.worker.session.plate, strip_height()
    screen.press("Add")
    screen.wait_text("rank", "11 targets")
    page.get_by_label("Locked").check()
    screen.until(lambda session: session.plate.targets[10].locked)
    screen.press("Delete")
    screen.wait_text("message", "locked")
    screen.press("Improve this plate")  # it places the others, and says so where it is seen
    page.locator('[data-testid="job"]').wait_for()
    strip = page.get_by_role("button", name="Cancel", exact=True)
    assert 0.0 < strip.bounding_box()["y"] < page.viewport_size["height"] - 30
    assert strip_height() == height  # nothing below has moved
    strip.click()
    screen.until(lambda session: session.page.job is None)
    page.get_by_text("Branch of the arm", exact=True).click()
    screen.press("Undo: lock target 11")
    screen.press("Undo: add a target")
    session = screen.until(lambda session: session.plate is first)
    number, found = session.selected, branches_to(session.robot, session.plate.targets[session.selected])
    other = next(branch for branch in found if branch.name != session.states[number].branch)
    page.get_by_role("combobox", name="Branch").click()
    page.get_by_role("option", name=other.name, exact=True).click()
    screen.until(lambda session: session.states[number].branch == other.name)

    for button, targets in (("Delete", 9), ("Add", 10)):
        screen.press(button)
        screen.until(lambda session, targets=targets: len(session.plate) == targets)

    before = app.worker.session.selected
    page.mouse.click(40, 700)
    page.keyboard.press("n")
    screen.until(lambda session: session.selected == (before + 1) % 10)
    page.keyboard.press("Control+z")
    session = screen.until(lambda session: len(session.plate) == 9)
    page.keyboard.press("Shift+ArrowUp")
    wanted = np.add(session.plate.targets[session.selected].xyz, [0.01, 0.0, 0.0])
    screen.until(lambda session: np.allclose(session.plate.targets[session.selected].xyz, wanted))


def test_a_handle_behind_another_block_is_grabbed(app, look):
    screen = look()
    arrow, eye = app.view.gizmo.handles["arrows"], screen.client.camera.position
    tip = np.array(arrow.position) + 0.9 * arrow.scale * np.eye(3)[1]
    before = tip + 0.25 * (eye - tip) / np.linalg.norm(eye - tip)
    app.worker.submit(MoveTarget(1, tuple(before.tolist()), (np.pi, 0.0, 0.0)))
    app.worker.submit(SelectTarget(0))
    screen.until(lambda session: session.selected == 0)
    screen.wait_node("/handles/arrows", np.array(arrow.position))
    screen.page.wait_for_timeout(500)
    at, metre = screen.grab(1)
    screen.page.mouse.move(*(at - 0.02 * metre), steps=4)
    assert screen.until(lambda session: session.drag is not None).drag.target == 0
    screen.page.mouse.up()
    screen.until(lambda session: session.drag is None)
    screen.settle()
    screen.page.mouse.click(*screen.pixel(before - 0.05 * np.eye(3)[2]))  # the block before it, still
    screen.until(lambda session: session.selected == 1)
