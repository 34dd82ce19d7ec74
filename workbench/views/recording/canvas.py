"""Where entities are drawn: one recording, in a file, in an open viewer, or both.

Three timelines and no others: `step` (commands of the session), `session_time` (seconds of a clock that never
jumps), and `measured_row` (rows of the measurements, fitted first, then held out).
"""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from workbench.session.comparison import ModelStage
from workbench.views.recording.rerun_output import AbstractOutlet

STEP, TIME, ROW = "step", "session_time", "measured_row"
PATHS = {stage: stage.name.lower() for stage in ModelStage}


class Canvas:
    """Draws into every outlet alike."""

    def __init__(self, outlets: Sequence[AbstractOutlet]):
        self._outlets = tuple(outlets)

    def at(self, step: int, seconds: float) -> None:
        """What follows belongs to this step."""
        for outlet in self._outlets:
            outlet.stream.disable_timeline(ROW)
            outlet.stream.set_time(STEP, sequence=step)
            outlet.stream.set_time(TIME, duration=seconds)

    def at_rows(self) -> None:
        """What follows is there at every measured row, and at no step."""
        for outlet in self._outlets:
            outlet.stream.reset_time()
            outlet.stream.set_time(ROW, sequence=0)

    def arrange(self, layout: rrb.Blueprint) -> None:
        """Lay out the viewer anew."""
        for outlet in self._outlets:
            outlet.arrange(layout)

    def log(self, path: str, *what: Any, static: bool = False) -> None:
        for outlet in self._outlets:
            outlet.stream.log(path, *what, static=static, strict=True)

    def clear(self, path: str) -> None:
        self.log(path, rr.Clear(recursive=True))

    def rows(self, path: str, columns: Iterable[Any], count: int) -> None:
        """Draw something for every measured row."""
        numbers = rr.TimeColumn(ROW, sequence=np.arange(count))
        for outlet in self._outlets:
            outlet.stream.send_columns(path, [numbers], list(columns), strict=True)

    def flush(self) -> None:
        for outlet in self._outlets:
            outlet.stream.flush()

    def close(self) -> None:
        for outlet in self._outlets:
            outlet.close()
