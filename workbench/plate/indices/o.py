"""O, the paper's index of one pose: how evenly that pose alone shows the parameters it can show.

    O(q) = σmin(J(q)) / σmax(J(q))                                          ARIA eq. (17)

A pose has six rows, so of its p > 6 parameters it shows six combinations, and σ1 … σ6 are meant. As in
the paper J is unscaled: metres and radians stand side by side, and the value depends on that unit. For a
set this package takes the mean over its poses: O says nothing about the set as a whole (ten identical
poses of high O see six combinations only), for which O1 … O5 are there.
"""

from collections.abc import Iterator
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.linearisation import Linearisation
from workbench.plate.indices.index import AbstractIndex

ROUND = 1e-3
"""Above this value the squares in J Jᵀ leave O at least ten digits; below it the slower SVD is taken."""


def of_poses(jacobians: Float[np.ndarray, "rows r p"]) -> Float[np.ndarray, " rows"]:
    """O of each pose from its unscaled Jacobian; zero where all singular values are."""
    squares = np.linalg.eigvalsh(jacobians @ jacobians.transpose(0, 2, 1))
    tiny = np.finfo(float).tiny
    result = np.sqrt(np.maximum(squares[:, 0], 0.0) / np.maximum(squares[:, -1], tiny))
    flat = result < ROUND
    if flat.any():
        values = np.linalg.svd(jacobians[flat], compute_uv=False)
        result[flat] = values[:, -1] / np.maximum(values[:, 0], tiny)
    return result


def gradient_of_poses(
    jacobians: Float[np.ndarray, "rows r p"],
) -> tuple[Float[np.ndarray, " rows"], Float[np.ndarray, "rows r p"]]:
    """O of each pose, and its derivative by each entry of the pose's Jacobian."""
    u, values, vt = np.linalg.svd(jacobians, full_matrices=False)
    least, most = values[:, -1], np.maximum(values[:, 0], np.finfo(float).tiny)
    by_least = u[:, :, -1, None] * vt[:, None, -1] / most[:, None, None]
    by_most = u[:, :, 0, None] * vt[:, None, 0] * (least / most**2)[:, None, None]
    return least / most, by_least - by_most


@final
class O(AbstractIndex):  # noqa: E742 - the paper's name
    """Inverse condition number of single poses, unscaled; for a set their mean."""

    name = "O"
    meaning = "inverse condition number of each pose alone, mean over the poses, unscaled"
    source = "ARIA eq. (17), after Borm & Menq, Int. J. Robotics Research 10(1), 1991"

    def value(self, linearisation: Linearisation) -> float:
        values = self.per_pose(linearisation)
        return float(values.mean()) if len(values) else 0.0

    def per_pose(self, linearisation: Linearisation) -> Float[np.ndarray, " measurements"]:
        """O of each pose."""
        result = np.zeros(linearisation.measurements)
        for poses, blocks in _blocks(linearisation):
            result[poses] = of_poses(linearisation.unwhitened[blocks])
        return result

    def gradient(self, linearisation: Linearisation) -> Float[np.ndarray, "m p"]:
        gradient = np.zeros_like(linearisation.jacobian)
        for _, blocks in _blocks(linearisation):
            gradient[blocks] = gradient_of_poses(linearisation.unwhitened[blocks])[1]
        return gradient * (linearisation.sigma[:, None] / max(linearisation.measurements, 1))

    def contributions(self, linearisation: Linearisation) -> Float[np.ndarray, " measurements"]:
        values = self.per_pose(linearisation)
        rest = (values.sum() - values) / max(len(values) - 1, 1)
        return values.mean() - rest


def _blocks(linearisation: Linearisation) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Poses with equally many rows (six of a pose, three of a point), and the rows of each."""
    counts = np.bincount(linearisation.measurement)
    for count in np.unique(counts):
        poses = np.flatnonzero(counts == count)
        yield poses, np.searchsorted(linearisation.measurement, poses)[:, None] + np.arange(count)
