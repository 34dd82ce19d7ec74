"""Markers of one body whose names were exchanged in some rows, as their distances tell without any arm."""

from dataclasses import replace
from itertools import permutations

import numpy as np

from workbench.base.wording import ranges
from workbench.data.dataset import Dataset

CLEARLY, AGREES = 5.0, 0.02
"""How many times farther from the body other orders must be, and the difference of distances, as a share of
the shortest, up to which two rows are of one order."""
MOST_NAMES, COMPARED, MOST = 6, 300, 0.8
"""Most markers whose orders are tried, rows that are compared with each other, and the share of whole ones
that must be of the body in some order."""


def with_own_names(data: Dataset) -> Dataset:
    """The rows with markers in the order that most have, with a note on those that had another; rows that
    can't tell, as few markers are seen, have that of those about them."""
    if data.markers is None or not 3 <= data.markers.shape[1] <= MOST_NAMES:
        return data
    i, j = np.triu_indices(data.markers.shape[1], 1)
    far = np.linalg.norm(data.markers[:, :, None] - data.markers[:, None], axis=3)
    plain = far[data.included & np.isfinite(far).all((1, 2))][:, i, j]
    if not len(some := plain[:: 1 + len(plain) // COMPARED]):
        return data
    near = AGREES * float(np.median(some, axis=0).min())
    alike = np.abs(some[:, None] - some).max(2) < near
    body = np.median(some[alike[alike.sum(1).argmax()]], axis=0)
    if (np.abs(plain - body) < near).all():
        return data
    orders = np.array([*permutations(range(data.markers.shape[1]))])
    off = np.array([np.nan_to_num(np.abs(far[:, o[i], o[j]] - body)).max(1) for o in orders])
    whole = np.isfinite(far).all((1, 2))
    for rows in (whole, np.ones(len(far), bool)):  # orders of whole rows first
        least, other = np.partition(off, 1, axis=0)[:2]
        told = np.flatnonzero(rows & (least < near) & (CLEARLY * least < other))
        used = np.unique([0, *off[:, told].argmin(0)])
        orders, off = orders[used], off[used]
        if len(used) == 1 or len(told) < MOST * whole.sum():
            return data
    best = off.argmin(0)
    before, after = (np.searchsorted(told, np.arange(len(far)), side) for side in ("right", "left"))
    before, after = best[told[np.maximum(before - 1, 0)]], best[told[np.minimum(after, len(told) - 1)]]
    best = np.where(before == after, before, 0)
    notes = list[str]()
    for k in range(1, len(orders)):
        names = " and ".join(str(m + 1) for m in np.flatnonzero(orders[k] != orders[0]))
        notes.append(f"markers {names} are exchanged in rows {ranges(data.row[best == k].tolist())}")
    markers = np.take_along_axis(data.markers, orders[best][:, :, None], axis=1)
    told_so = f"{'; '.join(notes)}, as their distances tell; read so"
    return replace(data, markers=markers, notes=(*data.notes, told_so))
