"""Effects with columns of their own, from the file to the comparison, in a real browser."""

import numpy as np
import pytest
from driven_effects import driven_file
from playwright.sync_api import expect

from workbench.data.readers import read_measurements
from workbench.identification.evaluate import evaluate
from workbench.session.commands.compare import ShowRow
from workbench.session.commands.data import MeasureVirtualArm
from workbench.session.commands.identify import Identify
from workbench.views.page.html import number as as_shown

pytestmark = pytest.mark.browser


def test_what_was_found_is_added_and_compared(app, look, tmp_path):
    """Compare shows the errors that `evaluate` finds; `test_added_effects` takes every column's effect."""
    screen = look()
    path, name = driven_file("temperature", tmp_path)
    screen.tab("Measure")
    screen.give("Load measurements", path)
    screen.wait_text("preview", path.name)
    screen.tab("Calibrate")
    screen.press("Identify")
    screen.wait_text("result", "held-out poses", timeout=120_000)
    nominal = screen.text("result").split()[0]
    screen.tab("Calibrate")
    screen.press("Diagnose")
    screen.wait_text("verdict", "Left after all", timeout=120_000)
    assert not any(word in screen.text("verdict") for word in ("[nat]", "evidence", "chance", "10⁻"))
    screen.press("Add causes")
    screen.wait_text("verdict", "now part of the model", timeout=120_000)
    screen.shoot(f"added-{name}")
    session = app.worker.session
    assert [effect.name for effect in session.results.accepted] == [name]
    expected = evaluate(
        session.results.identification.runs[session.results.fit].judged, read_measurements(path)
    )
    errors = dict(zip(expected.row_numbers.tolist(), expected.rows.position.tolist(), strict=True))
    screen.tab("Calibrate")
    assert screen.text("result").split()[0] == nominal
    screen.tab("Compare")
    slider = screen.page.get_by_role("slider").first
    for key, place in (("End", len(errors)), ("Home", 1), ("ArrowRight", 2)):
        slider.focus()
        slider.press(key)
        screen.wait_text("row", f"Pose {place} of {len(errors)}")
        row = int(session.results.comparison.number[place - 1])
        shown = screen.text("row").split("Calibrated")[1].split()[0]
        assert f"data row {row} " in screen.text("row")
        assert shown == as_shown(1e3 * errors[row])
    compared = 1e3 * session.results.comparison.errors[:, 1]
    assert compared.mean() == pytest.approx(expected.errors.position_mm.mean, rel=1e-9)
    assert compared.max() == pytest.approx(expected.errors.position_mm.max, rel=1e-9)
    screen.shoot(f"compared-{name}")


def test_a_click_on_a_row_of_the_chart_and_playing_put_the_arm_there(app, look):
    screen = look()
    app.worker.submit(MeasureVirtualArm(5, surprise=True, more=20))
    assert app.worker.wait(60.0)
    app.worker.submit(Identify())
    assert app.worker.wait(120.0)
    screen.tab("Calibrate")
    dots = screen.page.locator('[data-testid="row-chart"] a')
    expect(dots).to_have_count(len(app.worker.session.results.comparison))
    dots.nth(7).locator("circle").dispatch_event("click")
    session = screen.until(lambda session: session.results.row > 0)
    number = int(np.sort(session.results.comparison.number)[7])
    assert session.results.comparison.number[session.results.row] == number
    screen.wait_text("row-errors", f"Data row {number}")
    screen.press("Play the rows")
    session = screen.until(
        lambda session: session.results.comparison.number[session.results.row] > number + 2
    )
    screen.press("Play the rows")
    screen.page.wait_for_timeout(700)
    stopped = app.worker.session.results.row
    screen.page.wait_for_timeout(900)
    assert app.worker.session.results.row == stopped
    assert [type(entry.command) for entry in app.worker.journal][-1] is ShowRow
