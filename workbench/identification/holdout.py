"""Which rows are held out: spread over the joint space, whole groups, or whole sessions."""

import numpy as np
from jaxtyping import Int

from workbench.base.errors import DataError, OptionError
from workbench.data.dataset import Dataset


def split(
    data: Dataset, fraction: float, *, rng: np.random.Generator
) -> tuple[Int[np.ndarray, " train"], Int[np.ndarray, " held"]]:
    """Hold out a fraction of the rows, whole groups where the data have them.

    The units (rows, or means of groups) are divided by medians of their widest joint into as many cells
    as are to be held out, session by session; each cell gives one unit at random. The held-out rows are
    thus spread over the same joint space as the others, whatever the order of measurement was.

    Args:
        data: Rows to divide.
        fraction: Part to hold out, 0 ≤ fraction < 1.
        rng: Chooses the unit of every cell.

    Returns:
        Training rows and held-out rows, both in increasing order.

    Raises:
        OptionError: the fraction is no such part.
        DataError: too few units to hold out any and keep one.
    """
    if not 0.0 <= fraction < 1.0:
        raise OptionError(f"the held-out fraction must be at least 0 and less than 1, not {fraction:g}")
    everything = np.arange(len(data))
    if fraction == 0.0:
        return everything, everything[:0]
    labels = everything if data.group is None else np.unique(data.group, return_inverse=True)[1]
    count = int(labels.max()) + 1 if len(labels) else 0
    if count < 2:
        raise DataError(f"{data.source}: {count} rows or groups can't be divided; use a held-out share of 0")
    weight = np.bincount(labels)
    centre = np.stack([np.bincount(labels, column) / weight for column in data.q.T], axis=1)
    centre = centre / np.maximum(np.ptp(data.q, axis=0), 1e-9)
    session = np.zeros(count, int)
    if data.session is not None:
        session[labels] = np.unique(data.session, return_inverse=True)[1]
    if np.bincount(session).max() < 2:
        session[:] = 0  # sessions of one unit each: whole sessions are held out
    held = np.zeros(count, bool)
    for s, cells in enumerate(_shares(np.bincount(session), fraction)):
        for cell in _cells(centre, np.flatnonzero(session == s), int(cells)):
            held[rng.choice(cell)] = True
    mask = held[labels]
    return np.flatnonzero(~mask), np.flatnonzero(mask)


def split_sessions(
    data: Dataset, names: tuple[str, ...]
) -> tuple[Int[np.ndarray, " train"], Int[np.ndarray, " held"]]:
    """Hold out whole sessions by name."""
    if data.session is None:
        raise OptionError(f"{data.source} has no session column, so no session can be held out")
    if missing := [name for name in names if name not in data.sessions]:
        raise OptionError(f"{data.source} has no session '{missing[0]}'; it has {', '.join(data.sessions)}")
    mask = np.isin(data.session, names)
    return np.flatnonzero(~mask), np.flatnonzero(mask)


def _shares(sizes: np.ndarray, fraction: float) -> np.ndarray:
    """How many units of every session are held out: the share of all, divided as evenly as it goes."""
    total = max(round(fraction * int(sizes.sum())), 1)
    shares = np.minimum(np.floor(fraction * sizes), sizes - 1).astype(int)
    wanting = fraction * sizes - shares
    for s in np.argsort(-wanting, kind="stable"):
        if shares.sum() < total and shares[s] < sizes[s] - 1:
            shares[s] += 1
    return shares


def _cells(centre: np.ndarray, units: np.ndarray, count: int) -> list[np.ndarray]:
    """Divide units into cells of nearly equal size along their widest joint, again and again."""
    if count <= 1:
        return [units] if count else []
    widest = int(np.argmax(np.ptp(centre[units], axis=0)))
    order = units[np.argsort(centre[units, widest], kind="stable")]
    left = count // 2
    cut = round(len(order) * left / count)
    return _cells(centre, order[:cut], left) + _cells(centre, order[cut:], count - left)
