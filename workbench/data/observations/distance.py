"""Distance of the tool point from an anchor: ball bars and wire sensors."""

from typing import final

import numpy as np
from jaxtyping import Float

from workbench.data.observation import AbstractPlaceObservation, Channel, Linearised


@final
class DistanceObservation(AbstractPlaceObservation):
    """Residual l − |p̂ − c| with the anchor's unknown place c in the measuring frame."""

    distance: Float[np.ndarray, " rows"]
    columns = ("distance",)
    word = "anchor"
    unused_text = "distances"

    channels = (Channel.POSITION,)

    def start(self, poses: Float[np.ndarray, "rows 4 4"]) -> Float[np.ndarray, " u"]:
        guess = np.zeros((len(self.names), 3))
        for k in range(len(self.names)):
            mine = self.place == k
            p = poses[mine, :3, 3]
            matrix = np.column_stack([2 * p, np.ones(len(p))])
            guess[k] = np.linalg.lstsq(matrix, (p**2).sum(1) - self.distance[mine] ** 2, rcond=1e-9)[0][:3]
        return guess.ravel()

    def linearise(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Linearised:
        from_anchor = poses[:, :3, 3] - unknown.reshape(-1, 3)[self.place]
        length = np.maximum(np.linalg.norm(from_anchor, axis=1), 1e-12)
        direction = from_anchor / length[:, None]
        by_twist = np.concatenate([direction, np.zeros_like(direction)], axis=1)[:, None]
        return Linearised((self.distance - length)[:, None], by_twist, self.by_place(-direction[:, None]))
