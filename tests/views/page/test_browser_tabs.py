"""The strip and the tabs in a real Chromium."""

import pytest

from workbench.session.commands.data import MeasureVirtualArm

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


def bottom(element) -> float:
    box = element.bounding_box()
    return box["y"] + box["height"]


def test_the_strip_is_about_the_open_tab_and_each_tab_keeps_its_place(app, look):
    screen = look()
    page = screen.page
    screen.tab("Calibrate")
    screen.wait_text("hint", "Nothing has been measured yet")
    app.worker.submit(MeasureVirtualArm(3))
    screen.wait_text("hint", "Loaded: 10 rows of Virtual arm 3")
    for _ in range(2):
        screen.tab("Plate")
        screen.wait_text("hint", "the arm follows")
        screen.tab("Calibrate")
        screen.wait_text("hint", "Loaded: 10 rows")
    screen.tab("Plate")
    page.mouse.move(page.viewport_size["width"] - 200, 500)
    for _ in range(40):  # the panel may be built anew beneath the wheel
        page.mouse.wheel(0, 300)
        page.wait_for_timeout(500)
        if screen.scrolled > 100:
            break
    page.wait_for_timeout(500)
    assert screen.scrolled > 100
    left = screen.box("predicted")["y"]
    screen.tab("Export")
    screen.tab("Robot")
    tabs = page.get_by_role("tablist").filter(has_text="Plate")
    first = page.get_by_role("button", name="What do you have?")
    screen.wait(lambda: 0.0 <= first.bounding_box()["y"] - bottom(tabs) < 100.0)
    screen.tab("Plate")
    screen.wait(lambda: screen.box("predicted")["y"] == pytest.approx(left, abs=2.0))
