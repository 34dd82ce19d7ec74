"""The demo in a real Chromium: a hidden effect is found and added, and the numbers fall."""

import pytest

from workbench.session.commands.messages import SetCaption, Steer, SteerDemo
from workbench.views.page import demo
from workbench.views.page.demo import END
from workbench.views.page.panels.header import WITH_MY_ROBOT

pytestmark = pytest.mark.browser


@pytest.mark.slow  # a diagnosis of the UR10 beside a page that is drawn
def test_the_demo_plays_to_its_end_and_the_numbers_fall(app, look, monkeypatch):
    monkeypatch.setattr(demo, "DRAG_PLACES", 8)
    screen = look()
    app.play_demo(0.06)
    screen.until(lambda session: session.page.caption.startswith("Found: "), timeout=400.0)
    app.worker.submit(SteerDemo(Steer.PAUSE))  # or else a page that is late would never show it
    screen.wait_text("figure-now", " → ")
    app.worker.submit(SteerDemo(Steer.ON))
    screen.wait_text("caption", END[:30], timeout=120_000)
    first, second, third = (float(n) for n in screen.text("figure-now").removesuffix(" mm").split(" → "))
    assert third < 0.075 < second < 0.4 < first < 1.0  # 1200 rows of a real UR10: 0.682, 0.375, 0.069 mm
    screen.page.get_by_role("link", name=WITH_MY_ROBOT).click()
    screen.page.get_by_role("button", name="A robot and measurements", exact=True).wait_for()
    app.demo.join(10.0)
    assert app.demo.is_finished
    screen.until(lambda session: not session.page.caption and session.choices.overlay.points)
    screen.press("Look around")
    screen.until(lambda session: session.page.tab == "Plate")
    captions = [e.command.text for e in app.worker.journal if isinstance(e.command, SetCaption)]
    assert max(map(len, captions)) < 150  # three lines that are read while they stand
    session = app.worker.session
    assert session.measurements.loaded.actual is None  # rows of a real arm
    assert ("joint-compliance", (1, 2)) in {(e.name, tuple(e.joints)) for e in session.results.accepted}
    assert session.robot.name.startswith("UR10")
    screen.tab("Calibrate")
    screen.wait_text("verdict", "part of the model")
