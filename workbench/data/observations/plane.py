"""Contact of the tool point with planes that stay where they are, wherever that is.

A contact whose name begins with `plane` is one with a plane. A plane is named by its foot f, the point of it
that is nearest to a reference point r: f has three coordinates in metres and no singular orientation.

    residual = |f − r| − n·(p̂ − r),      n = (f − r)/|f − r|

Source: derived here; contact planes of this kind in Ikits & Hollerbach, IEEE ICRA 1997.
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.base.types import frozen
from workbench.data.dataset import Dataset
from workbench.data.observations.contact import touches_plane
from workbench.data.observations.observation import AbstractObservation, Channel, Seen

REFERENCE = frozen(np.array([-1.0, -1.0, -1.0]))
"""r in the measuring frame [m]; planes through it have no foot, and none that an arm touches goes there."""


@final
@dataclass(frozen=True, eq=False)
class PlaneObservation(AbstractObservation):
    """Distance of the tool point from the touched plane, whose foot is unknown."""

    plane: Int[np.ndarray, " rows"]
    names: tuple[str, ...]
    sees_base = False

    unused_words = "contacts with planes"

    @property
    def channels(self) -> tuple[Channel, ...]:
        return (Channel.POSITION,)

    @classmethod
    def applies(cls, data: Dataset) -> Bool[np.ndarray, " rows"]:
        if data.contact is None:
            return np.zeros(len(data), bool)
        return touches_plane(data.contact)

    @classmethod
    def of(cls, data: Dataset) -> "PlaneObservation":
        names, index = np.unique(np.asarray(data.contact), return_inverse=True)
        return cls(frozen(index.astype(np.int64)), tuple(names.tolist()))

    @property
    def unknowns(self) -> tuple[str, ...]:
        return tuple(f"contact[{name}].{axis}" for name in self.names for axis in "xyz")

    def start(self, poses: Float[np.ndarray, "rows 4 4"]) -> Float[np.ndarray, " u"]:
        feet = []
        for k in range(len(self.names)):
            points = poses[self.plane == k, :3, 3] - REFERENCE
            middle = points.mean(axis=0)
            normal = np.linalg.svd(points - middle)[2][-1]
            feet.append(REFERENCE + normal * (normal @ middle))
        return np.concatenate(feet)

    def see(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Seen:
        rows = np.arange(len(poses))
        foot = unknown.reshape(-1, 3)[self.plane] - REFERENCE
        length = np.maximum(np.linalg.norm(foot, axis=1), 1e-12)
        normal = foot / length[:, None]
        tip = poses[:, :3, 3] - REFERENCE
        height = (normal * tip).sum(axis=1)
        by_twist = np.concatenate([normal, np.zeros_like(normal)], axis=1)[:, None]
        by_unknown = np.zeros((len(poses), 1, len(self.names), 3))
        by_unknown[rows, 0, self.plane] = (tip - height[:, None] * normal) / length[:, None] - normal
        return Seen((length - height)[:, None], by_twist, by_unknown.reshape(len(poses), 1, -1))
