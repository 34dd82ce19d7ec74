"""The region in a real Chromium: cubes with colours, and a slice of them."""

import pytest

pytestmark = pytest.mark.browser


def test_cubes_are_coloured_and_cut_and_stand_before_no_handle(app, look):
    screen = look()
    screen.page.get_by_text("Region and requirement", exact=True).click()
    screen.choose("Cubes show", "Predicted error")
    screen.wait_text("key", "mm")
    at, metre = screen.grab(1)  # a handle that cubes are before
    screen.page.mouse.move(*(at - 0.02 * metre), steps=4)
    screen.until(lambda session: session.drag is not None)
    screen.page.mouse.up()
    screen.until(lambda session: session.drag is None)
    screen.choose("Slice", "one layer of z")
    region = screen.until(lambda session: session.region.view.cut == 2).plate.region
    assert region.shape[2] > 1
