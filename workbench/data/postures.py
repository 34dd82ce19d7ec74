"""Which rows are one posture: measurements of it repeat each other, whatever instrument made them.

Joints that are read scatter, commanded ones are equal to the last digit, and nobody states which. The
distances of rows to their nearest neighbours, the largest difference of a joint, fall into two heaps: repeats
and other postures. The widest empty stretch between them, in decades, is the tolerance. Rows that hang
together in a chain, as on a slow path, are different postures; of these only equal ones belong together.
"""

from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from workbench.base.types import frozen
from workbench.data.dataset import Dataset

MAX_SCATTER = float(np.radians(0.05))
"""Maximum difference of a joint [rad or m] between rows of one posture."""
EQUAL = 1e-9
"""Difference below which joints are equal."""
NEIGHBOURS, FARTHEST = 8, 20.0 * MAX_SCATTER
"""Number of neighbours of a row that are compared, and their maximum distance."""
MIN_GAP = 0.5
"""Minimum width in decades of the stretch between the two heaps."""
MAX_SPREAD = 8.0
"""Tolerances that rows of one posture may spread; beyond it they are a chain."""


def postures(q: Float[np.ndarray, "rows n"]) -> Int[np.ndarray, " rows"]:
    """Number of each row's posture, in no particular order, from joint positions [rad or m]."""
    from scipy.spatial import cKDTree

    if len(q) and np.ptp(q, axis=0).max(initial=0.0) < MAX_SCATTER:  # whatever their distances
        return np.zeros(len(q), int)
    rounded = np.round(q / EQUAL)
    row, first = equal_rows(rounded)
    if len(first) < 2:
        return row
    once = EQUAL * rounded[first]
    few = (np.searchsorted(once[:, 0], once[:, 0] + MAX_SCATTER) - np.arange(len(once))).max()
    steps = range(1, few) if few <= NEIGHBOURS and len(once) == len(q) else [0]  # by the first joint
    if all(np.abs(once[k:] - once[: len(once) - k]).max(1).min() >= MAX_SCATTER for k in steps):
        return row
    count = min(NEIGHBOURS + 1, len(once))
    found = cKDTree(once).query(once, k=count, p=np.inf, distance_upper_bound=FARTHEST)
    distance, other = (table[:, 1:] for table in found)
    shown = np.append(distance[np.isfinite(distance)], [EQUAL] * (len(once) < len(q)))
    edges = np.append(np.sort(np.maximum(shown, EQUAL)), FARTHEST)
    gaps, tolerance = np.where(edges[:-1] < MAX_SCATTER, np.diff(np.log10(edges)), 0.0), EQUAL
    if gaps.max(initial=0.0) >= MIN_GAP:
        widest = int(np.argmax(gaps))
        tolerance = min(MAX_SCATTER, float(np.sqrt(edges[widest] * edges[widest + 1])))
    near = np.nonzero(distance <= tolerance)
    graph = coo_matrix((np.ones(len(near[0])), (near[0], other[near])), (len(once), len(once)))
    label = connected_components(graph, directed=False)[1]
    order = np.argsort(label, kind="stable")
    starts = np.flatnonzero(np.diff(label[order], prepend=-1))
    spread = (np.maximum.reduceat(once[order], starts) - np.minimum.reduceat(once[order], starts)).max(1)
    is_chain = spread[label] > MAX_SPREAD * tolerance
    label[is_chain] = len(once) + np.flatnonzero(is_chain)
    return np.unique(label, return_inverse=True)[1][row]


def pose_units(data: Dataset) -> Int[np.ndarray, " rows"]:
    """Number of each row's unit: rows of one posture in a session, or of one group, are held out together.

    Groups only make units larger. Units are numbered by their first rows, or by the names of their groups.
    """
    unit = _together(postures(data.q), data.session)
    if data.group is None or (data.group == data.group[:1]).all():  # a name of all rows says nothing
        return _numbered(unit, np.arange(len(data)))
    group = np.unique(data.group, return_inverse=True)[1]
    size = len(data) + int(group.max(initial=0)) + 1
    links = coo_matrix((np.ones(len(data)), (unit, len(data) + group)), (size, size))
    return _numbered(connected_components(links, directed=False)[1][unit], group)


@lru_cache(maxsize=4)
def repeats(data: Dataset) -> Int[np.ndarray, " rows"]:
    """Number of each row's posture, point, anchor and contact: for a geometric fit its rows are one."""
    return frozen(_together(postures(data.q), data.session, data.point, data.anchor, data.contact))


def within_postures(q: Float[np.ndarray, "rows n"], table: Float[np.ndarray, "rows k"]) -> np.ndarray:
    """What a table differs by from its mean at each posture; 0 where that isn't repeated."""
    unit = postures(q)
    counts = np.bincount(unit)
    means = np.array([np.bincount(unit, column) / counts for column in table.T]).T
    return np.where(counts[unit, None] > 1, table - means[unit], 0.0)


def repeats_text(data: Dataset) -> str:
    """`22 poses, 6 readings each`; empty where no posture repeats."""
    counts = np.bincount(_together(postures(data.q), data.session))
    if len(counts) == len(data):
        return ""
    few, many = int(counts.min()), int(counts.max())
    each = f"{many} readings each" if few == many else f"{few} to {many} readings each"
    return f"{len(counts)} poses, {each}"


def equal_rows(table: np.ndarray) -> tuple[Int[np.ndarray, " rows"], Int[np.ndarray, " once"]]:
    """Number of each row among the ordered different ones, and their first rows: `numpy.unique` is slower."""
    order = np.lexsort(table.T[:1] if len(np.unique(table[:, 0])) == len(table) else table.T[::-1])
    is_new = np.append(True, (table[order[1:]] != table[order[:-1]]).any(1))[: len(order)]
    return (np.cumsum(is_new) - 1)[np.argsort(order)], order[is_new]


def _numbered(label: np.ndarray, order: np.ndarray) -> Int[np.ndarray, " rows"]:
    """Labels renumbered by the smallest place of their rows in an order."""
    label = np.unique(label, return_inverse=True)[1]
    first = np.full(int(label.max(initial=-1)) + 1, len(label))
    np.minimum.at(first, label, order)
    return np.argsort(np.argsort(first, kind="stable"))[label]


def _together(*labels: np.ndarray | None) -> Int[np.ndarray, " rows"]:
    """Number of each row's combination of the labels that there are."""
    numbers = [np.unique(label, return_inverse=True)[1] for label in labels if label is not None]
    return equal_rows(np.stack(numbers, axis=1))[0] if len(numbers) > 1 else numbers[0]
