"""Several markers on the tool, whose places on it are unknown and found with the robot."""

from typing import final

import numpy as np
from jaxtyping import Bool, Float

from workbench.base import se3
from workbench.data.dataset import Dataset
from workbench.data.observation import AbstractObservation, Channel, Linearised


@final
class MarkerObservation(AbstractObservation):
    """Residual of every marker, m_k − (p̂ + R̂ u_k) with its unknown place u_k in the tool frame.

    The tool frame itself is then a free choice: hold it at its nominal pose. Hidden markers (NaN) have
    zero residual and zero derivative.
    """

    measured: Float[np.ndarray, "rows markers 3"]

    columns = ("markers",)
    unused_text = "markers"
    is_tool_free = True

    @property
    def channels(self) -> tuple[Channel, ...]:
        return (Channel.POSITION,) * (3 * self.measured.shape[1])

    @classmethod
    def applies(cls, data: Dataset) -> Bool[np.ndarray, " rows"]:
        if data.markers is None:
            return np.zeros(len(data), bool)
        return np.isfinite(data.markers).all(-1).any(-1)

    @property
    def seen(self) -> Bool[np.ndarray, "..."]:
        return np.repeat(np.isfinite(self.measured).all(-1), 3, axis=1)

    @property
    def unknowns(self) -> tuple[str, ...]:
        return tuple(f"marker{k + 1}.{axis}" for k in range(self.measured.shape[1]) for axis in "xyz")

    def start(self, poses: Float[np.ndarray, "rows 4 4"]) -> Float[np.ndarray, " u"]:
        local = se3.apply(se3.inverse(poses)[:, None], self.measured)
        return np.ma.masked_invalid(local).mean(0).filled(0.0).ravel()

    def linearise(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Linearised:
        rows, count = self.measured.shape[:2]
        arm = (poses[:, None, :3, :3] @ unknown.reshape(count, 3)[None, :, :, None])[..., 0]
        seen = np.isfinite(self.measured).all(-1)[..., None]
        residual = np.where(seen, self.measured - poses[:, None, :3, 3] - arm, 0.0)
        by_twist = np.concatenate([np.broadcast_to(np.eye(3), (rows, count, 3, 3)), -se3.skew(arm)], axis=-1)
        by_twist = np.where(seen[..., None], by_twist, 0.0)
        by_unknown = np.einsum("rm,rij,mn->rminj", 1.0 * seen[..., 0], poses[:, :3, :3], np.eye(count))
        to = (rows, 3 * count)
        return Linearised(residual.reshape(to), by_twist.reshape(*to, 6), by_unknown.reshape(*to, 3 * count))
