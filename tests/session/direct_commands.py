"""Commands carried out in the test's own thread, without a worker."""

from workbench.session.state import Session


def done(session: Session, *commands) -> Session:
    """The session after commands, carried out here."""
    for command in commands:
        command.check(session)
        if hasattr(command, "compute"):
            result = command.compute(session)
            session = command.finish(session, result)
        else:
            session = command.apply(session)
    return session
