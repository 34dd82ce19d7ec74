"""Commands about a live source: what it says of itself, whether the page follows it, measuring with it."""

from collections.abc import Hashable
from dataclasses import dataclass, replace

from workbench.base.errors import OptionError
from workbench.session.command import AbstractChange
from workbench.session.commands.data import instrument_of
from workbench.session.commands.measure import acquisition_of
from workbench.session.guided import Measuring
from workbench.session.state import (
    Focus,
    Session,
    Severity,
    Source,
)


@dataclass(frozen=True)
class TellSource(AbstractChange):
    """What has become of the live source.

    Args:
        name: Where it is.
        is_open: Whether it is connected.
        silence: For how long it has said nothing [s]; 0 where that is no matter.
    """

    name: str
    is_open: bool = True
    silence: float = 0.0

    @property
    def title(self) -> str:
        return f"Live source {self.name}: {'connected' if self.is_open else 'ended'}"

    @property
    def key(self) -> Hashable | None:
        return "source"

    def check(self, session: Session) -> None:
        """Nothing can be wrong."""

    def apply(self, session: Session) -> Session:
        is_followed = session.source is None or session.source.is_followed
        source = Source(self.name, self.is_open, self.silence, is_followed)
        session = replace(session, source=source)
        if session.measuring is not None and session.measuring.virtual is None and self.silence:
            acquisition = session.measuring.acquisition.copy()
            acquisition.silence = self.silence
            session = replace(session, measuring=replace(session.measuring, acquisition=acquisition))
        if self.is_open:
            return session
        words = f"the live source {self.name} has ended; start it again, and the page with --source"
        return session.tell(Severity.WARNING, words)


@dataclass(frozen=True)
class FollowSource(AbstractChange):
    """Let the arm in the scene stand where the real one does, or at its target as before.

    Args:
        is_followed: Whether it follows.
    """

    is_followed: bool

    @property
    def title(self) -> str:
        return "Follow the real arm" if self.is_followed else "Stop following the real arm"

    @property
    def key(self) -> Hashable | None:
        return "follow"

    def check(self, session: Session) -> None:
        _source(session)

    def apply(self, session: Session) -> Session:
        session = replace(session, source=replace(_source(session), is_followed=self.is_followed))
        return session if self.is_followed else replace(session, focus=Focus.TARGET)


@dataclass(frozen=True)
class MeasureLive(AbstractChange):
    """Begin a guided measurement of the real arm at all targets of the plate."""

    @property
    def title(self) -> str:
        return "Measure the real arm step by step"

    @property
    def key(self) -> Hashable | None:
        return None

    def check(self, session: Session) -> None:
        if not _source(session).is_open:
            raise OptionError("the live source has ended; start it again, and the page with --source")
        if session.measuring is not None:
            raise OptionError("a measurement is under way; use its rows, or stop it first")

    def apply(self, session: Session) -> Session:
        numbers = list(range(len(session.plate)))
        acquisition = acquisition_of(session, numbers, instrument_of(session))
        return replace(session, measuring=Measuring(acquisition=acquisition, numbers=tuple(numbers)))


def _source(session: Session) -> Source:
    if session.source is None:
        raise OptionError("no arm is connected; start with workbench serve --source HOST:PORT")
    return session.source
