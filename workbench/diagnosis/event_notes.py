"""Consequences of events for the judging rows and for the saved arm."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool

from workbench.arm.after_events import after_events
from workbench.arm.effects.events import AbstractEvent
from workbench.arm.motion import Motion
from workbench.data.dataset import Dataset
from workbench.diagnosis.rounds import Searched
from workbench.identification.fit import Fit
from workbench.identification.preparation import Prepared
from workbench.identification.row_errors import Spread
from workbench.identification.undecided_rows import UNDECIDED


def without_undecided(ready: Prepared, last: Searched) -> Prepared:
    """The rows without held-out ones between the last row before a step and the first one after it.

    Only these rows themselves could show on which side of the step they lie.
    """
    held, fitted = Motion.of(ready.held), Motion.of(last.stage.fitted.problem.data)
    between = np.zeros(len(ready.held), bool)
    for event in _events(last.stage.fitted.fit.arm.effects):
        here, there = event.clock(held), event.clock(fitted)
        if event.is_step and here is not None and there is not None and (there < event.moment).any():
            between |= (here > there[there < event.moment].max()) & (here < event.moment)
    if not between.any():
        return ready
    own = len(ready.held_out_rows) == len(between)
    return replace(
        ready,
        held=ready.held.take(~between),
        held_out_rows=ready.held_out_rows[~between] if own else ready.held_out_rows,
        excluded=(*ready.excluded, *((int(row), UNDECIDED) for row in ready.held.row[between] if own)),
    )


@dataclass(frozen=True)
class Now:
    """The saved arm: its state after the last event.

    Args:
        row: The first row of the file in this state.
        mean_mm: Its mean error on the rows from there on, fitted and held-out ones without suspects [mm].
    """

    row: int
    mean_mm: float

    @property
    def sentence(self) -> str:
        size = f", with a mean error of {self.mean_mm:.3g} mm" if np.isfinite(self.mean_mm) else ""
        return f"The saved arm is that after the last event, from row {self.row} on{size}."


def arm_now(ready: Prepared, final: Fit, left_out: Bool[np.ndarray, " held"]) -> Now | None:
    """The saved arm and its errors; None without events."""
    events = list(_events(final.arm.effects))
    if not events:
        return None
    arm, places = after_events(final.calibrated), final.problem.instrument(final.x)
    parts = [
        ready.errors_on(rows.take(_after(events, rows) & wanted), arm, places).position
        for rows, wanted in ((ready.problem.data, True), (ready.held, ~left_out))
    ]
    return Now(max(events, key=lambda e: e.moment).row, 1e3 * Spread.of(np.concatenate(parts)).mean)


def _events(effects) -> Iterator[AbstractEvent]:
    return (e for e in effects if isinstance(e, AbstractEvent))


def _after(events: list[AbstractEvent], rows: Dataset) -> Bool[np.ndarray, " rows"]:
    return np.all([event.is_over(Motion.of(rows)) for event in events], axis=0)
