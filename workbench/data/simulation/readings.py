"""What instruments read of an arm: columns of a dataset with noise in them."""

from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.arm.gravity import level_axes
from workbench.arm.kinematics.forward import link_frames
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import Vector3
from workbench.data.observations.tilt import reading, seen_from
from workbench.data.simulation.instruments import Instrument, Observes

ANCHOR_CIRCLE = 0.6
"""Radius of the circle of three anchors about the base where none are given, as a share of the reach."""


def readings(
    instrument: Instrument,
    arm: Robot,
    motion: Motion,
    poses: Float[np.ndarray, "rows 4 4"],
    rng: np.random.Generator,
) -> dict[str, Any]:
    """The columns of a dataset that an instrument fills, at poses of an arm in the measuring frame."""
    observes, rows, (sigma, turn) = instrument.observes, len(poses), instrument.deviations
    if observes is Observes.TILT:
        return {"tilt": _tilts(arm, motion, turn or 0.0, rng)}
    if observes in (Observes.MARKERS, Observes.RIGID_BODY):
        return _markers(instrument, poses, rng)
    if observes is Observes.DISTANCE:
        anchors = three_anchors(arm)
        names = np.array(list(anchors))
        places = np.stack([anchors[name] for name in names])
        taken = np.arange(rows) % len(names)
        distances = np.linalg.norm(poses[:, :3, 3] - places[taken], axis=1)
        return {"distance": distances + rng.normal(0.0, sigma, rows), "anchor": names[taken]}
    columns = {"position": poses[:, :3, 3] + rng.normal(0.0, sigma, (rows, 3))}
    if observes is Observes.POSE:
        turns = se3.rotvec_to_matrix(rng.normal(0.0, turn or 0.0, (rows, 3)))
        columns["rotation"] = turns @ poses[:, :3, :3]
    return columns


def _tilts(
    arm: Robot, motion: Motion, turn: float, rng: np.random.Generator
) -> dict[int, Float[np.ndarray, "rows 2"]]:
    """Readings of an inclinometer on every moving link [rad], by link: `data/observations/tilt.py`.

    The noise turns what it sees as upwards about the two axes across that.
    """
    moving = [i for i, joint in enumerate(arm.joints) if joint.kind != "fixed"]
    frames, level, out = link_frames(arm, motion), level_axes(arm.gravity) @ arm.base.rotation.T, {}
    for number, joint in enumerate(moving, start=1):
        up = seen_from(level @ frames[:, 1 + joint, :3, :3])
        seen = up + np.cross(rng.normal(0.0, turn, up.shape), up)
        out[number] = reading(seen / np.linalg.norm(seen, axis=1, keepdims=True))
    return out


def _markers(
    instrument: Instrument, poses: Float[np.ndarray, "rows 4 4"], rng: np.random.Generator
) -> dict[str, np.ndarray]:
    """The markers themselves, or the pose that fits them."""
    places = np.einsum("rij,mj->rmi", poses[:, :3, :3], instrument.markers) + poses[:, None, :3, 3]
    seen = places + rng.normal(0.0, instrument.sigma_position / np.sqrt(instrument.samples), places.shape)
    if instrument.observes is Observes.MARKERS:
        return {"markers": seen}
    fits = np.stack([se3.best_fit(instrument.markers, row) for row in seen])
    return {"position": fits[:, :3, 3], "rotation": fits[:, :3, :3]}


def three_anchors(robot: Robot) -> dict[str, Vector3]:
    """Anchors A, B and C on a circle about the base [m]."""
    angles = 2.0 * np.pi * np.arange(3) / 3.0
    circle = ANCHOR_CIRCLE * robot.reach * np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], -1)
    return dict(zip("ABC", circle @ robot.base.rotation.T + robot.base.xyz, strict=True))
