"""Panels without a browser: every control explains itself, and strange text stays text."""

import numpy as np
import pytest

from workbench.app import html
from workbench.app.panels.header import next_step
from workbench.session.commands import Tell


def test_every_control_has_a_tooltip(app):
    controls = list(app.server.gui._gui_input_handle_from_uuid.values())
    assert len(controls) > 20
    assert [c.label for c in controls if hasattr(c, "label") and not c.hint] == []


def test_text_from_outside_is_escaped(app):
    app.worker.submit(Tell("<script>alert(1)</script>"))
    app.worker.wait()
    header = app.view._panels[0]._message.content
    assert "<script>" not in header
    assert "&lt;script&gt;" in header


def test_the_first_hint_is_there(app):
    assert "Drag an arrow" in next_step(app.worker.session)


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (0.0, "0"),
        (0.19702, "0.197"),
        (4339.9, "4 340"),
        (12.286, "12.3"),
        (np.nan, "–"),
        (np.inf, "∞"),
        (-0.5, "-0.500"),
    ],
)
def test_numbers(value, shown):
    assert html.number(value) == shown


def test_changes_are_green_where_better():
    assert "#15803d" in html.change(2.0, 1.0, larger_is_better=True)
    assert "#b91c1c" in html.change(2.0, 1.0, larger_is_better=False)
    assert html.change(np.inf, 1.0, larger_is_better=True) == ""
