"""How joints came to the rows of a file: by which motions, how wound up, how fast."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from workbench.data.dataset import Dataset
from workbench.identification.rows.course import Course, course

SLIPS = np.array([0.1, 0.3, 1.0])
"""Ways until joints are wound up, in standard deviations of their positions."""
AGREES = 0.9
"""Share of motions whose directions must be those from the row before for their sizes to be known."""


class Path(NamedTuple):
    """How joints came to some rows.

    Args:
        moves: By how far each moved from the row before [rad or m].
        sign: The direction of its last motion.
        wound: How far each is wound up, from −1 to 1: a spring that drags a block, which slips after `SLIPS`.
        course: That of all rows of the file, with the speeds of these.
    """

    moves: Float[np.ndarray, "rows n"]
    sign: Float[np.ndarray, "rows n"]
    wound: Float[np.ndarray, "rows n slips"]
    course: Course


def path_of(data: Dataset, whole: Dataset) -> Path | None:
    """How the joints came to some rows of a file; None where it doesn't tell. All its rows, `whole`, came one
    after the other by their times, or as they stand in the file, if directions agree; without directions, if
    rows follow a motion closely."""
    came = course(data, whole)
    if data.direction is None and not came.is_steady:
        return None
    slips = np.multiply.outer(np.maximum(whole.q.std(0), 1e-9), SLIPS)
    now, wound = np.zeros(slips.shape), np.zeros((len(whole), *slips.shape))
    for k, (step, is_first) in enumerate(zip(came.steps, came.begins, strict=True)):
        now = np.zeros(slips.shape) if is_first else np.clip(now + step[:, None], -slips, slips)
        wound[k] = now / slips
    way = np.sign(moves := came.steps[came.place])
    sign = way if data.direction is None else np.nan_to_num(data.direction)
    if ((way == sign) | (sign == 0.0) | (way == 0.0)).mean() <= AGREES:
        return None
    return Path(moves, sign, wound[came.place], came)
