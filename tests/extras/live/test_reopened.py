"""A session that goes on: what was connected then is not connected now."""

from dataclasses import replace

from refusals import mentions

from workbench.extras.live.commands import LiveOption
from workbench.extras.live.session import Source
from workbench.session.journal.folder import unrecorded_session
from workbench.views.page.app import App


def test_a_source_of_then_is_said_to_have_ended(app):
    begun = unrecorded_session(app.worker.session.robot, app.worker.session.plate)
    session = begun.session.with_part(Source("localhost:5000"))
    with LiveOption().opened() as make:
        again = App(session.robot, session.plate, begun=replace(begun, session=session), beside=[make])
    try:
        assert again.worker.wait(60.0)
        assert not again.worker.session.part(Source).is_open
        assert mentions(again.worker.session.page.messages[-1].text, "localhost:5000")
    finally:
        again.close()
