"""What an instrument reads when the tool is at given poses: columns of a dataset, with the noise in them."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from workbench.arm.kinematics.forward import link_frames
from workbench.arm.kinematics.link_frames import level_axes
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import Vector3
from workbench.data.observations.tilt import reading, seen_from
from workbench.data.simulation.instruments import Instrument, Observes
from workbench.data.simulation.sight import lost, station

ANCHOR_CIRCLE = 0.6
"""Radius of the circle of three anchors about the base where none are given, as a share of the reach."""


def read_poses(
    instrument: Instrument,
    poses: Float[np.ndarray, "rows 4 4"],
    rng: np.random.Generator,
    anchors: Mapping[str, Vector3],
) -> dict[str, np.ndarray]:
    """The columns that the instrument fills when the tool is at the poses.

    Args:
        instrument: One that needs nothing but the tool's pose.
        poses: Of the tool, in the measuring frame.
        rng: Source of the noise.
        anchors: Places that distances are measured from [m].
    """
    rows, (sigma, turn) = len(poses), instrument.deviations
    if instrument.observes in (Observes.MARKERS, Observes.RIGID_BODY):
        return _markers(instrument, poses, rng)
    if instrument.observes is Observes.DISTANCE:
        names = _anchors_of(instrument, poses, anchors)
        places = np.stack([anchors[name] for name in names])
        distances = np.linalg.norm(poses[:, :3, 3] - places, axis=1)
        return {"distance": distances + rng.normal(0.0, sigma, rows), "anchor": names}
    columns = {"position": poses[:, :3, 3] + rng.normal(0.0, sigma, (rows, 3))}
    if instrument.observes is Observes.POSE:
        turns = se3.rotvec_to_matrix(rng.normal(0.0, turn or 0.0, (rows, 3)))
        columns["rotation"] = turns @ poses[:, :3, :3]
    return columns


def read_tilts(
    instrument: Instrument,
    actual: Robot,
    motion: Motion,
    rng: np.random.Generator,
) -> dict[int, Float[np.ndarray, "rows 2"]]:
    """Readings of an inclinometer on every moving link [rad], by link from 1; see `observations/tilt.py`.

    The noise turns what it sees as upwards about the two axes across that.
    """
    moving = [i for i, joint in enumerate(actual.joints) if joint.kind != "fixed"]
    frames = link_frames(actual, motion)
    level = level_axes(actual.gravity) @ actual.base.rotation.T
    _, turn = instrument.deviations
    out = {}
    for number, joint in enumerate(moving, start=1):
        up = seen_from(level @ frames[:, 1 + joint, :3, :3])
        seen = up + np.cross(rng.normal(0.0, turn or 0.0, up.shape), up)
        out[number] = reading(seen / np.linalg.norm(seen, axis=1, keepdims=True))
    return out


def unseen(
    instrument: Instrument, actual: Robot, poses: Float[np.ndarray, "rows 4 4"], columns: dict
) -> tuple[np.ndarray, str]:
    """Why the instrument has no reading of each pose, "" where it has one, and how it was set up."""
    reasons, note = np.full(len(poses), "", dtype="<U80"), ""
    if instrument.sight is not None:
        place = station(actual) if instrument.place is None else instrument.place
        reasons, note = lost(instrument.sight, poses, place)
    if instrument.stroke is not None and "distance" in columns:
        short, long = instrument.stroke
        out = (columns["distance"] < short) | (columns["distance"] > long)
        reasons[out] = f"the anchor is not within {short:g} to {long:g} m"
    return reasons, note


def three_anchors(robot: Robot) -> dict[str, Vector3]:
    """Anchors A, B and C on a circle about the base [m]."""
    angles = 2.0 * np.pi * np.arange(3) / 3.0
    circle = ANCHOR_CIRCLE * robot.reach * np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], -1)
    return dict(zip("ABC", circle @ robot.base.rotation.T + robot.base.xyz, strict=True))


def _markers(instrument: Instrument, poses: np.ndarray, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """The markers themselves, or the pose that fits them."""
    places = np.einsum("rij,mj->rmi", poses[:, :3, :3], instrument.markers) + poses[:, None, :3, 3]
    sigma = instrument.sigma_position / np.sqrt(instrument.samples)
    seen = places + rng.normal(0.0, sigma, places.shape)
    if instrument.observes is Observes.MARKERS:
        return {"markers": seen}
    fits = np.stack([se3.best_fit(instrument.markers, row) for row in seen])
    return {"position": fits[:, :3, 3], "rotation": fits[:, :3, :3]}


def _anchors_of(instrument: Instrument, poses: np.ndarray, anchors: Mapping[str, Vector3]) -> np.ndarray:
    """Anchor of each row: in turn, or the nearest of an instrument that reaches only so far."""
    names = np.array(list(anchors))
    if instrument.stroke is None:
        return names[np.arange(len(poses)) % len(names)]
    places = np.stack([anchors[name] for name in names])
    return names[np.linalg.norm(poses[:, None, :3, 3] - places, axis=-1).argmin(axis=1)]
