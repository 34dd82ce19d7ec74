"""The strip and the tabs in a real Chromium."""

import pytest

from tests.browser import PANEL
from workbench.session.commands.data import MeasureVirtualArm
from workbench.session.commands.identify import Identify
from workbench.session.page_state import Tab
from workbench.views.page.style import PANEL_WIDTH

pytestmark = pytest.mark.browser
NARROWED = (
    f"() => document.querySelector('[data-testid=\"hint\"]') && Math.abs({PANEL}.offsetWidth - 376) < 8"
)


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
    screen = look(new=True)  # every tab at its top
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


def test_the_panel_is_as_wide_as_its_window_allows_and_all_tabs_stand_in_one_row(look, chromium, app):
    """A page tells the window's size: the scene's is in pixels that are drawn, and without the panel."""
    page = look(new=True).page
    assert page.evaluate(f"{PANEL}.offsetWidth") == pytest.approx(PANEL_WIDTH, abs=8)
    tabs = page.get_by_role("tablist").filter(has_text="Plate").get_by_role("tab").all()
    assert len(tabs) == len(Tab)
    assert len({tab.bounding_box()["y"] for tab in tabs}) == 1
    narrow = chromium.new_page(viewport={"width": 900, "height": 700})
    try:
        narrow.goto(f"{app.url}/?fixedDpr=2")
        narrow.wait_for_function(NARROWED, timeout=60_000)
    finally:
        narrow.close()


def test_what_details_show_is_no_wider_than_the_panel(app, look):
    screen = look()
    for command in (MeasureVirtualArm(3, more=30), Identify()):
        app.worker.submit(command)
        app.worker.wait(120.0)
    screen.tab("Calibrate")
    screen.page.get_by_text("Details", exact=True).click()
    screen.page.locator('[data-testid="parameters"]').wait_for()
    assert screen.page.evaluate(f"{PANEL}.scrollWidth - {PANEL}.clientWidth") == 0
