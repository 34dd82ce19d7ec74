"""The arm as it is saved, and its errors on the rows for which it is valid: those after all events.

A file holds no events. Base and tool are those after the last step in each session, joints and frames are
warm; the remainder of a warm-up that counts as over is part of the errors.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np
from jaxtyping import Bool

from workbench.arm.effects.events import AbstractEvent
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.usable_arm import after_events, events_of, is_valid_after, usable_arm
from workbench.base.wording import plural
from workbench.data.dataset import Dataset
from workbench.identification.errors.row_errors import UNKNOWN, Errors, row_errors


@final
@dataclass(frozen=True, eq=False)
class SavedArm:
    """An arm without its events.

    Args:
        measured: The arm with the events during its measurements.
        fitted: The rows that determine them.
    """

    measured: Robot
    fitted: Dataset

    @property
    def events(self) -> list[AbstractEvent]:
        """The events in their order."""
        return events_of(self.measured)

    @cached_property
    def _sessions(self) -> dict[str, Motion]:
        motion = Motion.of(self.fitted)
        return {name: motion.take(self.fitted.in_session(name)) for name in self.fitted.sessions}

    @cached_property
    def robot(self) -> Robot:
        """The arm that its file holds."""
        return after_events(self.measured, self._sessions)

    def valid_for(self, data: Dataset) -> Dataset:
        """Those of some rows for which it is valid; all of them without events."""
        return data.take(self.is_valid_for(data))

    def is_valid_for(self, data: Dataset) -> Bool[np.ndarray, " rows"]:
        """Whether it is valid for each of some rows."""
        motion, shown = Motion.of(data), np.zeros(len(data), bool)
        for name in data.sessions:
            mine = data.in_session(name)
            shown[mine] = is_valid_after(self.measured, motion.take(mine), self._sessions.get(name))
        return shown

    def format_errors(self, data: Dataset, known: Mapping[str, float]) -> dict[str, Errors]:
        """Errors of each format's arm on those of some rows for which it is valid.

        A TOML holds the whole model, a URDF the best purely geometric one. Arguments as of `errors`.
        """
        return {name: self.errors(data, known, arm) for name, arm in self.formats.items()}

    @cached_property
    def formats(self) -> dict[str, Robot]:
        """The arm that a file of each format holds."""
        return {"TOML": self.robot, "URDF": usable_arm(self.robot, effects=False).robot}

    def errors(self, data: Dataset, known: Mapping[str, float], arm: Robot | None = None) -> Errors:
        """Its errors on those of some rows for which it is valid.

        Args:
            data: Fitted or held-out ones.
            known: Places of anchors, contacts or markers [m].
            arm: The arm of a format, instead of the whole model.
        """
        shown = self.valid_for(data)
        return row_errors(arm or self.robot, shown, known=known) if len(shown) else UNKNOWN

    def rows_text(self, rows: Dataset, kind: str) -> str:
        """`11 of 24 held-out rows, those measured from row 62 on`; all of them without events."""
        if not self.events:
            return plural(len(rows), kind)
        shown = self.valid_for(rows)
        earlier = ~self.is_now(shown)
        own = f" or in session {', '.join(shown.take(earlier).sessions)}" if earlier.any() else ""
        of = f"{len(shown)} of {plural(len(rows), kind)}"
        return f"{of}, those measured from row {self.events[-1].row} on{own}"

    def is_now(self, rows: Dataset) -> Bool[np.ndarray, " rows"]:
        """Rows after all events."""
        return np.all([e.is_over(Motion.of(rows)) for e in self.events], axis=0)
