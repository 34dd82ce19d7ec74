"""How joints came to the rows of a file, and how fast, where rows follow a motion closely."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.data.dataset import Dataset

STEADY = 0.3
"""Distance of a row from the straight way between its neighbours, as a share of a step, up to which rows show
how fast joints moved."""


class Course(NamedTuple):
    """How joints came to the rows of a file: one after the other by their times, or as they stand in it.

    Args:
        steps: By how far joints moved to each of them so, session by session [rad or m].
        begins: Which of these are the first of a session.
        place: Where in this order some rows stand.
        q: Positions of joints in each of those, or so much later [rad or m].
        speed: How fast joints moved in each of those [rad/s or m/s; without times, from row to row].
        is_timed: Whether times tell.
        is_steady: Whether rows are near enough to each other for speeds to be so.
    """

    steps: Float[np.ndarray, "rows n"]
    begins: Bool[np.ndarray, " rows"]
    place: Int[np.ndarray, " some"]
    q: Float[np.ndarray, "some n"]
    speed: Float[np.ndarray, "some n"]
    is_timed: bool
    is_steady: bool

    def text(self, delay: float) -> str:
        """That the arm was measured by so much after its joints were read [s, or rows]."""
        size = f"{1e3 * abs(delay):.2g} ms" if self.is_timed else f"{abs(delay):.2g} of the time between rows"
        side = "after" if delay > 0.0 else "before"
        return f"as if the arm was measured {size} {side} its joints were read"


def course(some: Dataset, data: Dataset, *, delay: float = 0.0) -> Course:
    """How joints came to the rows of a file, of which some are asked for their speeds, and where they are so
    much later [s, or rows]; along a cubic spline where rows are steady."""
    timed = data.time is not None and bool(np.isfinite(data.time).all())
    clock, session = np.asarray(data.time if timed else data.row, float), np.zeros(len(data), int)
    if data.session is not None:
        session = np.unique(data.session, return_inverse=True)[1]
    order = np.lexsort((clock, session))
    steps = np.diff(data.q[order], axis=0, prepend=data.q[order[:1]])
    begins = np.diff(session[order], prepend=-1) != 0
    gaps = np.diff(clock[order], prepend=0.0)[:, None]
    steps[begins] = gaps[begins] = 0.0
    ways, times = (each + np.vstack([each[1:], 0.0 * each[:1]]) for each in (steps, gaps))
    speed = np.divide(ways, times, out=np.zeros(ways.shape), where=times > 0.0)
    is_steady = bool(((steps - gaps * speed) ** 2).sum() < STEADY**2 * ((ways / 2.0) ** 2).sum())
    q = data.q[order]
    for mine in np.split(np.arange(len(data)), np.flatnonzero(begins)[1:]) if is_steady else ():
        from scipy.interpolate import CubicSpline

        times, first = np.unique(clock[order[mine]], return_index=True)
        if len(times) > 1:
            way = CubicSpline(times, q[mine[first]])
            speed[mine], q[mine] = way(clock[order[mine]], 1), way(clock[order[mine]] + delay)
    rows = np.argsort(data.row, kind="stable")
    place = np.argsort(order)[rows[np.searchsorted(data.row[rows], some.row)]]
    return Course(steps, begins, place, q[place], speed[place], timed, is_steady)
