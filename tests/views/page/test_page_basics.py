"""What every page has before anything is on it: words for the server's end, and a way to draw less."""

import threading

import pytest

from workbench import Parts, load_plate, load_robot, register
from workbench.views.appearance.colours import SKY
from workbench.views.page.app import App
from workbench.views.page.local_server import local_server, page_address
from workbench.views.page.panels.panel import AbstractPanel
from workbench.views.page.render import PageSignals

pytestmark = pytest.mark.browser


def test_links_do_something_a_hand_at_work_costs_fewer_pixels_and_the_end_is_said(chromium):
    """Fewer pixels where there is no graphics card, also if a link was pressed before and loses its focus."""
    server, opened = local_server(), threading.Event()
    page = chromium.new_page(viewport={"width": 900, "height": 400})
    width = "() => document.querySelector('canvas[data-engine]').width"
    try:
        server.gui.add_html(f'<a id="dot" href="{PageSignals(server).pressed("plate-3", opened.set)}">3</a>')
        page.goto(f"{page_address(server)}/?fixedDpr=1")
        page.locator("canvas[data-engine]").wait_for()
        ground = "() => getComputedStyle(document.querySelector('canvas[data-engine]')).backgroundColor"
        page.wait_for_function(f"sky => ({ground})() === sky", arg=f"rgb{SKY}")
        page.locator("#dot").click()
        assert opened.wait(60.0)
        page.wait_for_timeout(300)
        assert page.locator("#dot").is_visible()
        page.wait_for_function("() => window.__viserTestpoints && document.querySelector('.gone')")
        assert page.locator(".gone").is_hidden()
        page.wait_for_function(f"() => ({width})() > 300")
        usual = page.evaluate(width)
        page.mouse.move(100, 200)
        page.mouse.down()
        page.mouse.move(101, 200)
        assert page.evaluate(width) == usual  # a click is no drag
        page.mouse.move(140, 200)
        page.wait_for_function(f"usual => ({width})() < 0.6 * usual", arg=usual)
        page.mouse.up()
        page.wait_for_function(f"usual => ({width})() === usual", arg=usual)
        server.stop()
        page.locator(".gone", has_text="The workbench has stopped").wait_for()
    finally:
        server.stop()
        page.close()


class BrokenPanel(AbstractPanel):
    def build(self, gui):
        raise RuntimeError("no panel")


def test_a_panel_that_raises_is_left_out_with_a_warning_and_the_page_goes_on():
    forget = register(Parts(panels=(BrokenPanel,)))
    try:
        with pytest.warns(RuntimeWarning, match="the panel .* is left out: "):
            App(load_robot("aria"), load_plate("table2")).close()
    finally:
        forget()
