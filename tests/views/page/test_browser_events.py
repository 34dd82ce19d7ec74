"""What happened while rows were measured, from its name to a session of its own, in a real browser."""

import sys
from pathlib import Path

import pytest
from playwright.sync_api import expect

from workbench.data.writer import write_measurements
from workbench.session.start import default_plate, start

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))
from events import CASES, make

pytestmark = pytest.mark.browser
DRAWN = "name => window.__viserMutable.nodePoseData[name] !== undefined"
SPLIT = "Start a new session there"


@pytest.mark.slow
def test_the_rows_after_an_event_become_a_session_and_go_back(app, look, tmp_path):
    made = make(CASES["slip"], 0, "aria")
    screen = look()
    screen.show(start(made.robot, default_plate(made.robot)))
    screen.tab("Measure")
    screen.give("Load measurements", write_measurements(made.data, tmp_path / "rows.csv"))
    screen.wait_text("preview", "rows.csv")
    screen.tab("Calibrate")
    expect(screen.page.get_by_role("button", name=SPLIT, exact=True)).to_have_count(0)
    screen.page.get_by_text("Options", exact=True).click()
    screen.page.get_by_label("Levelled", exact=True).check()
    screen.until(lambda session: session.measurements.levelled)
    screen.press("Diagnose")
    screen.wait_text("event-1", "slipped", timeout=120_000)
    (event,) = app.worker.session.results.diagnosis.events
    assert app.worker.session.results.diagnosis.final_fit.problem.frames.levelled
    screen.wait_text("row-chart", event.mark)
    expect(screen.page.locator('[data-testid="event-line"]')).to_have_count(1)
    assert event.mark in screen.text("events")
    for part in ("arrow", "words"):
        screen.page.wait_for_function(DRAWN, arg=f"/event/{part}/1")
    screen.press(SPLIT)
    session = screen.until(lambda session: session.results.diagnosis is None)
    split = session.measurements.loaded.dataset.sessions
    assert split == (f"before row {event.row}", f"from row {event.row}")
    expect(screen.page.get_by_role("button", name=SPLIT, exact=True)).to_have_count(0)
    expect(screen.page.locator('[data-testid="event-line"]')).to_have_count(0)
    screen.tab("Plate")
    screen.press("Undo")
    session = screen.until(lambda session: session.measurements.loaded.dataset.session is None)
    assert session.results.diagnosis.events == (event,)
    screen.tab("Calibrate")
    screen.wait_text("event-1", "slipped")
    screen.press("Add effects")
    screen.wait_text("verdict", "now part of the model")
    assert [effect.name for effect in app.worker.session.results.accepted] == ["tool-step"]
