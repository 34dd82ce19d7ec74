"""The strip and the tabs in a real Chromium."""

import pytest

pytestmark = pytest.mark.browser


def test_strip_and_tabs_stay_in_view_where_the_panel_is_scrolled(look):
    screen = look()
    page = screen.page
    tabs_list = page.get_by_role("tablist").filter(has_text="Plate")
    before, number = tabs_list.bounding_box(), screen.box("predicted")
    page.mouse.move(before["x"] + 100, before["y"] + 300)
    for _ in range(20):
        page.mouse.wheel(0, 200)
        page.wait_for_timeout(100)
        if screen.box("predicted")["y"] < number["y"] - 250:
            break
    strip, tabs = screen.box("hint"), tabs_list.bounding_box()
    assert screen.box("predicted")["y"] < tabs["y"]
    assert strip["y"] > 0
    assert strip["y"] + strip["height"] < tabs["y"] < before["y"] + 20
    screen.tab("Robot")
    page.get_by_text("Change to this robot").wait_for()
