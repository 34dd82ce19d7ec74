"""Everybody's page in a real Chromium: names for every control, readable words, tabs in one row."""

from contextlib import suppress

import pytest

from tests.browser import PANEL
from workbench.session.page_state import Tab
from workbench.views.appearance.colours import SKY, SKY_DARK
from workbench.views.page.style import PANEL_WIDTH

pytestmark = pytest.mark.browser
NARROWED = f"() => document.querySelector('[data-testid=hint]') && Math.abs({PANEL}.offsetWidth - 376) < 8"
PROBLEMS = """() => {
  const out = [], shade = v => (v /= 255) <= .03928 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4;
  const light = c => .2126 * shade(c[0]) + .7152 * shade(c[1]) + .0722 * shade(c[2]);
  const parts = words => words.match(/[\\d.]+/g).map(Number);
  const ground = e => {
    for (; e; e = e.parentElement) {
      const c = parts(getComputedStyle(e).backgroundColor);
      if (c.length < 4 || c[3] > .9) return c;
    }
    return [255, 255, 255];
  };
  const controls = "button, input:not([type=hidden], [type=file]), textarea, [role=slider], [role=tab]";
  for (const e of document.querySelectorAll(controls)) {
    const named = e.ariaLabel || e.title || e.innerText?.trim() || e.labels?.length;
    if (e.checkVisibility() && !named && !e.closest(".mantine-Notification-root"))
      out.push("no name: " + e.outerHTML.slice(0, 120));
  }
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node; (node = walker.nextNode());) {
    const words = node.textContent.trim(), e = node.parentElement, svg = e.closest("svg");
    if (!words || !e.checkVisibility() || !e.getBoundingClientRect().width) continue;
    if (e.closest("style, script, .mantine-Notification-root")) continue;
    const style = getComputedStyle(e);
    let size = parseFloat(style.fontSize);
    if (svg?.viewBox.baseVal?.width) size *= svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
    if (size < 11.9) out.push(`${size.toFixed(1)} px: ${words}`);
    const [a, b] = [parts(svg ? style.fill : style.color), ground(e)].map(light).sort((x, y) => y - x);
    if ((a + .05) / (b + .05) < 4.5) out.push(`${((a + .05) / (b + .05)).toFixed(2)}: 1: ${words}`);
  }
  return out;
}"""

SHOWS_DIGITS = """() => [...document.querySelectorAll(".mantine-NumberInput-input")].filter(e => {
  e.value = e.closest("[data-with-right-section]") ? "-127.741" : "-143.2";
  return e.checkVisibility() && e.scrollWidth > e.clientWidth;
}).length === 0"""
"""Whether all fields of numbers show all digits of long ones."""


@pytest.mark.parametrize("is_dark", [False, True])
def test_every_control_has_a_name_and_all_words_can_be_read(app, look, is_dark):
    """WCAG AA: a contrast of 4.5, also of what is off; nothing below 12 px. Dark colours are a page's own."""
    screen, other = look(), look()
    screen.page.emulate_media(color_scheme="dark" if is_dark else "light")
    canvas = "sky => getComputedStyle(document.querySelector('canvas[data-engine]')).backgroundColor === sky"
    for each, colour in ((screen, SKY_DARK if is_dark else SKY), (other, SKY)):
        each.page.wait_for_function(canvas, arg="rgb({}, {}, {})".format(*colour))
    for tab in Tab:
        screen.tab(tab)
        screen.settle()
        with suppress(AssertionError):  # names are given once a second
            screen.wait(lambda: not screen.page.evaluate(PROBLEMS))
        assert screen.page.evaluate(PROBLEMS) == [], tab
    screen.page.emulate_media(color_scheme="light")


def test_the_panel_is_as_wide_as_its_window_allows_and_all_tabs_stand_in_one_row(look, chromium, app):
    """A page tells the window's size: the scene's is in pixels that are drawn, and without the panel."""
    page = look(new=True).page
    assert page.evaluate(f"{PANEL}.offsetWidth") == pytest.approx(PANEL_WIDTH, abs=8)
    tabs = page.get_by_role("tablist").filter(has_text="Plate").get_by_role("tab").all()
    assert len(tabs) == len(Tab)
    assert len({tab.bounding_box()["y"] for tab in tabs}) == 1
    with chromium.new_context(viewport={"width": 900, "height": 700}) as context:
        narrow = context.new_page()
        narrow.goto(f"{app.url}/?fixedDpr=2")
        narrow.wait_for_function(NARROWED, timeout=60_000)
        assert narrow.get_by_test_id("reading").evaluate("e => e.scrollWidth <= e.clientWidth")
        narrow.get_by_role("tab", name="Robot").click()
        narrow.get_by_label("Tool angles").first.wait_for()
        for width in (900, 2560):
            narrow.set_viewport_size({"width": width, "height": 700})
            narrow.wait_for_function(SHOWS_DIGITS, timeout=10_000)
