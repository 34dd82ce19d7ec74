"""Full pose: position and orientation of the tool, as a 6D probe or a seat on a plate gives them."""

from typing import final

import numpy as np
from jaxtyping import Float

from workbench.base import se3
from workbench.data.dataset import Dataset
from workbench.data.observation import AbstractObservation, Channel, Linearised


@final
class PoseObservation(AbstractObservation):
    """Residual [p − p̂; log(R R̂ᵀ)] in the measuring frame; ARIA eqs. (15), (16) to first order."""

    columns = ("position", "rotation")
    poses: Float[np.ndarray, "rows 4 4"]
    sees_tool_rotation = True

    channels = (Channel.POSITION,) * 3 + (Channel.ROTATION,) * 3

    @classmethod
    def of(cls, data: Dataset) -> "PoseObservation":
        return cls(se3.pose(np.asarray(data.rotation), np.asarray(data.position)))

    def linearise(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Linearised:
        residual = se3.pose_error(self.poses, poses)
        by_twist = np.zeros((len(poses), 6, 6))
        by_twist[:, :3, :3] = np.eye(3)
        by_twist[:, 3:, 3:] = se3.left_jacobian_inverse(-residual[:, 3:])
        return Linearised(residual, by_twist, np.zeros((len(poses), 6, 0)))
