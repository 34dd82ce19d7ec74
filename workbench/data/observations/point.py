"""One point of the tool in the measuring frame: a reflector, a ball in a socket, a touch probe."""

from typing import final

import numpy as np
from jaxtyping import Float

from workbench.data.observation import AbstractObservation, Channel, Linearised


@final
class PointObservation(AbstractObservation):
    """Residual p − p̂ of the tool's origin."""

    columns = ("position",)
    position: Float[np.ndarray, "rows 3"]

    channels = (Channel.POSITION,) * 3

    def linearise(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Linearised:
        by_twist = np.zeros((len(poses), 3, 6))
        by_twist[:, :, :3] = np.eye(3)
        return Linearised(self.position - poses[:, :3, 3], by_twist, np.zeros((len(poses), 3, 0)))
