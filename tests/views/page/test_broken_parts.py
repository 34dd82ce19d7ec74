"""What raises in another package's part of the page costs that part and a warning, not the page."""

import pytest

from workbench import Parts, load_plate, load_robot, register
from workbench.session.view import AbstractView
from workbench.views.page.app import App
from workbench.views.page.panels.panel import AbstractPanel


def broken_drawable(session):
    raise RuntimeError("no drawable")
    yield


class BrokenPanel(AbstractPanel):
    def build(self, gui):
        raise RuntimeError("no panel")

    def show(self, session):
        """Nothing."""


class BrokenWatcher(AbstractView):
    def __init__(self, worker):
        raise RuntimeError("no watcher")

    def draw(self, session):
        """Nothing."""

    def close(self):
        """Nothing."""


@pytest.mark.parametrize(
    ("record", "what"),
    [
        (Parts(drawables=(broken_drawable,)), "drawable"),
        (Parts(drawables=(lambda session: iter(["no item"]),)), "drawable"),
        (Parts(panels=(BrokenPanel,)), "panel"),
        (Parts(watchers=(BrokenWatcher,)), "watcher"),
    ],
)
def test_a_part_that_raises_is_left_out_with_a_warning_and_the_page_goes_on(record, what):
    forget = register(record)
    try:
        with pytest.warns(RuntimeWarning, match=f"the {what} .* is left out: "):
            App(load_robot("aria"), load_plate("table2")).close()
    finally:
        forget()
