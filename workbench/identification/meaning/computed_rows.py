"""Rows that an arm's model computed, such as targets that were filled in, among measured ones.

With the right base and tool it meets them to their last digit, as it does none that was measured: from
the place of most rows four of them tell both, to first order.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm import chain as chains
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.wording import in_mm, ranges
from workbench.data.dataset import Dataset
from workbench.identification.meaning.placement import place

EXACT, CLEARLY = 5e-6, 20.0
"""Distance [m] up to which a model meets rows that it computed, and by what factor others are farther."""
MIN_COMPUTED, MOST = 6, 0.65
"""Fewest of such rows, and their largest share: where more are, the others are wrong."""
TRIES, COUNTED = 1500, 200
"""Sets of four rows that are drawn, and rows among which those that go with them are counted."""


def without_computed(robot: Robot, data: Dataset) -> Dataset:
    """The rows without those that the arm's model computed, with a note.

    Raises:
        DataError: it computed some of their coordinates.
    """
    if data.position is None or data.joints != robot.dof:
        return data
    is_whole = data.included & np.isfinite(data.position).all(1) & np.isfinite(data.q).all(1)
    for name in data.sessions:
        rows = np.flatnonzero(data.in_session(name) & is_whole)
        if len(rows) < 2 * MIN_COMPUTED:
            continue
        turn, off = _linearised(robot, data.take(rows))
        usual = float(np.median(np.linalg.norm(off, axis=1)))
        if usual < CLEARLY * EXACT:
            continue
        drawn = [k for k in range(3) if np.abs(_left(turn[:, [k]], off[:, [k]])).max() < EXACT]
        met, others = (
            "the arm's model meets",
            f"{in_mm(EXACT)}, usual ones to {in_mm(usual)}: computed with it",
        )
        if 0 < len(drawn) < 3 and len(rows) > MIN_COMPUTED + turn.shape[2]:
            what = (
                f"{met} {', '.join('xyz'[k] for k in drawn)} of all rows to {others.replace('ones', 'rows')}"
            )
            raise DataError(f"{data.source}: {what}; give what was measured")
        found = rows[_exact(turn, off)]
        if MIN_COMPUTED <= len(found) <= MOST * len(rows):
            which = f"{len(found)} of {len(rows)} rows ({ranges(data.row[found].tolist())})"
            note = f"{met} {which} to {others}, not measured, and left out"
            data = replace(data, notes=(*data.notes, note))
            data = data.kept_out(dict.fromkeys(found.tolist(), "computed with the arm's model"))
    return data


def _linearised(
    robot: Robot, data: Dataset
) -> tuple[Float[np.ndarray, "rows 3 9"], Float[np.ndarray, "rows 3"]]:
    """How points move with base and tool, scaled, and how far they are from the best of those."""
    seen = np.asarray(data.position)
    at = place(robot.bare, data.q[None], seen[None], None)
    poses = at.base[0] @ chains.poses(robot.bare.chain, data.q) @ at.tool[0]
    points, turn = poses[:, :3, 3], poses[:, :3, :3]
    columns = [-se3.skew(points - points.mean(0)), np.broadcast_to(np.eye(3), turn.shape), turn]
    table = np.concatenate(columns, axis=2)
    return table / (np.linalg.norm(table, axis=(0, 1)) + EXACT), seen - points


def _left(table: np.ndarray, off: np.ndarray) -> np.ndarray:
    """What the best base and tool leave of some numbers."""
    flat = table.reshape(-1, table.shape[2])
    return off - (flat @ np.linalg.lstsq(flat, off.ravel(), rcond=1e-10)[0]).reshape(off.shape)


def _exact(
    table: Float[np.ndarray, "rows 3 9"], off: Float[np.ndarray, "rows 3"]
) -> Bool[np.ndarray, " rows"]:
    """The most rows that one base and tool meet exactly."""
    count, width = len(off), table.shape[2]
    some = np.random.default_rng(0).integers(0, count, (TRIES, 4))
    some = np.concatenate(
        [some, np.arange(count - 3)[:COUNTED, None] + np.arange(4)]
    )  # or one after the other
    own, wanted = table[some].reshape(len(some), 12, width), off[some].reshape(len(some), 12, 1)
    back = np.swapaxes(own, 1, 2)
    found = np.linalg.solve(back @ own + 1e-13 * np.eye(width), back @ wanted)[..., 0]
    few = np.linspace(0, count - 1, min(count, COUNTED)).astype(int)
    left = off[few].reshape(-1) - found @ table[few].reshape(-1, width).T
    near = (np.abs(left).reshape(len(found), -1, 3) < 10.0 * EXACT).all(2)
    best = found[near.sum(1).argmax()]
    for limit in (10.0, 4.0, 1.0):
        rows = (np.abs(off - table @ best) < limit * EXACT).all(1)
        best = np.linalg.lstsq(table[rows].reshape(-1, width), off[rows].ravel(), rcond=1e-10)[0]
    return (np.abs(off - table @ best) < EXACT).all(1)
