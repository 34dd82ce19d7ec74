"""The strip and the tabs in a real Chromium."""

import pytest

from tests.browser import PANEL
from workbench.session.page_state import Tab
from workbench.views.page.style import PANEL_WIDTH

pytestmark = pytest.mark.browser
NARROWED = f"() => document.querySelector('[data-testid=hint]') && Math.abs({PANEL}.offsetWidth - 376) < 8"


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
