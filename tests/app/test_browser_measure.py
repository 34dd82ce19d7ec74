"""Guided measuring on the page: drive, wait for standstill, store, take again, use the rows."""

import pytest

from workbench.session.commands import UseRows

pytestmark = pytest.mark.browser


def test_a_target_is_measured_by_hand(app, look):
    screen = look()
    screen.tab("Measure")
    screen.press("Begin measuring")
    screen.wait_text("progress", "0 of 10")
    screen.shoot("guided-begin")
    store = screen.page.get_by_role("button", name="Store", exact=True)
    assert store.is_disabled()
    at_first = screen.node("/arm/body3")
    screen.press("Drive the virtual arm there")
    screen.wait_text("standing", "Moves")
    screen.shoot("guided-moves")
    screen.wait_text("standing", "Stands still")
    assert screen.node("/arm/body3") != at_first
    assert float(screen.text("off_mm").split()[0]) < 3.0
    assert float(screen.text("off_deg").rstrip("°")) < 0.5
    screen.page.wait_for_function("b => !b.disabled", arg=store.element_handle())
    screen.shoot("guided-still")
    store.click()
    screen.wait_text("progress", "1 of 10")
    screen.wait_text("measuring", "Wanted: target 2")
    screen.press("Take again")
    screen.wait_text("progress", "0 of 10")
    screen.wait_text("measuring", "Wanted: target 1")
    store.click()
    screen.wait_text("progress", "1 of 10")
    screen.shoot("guided-stored")
    screen.press("Use the rows")
    screen.wait_text("preview", "1 of 10 targets")
    screen.shoot("guided-used")
    app.worker.wait()
    assert any(isinstance(entry.command, UseRows) for entry in app.worker.journal)
