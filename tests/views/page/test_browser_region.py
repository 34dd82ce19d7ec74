"""The region in a real Chromium: cubes with colours and numbers."""

import numpy as np
import pytest

pytestmark = pytest.mark.browser


def test_cubes_are_coloured_clicked_and_move_a_target(app, look):
    screen = look()
    screen.page.get_by_text("Region and requirement", exact=True).click()
    screen.choose("Cubes show", "Predicted error")
    screen.wait_text("key", "mm")
    at, metre = screen.grab(1)  # a handle that cubes are before
    screen.page.mouse.move(*(at - 0.02 * metre), steps=4)
    screen.until(lambda session: session.drag is not None)
    screen.page.mouse.up()
    first = screen.until(lambda session: session.drag is None).history.past[0].plate
    screen.press("Undo")
    screen.until(lambda session: session.plate is first)
    screen.choose("Slice", "one layer of z")
    region = screen.until(lambda session: session.region.view.cut == 2).plate.region
    wanted = int(np.argmin(np.linalg.norm(region.centres - [0.47, 0.35, 0.325], axis=1)))
    top = np.array([0.0, 0.0, 0.3 * region.cube])
    for _ in range(20):  # the layer may not be drawn yet
        screen.page.mouse.click(*screen.pixel(region.centres[wanted] + top))
        screen.page.wait_for_timeout(500)
        if app.worker.session.region.view.picked is not None:
            break
    screen.wait_text("cube", "Reached in")
    app.worker.wait()
    clicked = app.worker.session.region.view.picked
    aimed, hit = screen.pixel(region.centres[wanted]), screen.pixel(region.centres[clicked])
    edges = [screen.pixel(region.centres[clicked] + region.cube * axis) - hit for axis in np.eye(3)]
    assert np.linalg.norm(hit - aimed) < np.sqrt(3.0) / 2.0 * max(np.linalg.norm(e) for e in edges)
    screen.press("Move the selected target there")
    screen.until(lambda session: np.allclose(session.plate.targets[0].xyz, region.centres[clicked]))
