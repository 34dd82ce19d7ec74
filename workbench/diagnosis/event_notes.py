"""Consequences of events for the judging rows and for the saved arm."""

from dataclasses import dataclass

import numpy as np

from workbench.arm.motion import Motion
from workbench.arm.usable_arm import events_of
from workbench.base.advice import beside
from workbench.diagnosis.search.rounds import Searched
from workbench.identification.errors.row_errors import row_errors
from workbench.identification.fit import Fit
from workbench.identification.preparation import Prepared
from workbench.identification.rows.row_selection import held_as_marked
from workbench.identification.run import SavedArm

UNDECIDED = "measured at a step: on which side is undecided"


def without_undecided(ready: Prepared, last: Searched) -> Prepared:
    """The rows without held-out ones between the last row before a step and the first one after it.

    Only these rows themselves could show on which side of the step they lie.
    """
    held, fitted = Motion.of(ready.held_out_data), Motion.of(last.stage.problem.data)
    between = np.zeros(len(ready.held_out_data), bool)
    for event in events_of(last.stage.fit.arm):
        here, there = event.clock(held), event.clock(fitted)
        if event.is_step and (there < event.moment).any():
            between |= (here > there[there < event.moment].max()) & (here < event.moment)
    undecided = dict.fromkeys(np.flatnonzero(between).tolist(), UNDECIDED)
    return held_as_marked(ready, ready.held_out_data.kept_out(undecided))


@dataclass(frozen=True)
class Now:
    """The saved arm: its state after the last event.

    Args:
        row: The first row of the file in this state.
        mean_mm: Its mean error on the fitted rows from there on [mm].
    """

    row: int
    mean_mm: float

    @property
    @beside("the note on the last event", "")
    def sentence(self) -> str:
        size = f", with a mean error of {self.mean_mm:.3g} mm" if np.isfinite(self.mean_mm) else ""
        return f"The saved arm is that after the last event, from row {self.row} on{size}."


@beside("the error after the last event", None)
def arm_now(final: Fit) -> Now | None:
    """The saved arm and its errors; None without events."""
    problem = final.problem
    saved = SavedArm(final.calibrated, problem.data, {**problem.known, **problem.instrument(final.x)})
    if not saved.events:
        return None
    rows = saved.valid_for(problem.data.take(saved.is_now(problem.data)))
    return Now(saved.events[-1].row, row_errors(saved.robot, rows, known=saved.known).position_mm.mean)
