"""Effects with columns of their own, from the file to the comparison, in a real browser."""

import pytest
from driven_effects import DRIVEN, driven_file

from workbench.data.readers import read_measurements
from workbench.identification.evaluate import evaluate
from workbench.views.page.html import number

pytestmark = pytest.mark.browser
OFTEN = "temperature"
"""That of every run: the way through the page is the same for all four; `test_browser_start` takes a load."""
DRIVERS = [d if d == OFTEN else pytest.param(d, marks=pytest.mark.slow) for d in DRIVEN]


@pytest.mark.parametrize("driver", DRIVERS)
def test_what_was_found_is_added_and_compared(app, look, tmp_path, driver):
    """Whatever column drives the effect, Compare shows the errors that `evaluate` finds."""
    screen = look()
    path, name = driven_file(driver, tmp_path)
    screen.tab("Measure")
    screen.give("Load measurements", path)
    screen.wait_text("preview", path.name)
    screen.tab("Identify")
    screen.press("Identify")
    screen.wait_text("result", "held-out poses", timeout=120_000)
    nominal = screen.text("result").split()[0]
    screen.tab("Diagnose")
    screen.press("Diagnose")
    screen.wait_text("verdict", "Working: ")
    screen.wait_text("verdict", "Mean error on", timeout=120_000)
    assert not any(word in screen.text("diagnosis") for word in ("[nat]", "evidence", "chance", "10⁻"))
    screen.press("Add the effects to the model")
    screen.wait_text("verdict", "Now part of the model", timeout=120_000)
    screen.shoot(f"added-{name}")
    session = app.worker.session
    assert [effect.name for effect in session.accepted] == [name]
    expected = evaluate(session.identification.runs[session.fit].judged, read_measurements(path))
    errors = dict(zip(expected.row_numbers.tolist(), expected.rows.position.tolist(), strict=True))
    screen.tab("Identify")
    assert screen.text("result").split()[0] == nominal
    screen.tab("Compare")
    slider = screen.page.get_by_role("slider").first
    for key, place in (("End", len(errors)), ("Home", 1), ("ArrowRight", 2)):
        slider.focus()
        slider.press(key)
        screen.wait_text("row", f"Pose {place} of {len(errors)}")
        row = int(session.comparison.number[place - 1])
        shown = screen.text("row").split("Calibrated")[1].split()[0]
        assert f"data row {row} " in screen.text("row")
        assert shown == number(1e3 * errors[row])
    compared = 1e3 * session.comparison.errors[:, 1]
    assert compared.mean() == pytest.approx(expected.errors.position_mm.mean, rel=1e-9)
    assert compared.max() == pytest.approx(expected.errors.position_mm.max, rel=1e-9)
    screen.shoot(f"compared-{name}")
