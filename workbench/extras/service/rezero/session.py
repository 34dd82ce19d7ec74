"""Moved zeros in a session: the command that finds them, what is kept, recorded and saved."""

from dataclasses import dataclass
from typing import final

from workbench.arm.robot_toml import robot_text
from workbench.base.errors import DataError
from workbench.extras.service.rezero.result import Rezero
from workbench.session.command import AbstractTask
from workbench.session.commands.data import check_unchanged, measurements
from workbench.session.export import File, stem_of
from workbench.session.loaded_measurements import Loaded
from workbench.session.page_state import Severity
from workbench.session.part import AbstractPart, GoesWith
from workbench.session.state import Session


@final
@dataclass(frozen=True, eq=False)
class FoundZeros(AbstractPart):
    """The last search of these measurements for joints that moved."""

    goes_with = GoesWith.MEASUREMENTS

    found: Rezero


class FindZeros(AbstractTask[tuple[Loaded, Rezero]]):
    """Find which joints' zeros moved since the robot of the session was calibrated."""

    title = "Find moved joint zeros"

    def check(self, session: Session) -> None:
        measurements(session)

    def compute(self, session: Session) -> tuple[Loaded, Rezero]:
        from workbench.extras.service.rezero.moved_joints import rezero

        loaded = measurements(session)
        left_out = dict.fromkeys(sorted(session.measurements.left_out), "excluded manually")
        return loaded, rezero(session.robot, loaded.dataset, exclude=left_out)

    def finish(self, session: Session, result: tuple[Loaded, Rezero]) -> Session:
        loaded, found = result
        check_unchanged(session, loaded, "find the zeros")
        severity = Severity.WARNING if found.doubts else Severity.INFO
        return session.with_part(FoundZeros(found)).with_message(severity, found.sentence)


def zeros_of(session: Session) -> Rezero | None:
    """The last search of these measurements, if any."""
    kept = session.part(FoundZeros)
    return None if kept is None else kept.found


def rezeroed_toml(session: Session) -> File:
    """The calibrated arm with the identified zeros."""
    found = zeros_of(session)
    if found is None or found.doubts:
        raise DataError("no zeros have been found; press Find moved joints first")
    return f"{stem_of(found.robot.name)}-zeros.toml", robot_text(found.robot).encode()
