"""Events compared with a random walk of the same quantity, such as wind-up of a drive.

Residuals and the column u of the quantity that events change give its value y_i in every row i, with
information h_i. With and without events it may also follow a random walk,

    y_i = z_i + N(0, 1/h_i),      z_{i+1} = z_i + N(0, q),

with the most likely q, by a Kalman filter. Events and q are penalised as in `event_search.py`.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from workbench.arm.effects.events import NEVER_ROW, AbstractEvent, AbstractStep, FrameStep, ZeroStep
from workbench.arm.motion import Motion
from workbench.diagnosis.search.candidate_columns import candidate_columns
from workbench.diagnosis.search.event_search import EVENT_PRIOR_ODDS, PACES
from workbench.diagnosis.search.rounds import Searched

PATH_LENGTHS = np.array([0.0, *np.logspace(-2.0, 0.5, 11)])
"""Total lengths of random walks that are tried, relative to the events' sizes."""
START_VARIANCE = 1e6
"""Variance of its initial value, in squared event sizes."""


def leads(searched: Searched) -> dict[tuple[str, ...], float]:
    """Log odds of a fitted model's events against a random walk without events."""
    alike: dict[AbstractEvent, list[AbstractEvent]] = {}
    effects = searched.stage.fit.arm.effects
    for event in (e for e in effects if isinstance(e, AbstractEvent)):
        alike.setdefault(_at_any_time(event), []).append(event)
    found = {moved: _lead(searched, moved, events) for moved, events in alike.items()}
    return {e.names: found[moved] for moved, events in alike.items() for e in events}


def _at_any_time(event: AbstractEvent) -> AbstractEvent:
    """The change by an event, as if all rows lay before it."""
    if isinstance(event, AbstractStep):
        return replace(event, coefficients=(), row=NEVER_ROW, time_s=0.0, is_timed=False, known_before=False)
    return ZeroStep(event.joints, row=NEVER_ROW) if event.joints else FrameStep(row=NEVER_ROW)


def _lead(searched: Searched, moved: AbstractEvent, events: Sequence[AbstractEvent]) -> float:
    stage = searched.stage
    problem = stage.problem.with_noise(stage.geometric_problem.noise)
    motion, rows = Motion.of(problem.data), len(problem.data)
    sizes = np.array([e.coefficients for e in events])
    size = sizes[np.argmax((sizes**2).sum(1))]
    residual, y, info = problem.residual(stage.fit.x), np.zeros(rows), np.zeros(rows)
    for block, columns in candidate_columns(problem, stage.fit.x, [moved]):
        u, part = -columns.table @ size, residual[block.start : block.stop]
        row = np.repeat(block.rows, len(u) // len(block.rows))
        y += np.bincount(row, u * part, rows)
        info += np.bincount(row, u * u, rows)
    clocks = [np.zeros(rows) if (c := e.clock(motion)) is None else c for e in events]
    parts = sizes @ size / (size @ size)
    happened = -sum(e.weight(c) * part for e, c, part in zip(events, clocks, parts.tolist(), strict=True))
    order = np.argsort(clocks[0], kind="stable")
    y, info, happened = (y / np.maximum(info, 1e-300))[order], info[order], happened[order]
    charge = 0.5 * np.log(problem.count) + np.log(EVENT_PRIOR_ODDS)
    with_events, without = (
        max(_likelihood(values, info, q / rows) - (charge if q else 0.0) for q in (PATH_LENGTHS**2).tolist())
        for values in (y, y + happened)
    )
    places = sum(charge + np.log(rows if e.is_step else len(PACES)) for e in events)
    return float(with_events - without - places)


def _likelihood(y: Float[np.ndarray, " rows"], info: Float[np.ndarray, " rows"], q: float) -> float:
    """Log likelihood of values with a random walk of variance q per row, up to a constant."""
    mean, spread, out = 0.0, START_VARIANCE, 0.0
    for value, h in zip(y.tolist(), info.tolist(), strict=True):
        whole = 1.0 + h * spread
        out -= 0.5 * (h * (value - mean) ** 2 / whole + float(np.log(whole)))
        mean, spread = mean + spread * h * (value - mean) / whole, spread / whole + q
    return out
