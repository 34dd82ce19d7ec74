"""Distance of the tool point from an anchor: ball bars and wire sensors."""

from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.base.types import frozen
from workbench.data.dataset import Dataset
from workbench.data.observations.observation import AbstractObservation, Channel, Seen


@final
@dataclass(frozen=True, eq=False)
class DistanceObservation(AbstractObservation):
    """Residual l − |p̂ − c| with the anchor's unknown place c in the measuring frame."""

    distance: Float[np.ndarray, " rows"]
    anchor: Int[np.ndarray, " rows"]
    names: tuple[str, ...]
    sees_base = False

    unused_words = "distances"

    @property
    def channels(self) -> tuple[Channel, ...]:
        return (Channel.POSITION,)

    @classmethod
    def applies(cls, data: Dataset) -> Bool[np.ndarray, " rows"]:
        return np.zeros(len(data), bool) if data.distance is None else np.isfinite(data.distance)

    @classmethod
    def of(cls, data: Dataset) -> "DistanceObservation":
        labels = np.full(len(data), "anchor") if data.anchor is None else data.anchor
        names, index = np.unique(labels, return_inverse=True)
        return cls(np.asarray(data.distance), frozen(index.astype(np.int64)), tuple(names.tolist()))

    @property
    def unknowns(self) -> tuple[str, ...]:
        return tuple(f"anchor[{name}].{axis}" for name in self.names for axis in "xyz")

    def start(self, poses: Float[np.ndarray, "rows 4 4"]) -> Float[np.ndarray, " u"]:
        guess = np.zeros((len(self.names), 3))
        for k in range(len(self.names)):
            mine = self.anchor == k
            p = poses[mine, :3, 3]
            matrix = np.column_stack([2 * p, np.ones(len(p))])
            guess[k] = np.linalg.lstsq(matrix, (p**2).sum(1) - self.distance[mine] ** 2, rcond=1e-9)[0][:3]
        return guess.ravel()

    def see(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Seen:
        from_anchor = poses[:, :3, 3] - unknown.reshape(-1, 3)[self.anchor]
        length = np.maximum(np.linalg.norm(from_anchor, axis=1), 1e-12)
        direction = from_anchor / length[:, None]
        rows = np.arange(len(poses))
        by_unknown = np.zeros((len(poses), 1, len(self.names), 3))
        by_unknown[rows, 0, self.anchor] = -direction
        by_twist = np.concatenate([direction, np.zeros_like(direction)], axis=1)[:, None]
        return Seen((self.distance - length)[:, None], by_twist, by_unknown.reshape(len(poses), 1, -1))
