"""Rows that an arm's model computed, such as targets that were filled in, among measured ones.

With the right base and tool it meets them to their last digit, as it does none that was measured: from
the place of most rows four of them tell both, to first order.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Bool

from workbench.arm import chain as chains
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.wording import in_mm, ranges
from workbench.data.dataset import Dataset
from workbench.data.postures import postures
from workbench.identification.meaning.placement import place

EXACT, CLEARLY = 5e-6, 20.0
"""Distance [m] up to which a model meets rows that it computed, and by what factor others are farther."""
MIN_ROWS, MIN_COMPUTED, MOST = 16, 6, 0.65
"""Fewest postures that are asked, and of such rows, and their largest share: of more others are wrong."""
TRIES, COUNTED = 1000, 200
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
        posture = postures(data.q[rows])
        if (
            len({*posture}) < MIN_ROWS
            or (usual := (met := _met(robot, data.take(rows)))[0]) < CLEARLY * EXACT
        ):
            continue
        how = f"to {in_mm(EXACT)}, usual rows to {in_mm(usual)}: computed with it"
        if 0 < len(axes := met[1]) < 3:
            text = f"the arm's model meets {', '.join(axes)} of all rows {how}; give what was measured"
            raise DataError(f"{data.source}: {text}")
        found = rows[met[2]]
        if len({*posture[met[2]]}) >= MIN_COMPUTED and len(found) <= MOST * len(rows):
            which = f"{len(found)} of {len(rows)} rows ({ranges(data.row[found].tolist())})"
            note = f"the arm's model meets {which} {how}, not measured, and left out"
            data = replace(data, notes=(*data.notes, note))
            data = data.kept_out(dict.fromkeys(found.tolist(), "computed with the arm's model"))
    return data


def _met(robot: Robot, data: Dataset) -> tuple[float, list[str], Bool[np.ndarray, " rows"]]:
    """How far usual rows are from the best base and tool [m]; axes of which one base and tool meet all
    coordinates exactly; and the most rows that one meets so."""
    seen, rng = np.asarray(data.position), np.random.default_rng(0)
    few = np.linspace(0, len(seen) - 1, min(len(seen), COUNTED)).astype(int)
    at = place(robot.bare, data.q[None, few], seen[None, few], None)
    poses = at.base[0] @ chains.poses(robot.bare.chain, data.q) @ at.tool[0]
    points, turn = poses[:, :3, 3], poses[:, :3, :3]
    table = np.concatenate([-se3.skew(points - points.mean(0)), 0.0 * turn + np.eye(3), turn], axis=2)
    table, off = table / (np.linalg.norm(table, axis=(0, 1)) + EXACT), seen - points

    def left(some: Any) -> np.ndarray:
        flat = table[some].reshape(-1, table.shape[2]), off[some].ravel()
        return np.abs(off - table @ np.linalg.lstsq(*flat, rcond=1e-10)[0])

    axes = ["xyz"[k] for k in range(3) if left(np.s_[few, k])[:, k].max() < EXACT]
    some = rng.integers(0, len(off), (TRIES, 4))
    some = np.concatenate([some, np.arange(len(off) - 3)[:COUNTED, None] + np.arange(4)])  # or in a row
    own, wanted = table[some].reshape(len(some), 12, -1), off[some].reshape(len(some), 12, 1)
    back = np.swapaxes(own, 1, 2)
    found = np.linalg.solve(back @ own + 1e-13 * np.eye(own.shape[2]), back @ wanted)[..., 0]
    near = (np.abs(off[few] - np.moveaxis(table[few] @ found.T, 2, 0)) < 10.0 * EXACT).all(2).sum(1)
    away = np.abs(off - table @ found[near.argmax()])
    for limit in (10.0, 4.0, 1.0) if near.max() > 4 else ():
        away = left((away < limit * EXACT).all(1))
    return float(np.median(np.linalg.norm(off, axis=1))), axes, (away < EXACT).all(1)
