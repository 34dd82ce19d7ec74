"""The command that finds joint zeros again, after a knock or a new motor."""

from dataclasses import replace
from typing import Any

from workbench.base.errors import DataError, OptionError
from workbench.base.progress import Cancel
from workbench.session.command import AbstractTask, Progress
from workbench.session.state import Session, Severity


class FindZeros(AbstractTask):
    """Find which joints' zeros moved since the robot of the session was calibrated.

    Args:
        replaced: Joints that were replaced, counted from 1.
    """

    title = "Find moved joint zeros"

    replaced: tuple[int, ...] = ()

    def check(self, session: Session) -> None:
        if session.loaded is None:
            raise DataError("there are no measurements yet; load a few poses measured after the knock")
        for joint in self.replaced:
            if not 1 <= joint <= session.robot.dof:
                raise OptionError(f"replaced joints must be 1–{session.robot.dof}, got {joint}")

    def compute(self, session: Session, *, progress: Progress, cancel: Cancel) -> Any:
        from workbench.identification.rezero.find import rezero

        loaded = session.loaded
        assert loaded is not None
        left_out = dict.fromkeys(sorted(session.left_out), "left out by hand")
        return loaded, rezero(session.robot, loaded.dataset, replaced=self.replaced, exclude=left_out)

    def finish(self, session: Session, result: Any) -> Session:
        loaded, found = result
        if session.loaded is not loaded:
            raise DataError("the measurements have changed since; find the zeros again")
        severity = Severity.WARNING if found.doubts else Severity.INFO
        return replace(session, rezero=found).tell(severity, found.sentence)
