"""What the orientation columns of a file may mean."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from jaxtyping import Float

from workbench.data.dataset import Dataset
from workbench.data.orientations import ORIENTATIONS, USUAL_ORIENTATIONS

INVERSE, MIXED, UNIT, USUAL, RARE = 1.0, 1.2, 0.5, 0.3, 0.8
"""Complexity of an inverse, of columns in another order, of a unit, of a usual and of a rare convention."""
DEGREE, TURN = np.pi / 180.0, 2.0 * np.pi


@dataclass(frozen=True, eq=False)
class Convention:
    """One way to read the orientation columns."""

    text: str
    cost: float
    rotations: Float[np.ndarray, "rows 3 3"]


def conventions(data: Dataset) -> Iterator[Convention]:
    """All ways to read the orientation columns, the declared one first; equal ones once."""
    if data.rotation is None:
        return
    yield Convention("", 0.0, data.rotation)
    seen = [data.rotation]
    for text, cost, rotations in _readings_of_turns(data):
        if np.isfinite(rotations).all() and not any(np.abs(rotations - o).max() < 1e-6 for o in seen):
            seen.append(rotations)
            yield Convention(text, cost, rotations)


def _readings_of_turns(data: Dataset) -> Iterator[tuple[str, float, np.ndarray]]:
    assert data.rotation is not None
    yield (
        "the orientation is that of the base in the tool (transposed)",
        INVERSE,
        np.swapaxes(data.rotation, 1, 2),
    )
    if (written := data.written) is None:
        return
    largest = np.nanmax(np.abs(written.numbers), initial=0.0)
    units = [(1.0, "", 0.0)]
    if written.numbers.shape[1] == 3 and largest < TURN * 1.02 * DEGREE:
        units.append((1.0 / DEGREE, " in rad, not degrees", UNIT))
    elif written.numbers.shape[1] == 3 and largest > TURN:
        units.append((DEGREE, " in degrees, not rad", UNIT))
    for factor, unit, more in units:
        for kind in (k for k in ORIENTATIONS if k.numbers == written.numbers.shape[1]):
            cost = more + (
                0.0 if kind.name == written.name else USUAL if kind in USUAL_ORIENTATIONS else RARE
            )
            matrices = kind.matrices(factor * written.numbers)
            yield f"the orientation is {kind.text}{unit}", cost, matrices
            yield (
                f"the orientation is the inverse of {kind.text}{unit}",
                cost + INVERSE,
                np.swapaxes(matrices, 1, 2),
            )
            if kind.name.islower() and len(set(kind.name)) == 3:
                for order in list(permutations(range(3)))[1:]:
                    columns = ", ".join(str(k + 1) for k in order)
                    text = f"the orientation is {kind.text}{unit} of its columns {columns}"
                    yield text, cost + MIXED, kind.matrices(factor * written.numbers[:, order])
