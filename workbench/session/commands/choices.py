"""Commands about what takes part in an identification: rows left out by hand, parameters held."""

from collections.abc import Hashable
from dataclasses import dataclass, replace

from workbench.base.errors import DataError, OptionError
from workbench.session.command import AbstractChange
from workbench.session.state import Session


@dataclass(frozen=True)
class LeaveRowsOut(AbstractChange):
    """Keep exactly these measured rows out of the next identification.

    Args:
        rows: Numbers of the data's rows, counted from 0.
    """

    rows: tuple[int, ...]

    @property
    def title(self) -> str:
        return f"Leave {len(self.rows)} rows out"

    @property
    def key(self) -> Hashable | None:
        return "rows"

    def check(self, session: Session) -> None:
        if session.loaded is None:
            raise DataError("there are no measurements yet, so no row can be left out")
        known = set(session.loaded.dataset.row.tolist())
        if unknown := sorted(set(self.rows) - known):
            raise OptionError(f"there is no row {unknown[0]}; rows are {min(known)} to {max(known)}")
        if not known - set(self.rows):
            raise OptionError("every row would be left out; keep some to fit")

    def apply(self, session: Session) -> Session:
        return replace(session, left_out=frozenset(self.rows))


@dataclass(frozen=True)
class HoldParameter(AbstractChange):
    """Hold a parameter at its nominal value, or let it be identified.

    Args:
        name: Such as `joint2.alpha`.
        held: Whether to hold it.
    """

    name: str
    held: bool

    @property
    def title(self) -> str:
        return f"{'Hold' if self.held else 'Free'} {self.name}"

    @property
    def key(self) -> Hashable | None:
        return ("hold", self.name)

    def check(self, session: Session) -> None:
        if self.name not in session.robot.default_free:
            raise OptionError(f"'{self.name}' is no free parameter of {session.robot.name}")

    def apply(self, session: Session) -> Session:
        names = {self.name}
        return replace(session, held=session.held | names if self.held else session.held - names)
