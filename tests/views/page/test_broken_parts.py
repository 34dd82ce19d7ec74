"""What raises in another package's part of the page costs that part and a warning, not the page."""

import pytest

from workbench import Parts, load_plate, load_robot, register
from workbench.views.page.app import App
from workbench.views.page.panels.panel import AbstractPanel


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
