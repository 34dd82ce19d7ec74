"""The pose of the tool in the measuring frame, or the position alone."""

from typing import final

import numpy as np
from jaxtyping import Float

from workbench.base import se3
from workbench.data.dataset import Dataset
from workbench.data.observation import AbstractObservation, Channel, Linearised


@final
class PoseObservation(AbstractObservation):
    """Residual [p − p̂; log(R R̂ᵀ)] of a 6D probe or a seat; ARIA eqs. (15), (16) to first order."""

    columns = ("position", "rotation")
    poses: Float[np.ndarray, "rows 4 4"]
    sees_tool_rotation = True
    channels = (Channel.POSITION,) * 3 + (Channel.ROTATION,) * 3

    @classmethod
    def of(cls, data: Dataset) -> "PoseObservation":
        return cls(se3.pose(np.asarray(data.rotation), np.asarray(data.position)))

    def linearise(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Linearised:
        residual = se3.pose_error(self.poses, poses)
        by_twist = np.eye(6) + np.zeros((len(poses), 1, 1))
        by_twist[:, 3:, 3:] = se3.left_jacobian_inverse(-residual[:, 3:])
        return Linearised(residual, by_twist, np.zeros((len(poses), 6, 0)))


@final
class PointObservation(AbstractObservation):
    """Residual p − p̂ of the tool's origin, as a reflector, a ball in a socket or a touch probe gives it."""

    columns = ("position",)
    position: Float[np.ndarray, "rows 3"]
    channels = (Channel.POSITION,) * 3

    def linearise(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Linearised:
        by_twist = np.eye(6)[:3] + np.zeros((len(poses), 1, 1))
        return Linearised(self.position - poses[:, :3, 3], by_twist, np.zeros((len(poses), 3, 0)))
