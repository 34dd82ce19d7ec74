"""Whether torque columns are of the drives, which hold the arm, or of the load, as some controllers show."""

from dataclasses import replace

import numpy as np

from workbench.arm.kinematics.forward import geometric_jacobian
from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.data.postures import within_postures

SURE = 0.8
"""Minimum correlation with the torque that holds a weight at the flange."""


def with_holding_torques(robot: Robot, data: Dataset) -> Dataset:
    """The rows with torques of the drives, with a note where the columns have the opposite sign.

    The weight at the flange is the payload, compared at the same postures, or else that of the links. An arm
    with masses needs no measured torques.
    """
    if (shown := data.torque) is None:
        return data
    torque = shown
    if robot.has_masses or torque.shape[1] != robot.dof or not np.isfinite(torque).all():
        return data
    expected = -np.einsum("rij,i->rj", geometric_jacobian(robot.bare, data.q)[:, :3], robot.gravity)
    if data.payload is not None and np.isfinite(data.payload).all():
        change = within_postures(data.q, data.payload[:, None])
        if change.any():
            expected, torque = change * expected, within_postures(data.q, torque)
    size = np.linalg.norm(expected) * np.linalg.norm(torque)
    if not size or (expected * torque).sum() > -SURE * size:
        return data
    note = "torque1 … have the sign of the load; read as the torques of the drives, which hold it"
    return replace(data, torque=-shown, notes=(*data.notes, note))
