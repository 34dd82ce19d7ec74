"""How joints came to the rows of a file: by which motions, how wound up, how fast."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.data.dataset import Dataset

SLIPS = np.array([0.1, 0.3, 1.0])
"""Ways until joints are wound up, in standard deviations of their positions."""
STEADY = 0.3
"""Distance of a row from the straight way between its neighbours, as a share of a step, up to which rows show
how fast joints moved."""
AGREES = 0.9
"""Share of motions whose directions must be those from the row before for their sizes to be known."""


@dataclass(frozen=True, eq=False)
class Path:
    """How joints came to some rows.

    Args:
        moves: By how far each moved from the row before [rad or m].
        wound: How far each is wound up, from −1 to 1: a spring that drags a block, which slips after `SLIPS`.
        speed: How fast each moved in the row, from the rows about it [rad/s or m/s].
        is_steady: Whether rows are near enough to each other for that to be so.
    """

    moves: Float[np.ndarray, "rows n"]
    wound: Float[np.ndarray, "rows n slips"]
    speed: Float[np.ndarray, "rows n"]
    is_steady: bool


def path_of(data: Dataset, whole: Dataset) -> Path | None:
    """How the joints came to some rows of a file; None where it doesn't tell. All its rows, `whole`, came one
    after the other by their times, or as they stand in the file, if directions agree."""
    if data.direction is None:
        return None
    is_timed = whole.time is not None and bool(np.isfinite(whole.time).all())
    clock = np.asarray(whole.time if is_timed else whole.row, float)
    session = np.zeros(len(whole), int)
    if whole.session is not None:
        session = np.unique(whole.session, return_inverse=True)[1]
    order = np.lexsort((clock, session))
    steps = np.diff(whole.q[order], axis=0, prepend=whole.q[order[:1]])
    begins = np.diff(session[order], prepend=-1) != 0
    gaps = np.diff(clock[order], prepend=0.0)[:, None]
    steps[begins] = gaps[begins] = 0.0
    ways, times = (each + np.vstack([each[1:], 0.0 * each[:1]]) for each in (steps, gaps))
    speed = np.divide(ways, times, out=np.zeros(ways.shape), where=is_timed & (times > 0.0))
    is_steady = is_timed and ((steps - gaps * speed) ** 2).sum() < STEADY**2 * ((ways / 2.0) ** 2).sum()
    slips = np.multiply.outer(np.maximum(whole.q.std(0), 1e-9), SLIPS)
    now, wound = np.zeros(slips.shape), np.zeros((len(whole), *slips.shape))
    for row, step, is_first in zip(order, steps, begins, strict=True):
        now = np.zeros(slips.shape) if is_first else np.clip(now + step[:, None], -slips, slips)
        wound[row] = now / slips
    moves, speeds = np.empty_like(steps), np.empty_like(steps)
    moves[order], speeds[order] = steps, speed
    place = np.argsort(whole.row, kind="stable")
    mine = place[np.searchsorted(whole.row[place], data.row)]
    agrees = (np.sign(moves[mine]) == data.direction) | (data.direction == 0.0) | (moves[mine] == 0.0)
    if agrees.mean() <= AGREES:
        return None
    return Path(moves[mine], wound[mine], speeds[mine], bool(is_steady))
