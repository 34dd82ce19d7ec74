"""Rows that tell what a file means."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Int

from workbench.arm import chain as chains
from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.identification.errors.row_errors import quantile

MIN_ROWS = 6
"""Minimum number of rows with a point to search for readings."""
MIN_BEYOND = 30
"""The same of numbers, of sessions with fewer rows, beyond those that place each of them."""
STAYS = 0.1
"""Change of a rotation matrix's entries that an arm's own turn exceeds."""
PLACED_ROWS = 60
"""Rows that are enough to place a reading."""


def usable(data: Dataset) -> Dataset | None:
    """Rows with a point, and orientation where those have one, of the session and socket that has most."""
    if data.position is None and data.markers is not None:
        data = replace(data, position=data.markers[:, np.isfinite(data.markers).all(2).sum(0).argmax()])
    if data.position is None:
        return None
    rows = _located(data)
    for names in (data.session, data.point):
        if names is not None and rows.any():
            values, counts = np.unique(names[rows], return_counts=True)
            if names is data.session or counts.max() >= MIN_ROWS:  # else each posture has its name
                rows = rows & (names == values[np.argmax(counts)])
    kept = data if rows.all() else data.take(rows)
    if kept.rotation is not None and not np.isfinite(kept.rotation).all():
        kept = replace(kept, rotation=None, written=None)
    if len(kept) < MIN_ROWS:
        return None
    points = np.asarray(kept.position)
    away = np.linalg.norm(points - quantile(points, 0.5), axis=1)
    near = away <= 20.0 * quantile(away, 0.5) + 1e-9
    return kept if near.all() else kept.take(near)


def without_still_turns(robot: Robot, data: Dataset) -> Dataset:
    """The rows without an orientation that stays the same while the arm turns: it was not measured."""
    if data.rotation is None or data.joints != robot.dof:
        return data
    rows = data.included & np.isfinite(data.rotation).all((1, 2)) & np.isfinite(data.q).all(1)
    is_still = rows.sum() >= MIN_ROWS and not np.ptp(data.rotation[rows], axis=0).any()
    if not is_still or np.ptp(chains.poses(robot.bare.chain, data.q[rows])[:, :3, :3], axis=0).max() < STAYS:
        return data
    note = "the orientation is the same in all rows, while the arm turns: it wasn't measured, and is left out"
    return replace(data, rotation=None, written=None, notes=(*data.notes, note))


def few_each(data: Dataset) -> tuple[Dataset, int]:
    """Equally many rows of each session, one after the other, where none has enough, and how many sessions;
    none where all together have too few numbers beyond their bases and tools."""
    if data.position is None or data.session is None or not (rows := _located(data)).any():
        return data, 0
    turned = data.rotation is not None and np.isfinite(data.rotation[rows]).all()
    own, unknown = (6, 12) if turned else (3, 9)
    _, name, counts = np.unique(data.session[rows], return_inverse=True, return_counts=True)
    size = int(np.median(counts))
    chosen = np.flatnonzero(counts >= size)[: PLACED_ROWS // size]
    some = [np.flatnonzero(rows)[name == k][:size] for k in chosen]
    if (own * size - unknown) * len(some) < MIN_BEYOND:
        return data, 0
    kept = data.take(np.concatenate(some))
    return kept if turned else replace(kept, rotation=None, written=None), len(some)


def _located(data: Dataset) -> Bool[np.ndarray, " rows"]:
    """Rows with a point, and an orientation if enough have one."""
    rows = data.included & np.isfinite(np.asarray(data.position)).all(1) & np.isfinite(data.q).all(1)
    if data.rotation is None:
        return rows
    turned = rows & np.isfinite(data.rotation).all((1, 2))
    return turned if turned.sum() >= MIN_ROWS else rows


def far_apart(data: Dataset, count: int) -> Int[np.ndarray, " k"]:
    """Rows far apart in joints and points, at most so many."""
    if len(data) <= count:
        return np.arange(len(data))
    points = np.asarray(data.position)
    table = np.column_stack([data.q / (data.q.std(0) + 1e-9), points / (points.std() + 1e-9)])
    table = np.clip(table - np.median(table, axis=0), -4.0, 4.0)
    size, distance, twice = (table**2).sum(1), np.full(len(table), np.inf), 2.0 * table
    chosen = [int(size.argmin())]
    for _ in range(count - 1):
        last = chosen[-1]
        np.minimum(distance, size + (size[last] - twice @ table[last]), out=distance)
        chosen.append(int(distance.argmax()))
    return np.array(sorted(chosen))
