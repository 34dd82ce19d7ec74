"""Where entities are drawn: one recording, in a file, in an open viewer, or both.

Two timelines and no others: `step` (commands of the session), and `session_time` (seconds of a clock that
never jumps).
"""

from collections.abc import Sequence
from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from workbench.session.comparison import ModelStage
from workbench.views.recording.rerun_output import AbstractOutlet

STEP, TIME = "step", "session_time"
EYE = "world/eye"
"""The camera that looks at the scene."""
PATHS = {stage: stage.name.lower() for stage in ModelStage}


class Canvas:
    """Draws into every outlet alike."""

    def __init__(self, outlets: Sequence[AbstractOutlet]):
        self._outlets = tuple(outlets)

    def at(self, step: int, seconds: float) -> None:
        """What follows belongs to this step."""
        for outlet in self._outlets:
            outlet.stream.set_time(STEP, sequence=step)
            outlet.stream.set_time(TIME, duration=seconds)

    def arrange(self, layout: rrb.Blueprint) -> None:
        """Lay out the viewer."""
        for outlet in self._outlets:
            outlet.stream.send_blueprint(layout)

    def log(self, path: str, *what: Any, static: bool = False) -> None:
        for outlet in self._outlets:
            outlet.stream.log(path, *what, static=static, strict=True)

    def clear(self, path: str) -> None:
        self.log(path, rr.Clear(recursive=True))

    def flush(self) -> None:
        for outlet in self._outlets:
            outlet.stream.flush()

    def close(self) -> None:
        for outlet in self._outlets:
            outlet.close()
