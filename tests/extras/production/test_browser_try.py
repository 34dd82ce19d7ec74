"""Trying a plate on the page of a session that has no required error yet."""

import pytest

from workbench.extras.production.session import TryPlate
from workbench.session.commands.identify import SetWanted
from workbench.session.page_state import Severity

pytestmark = pytest.mark.browser


def test_a_plate_is_tried_after_one_question_where_no_error_is_required(app, look):
    screen = look()
    app.worker.submit(SetWanted(None))
    screen.press("Try this plate")
    sheet = screen.page.locator(".mantine-Modal-content")
    offered = float(sheet.get_by_role("textbox").input_value())
    screen.shoot("try-asks")
    sheet.get_by_role("button", name="Try with this").click()
    session = screen.until(lambda s: s.tried is not None, timeout=120.0)
    assert session.choices.wanted.position == pytest.approx(1e-3 * offered)
    assert 3.0 <= 1e-3 * offered / session.score.position <= 10.0
    assert session.tried.arms == TryPlate.arms
    assert Severity.ERROR not in {message.severity for message in session.page.messages}
