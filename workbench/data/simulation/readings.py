"""What instruments read of an arm: columns of a dataset with noise in them, and why some poses show nothing.

A reflector that is fixed to the tool is seen while the line of sight comes in within a cone about the
direction that it looks in; the thesis lost its laser tracker's beam beyond 45° (Katana §3.3). Optical systems
have a nearest and a farthest distance.

A probe touches balls and planes at fixed places. A ball is touched all around, which gives its centre in the
tool's frame: as good as a contact of the tool point with that centre. A plane is touched along the shortest
line from where the tip is, off by the probe's noise along its normal. The arm touches both in the posture
next to the one that it had.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.gravity import level_axes
from workbench.arm.inverse import solve as inverse
from workbench.arm.inverse.solve import Task
from workbench.arm.kinematics.forward import link_frames, tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import Vector3, frozen
from workbench.data.observations.tilt import reading, seen_from
from workbench.data.simulation.instruments import Instrument, Observes, Sight

ANCHOR_CIRCLE = 0.6
"""Radius of the circle of three anchors about the base where none are given, as a share of the reach."""
FLOOR_HEIGHT = 0.1
"""Height of the touched floor over the base where no planes are given, as a share of the reach."""
WALL_DISTANCE = 0.45
"""Distance of the touched walls from the base, likewise."""
INSTRUMENT_DISTANCE = 2.2
"""How far beyond the arm's reach an instrument stands along the base's x axis by default [m]."""
INSTRUMENT_HEIGHT = 1.0
"""How high over the base it stands by default [m]."""
SIDES = frozen(np.concatenate([np.eye(3), -np.eye(3)]))
"""Directions of the tool frame into which a target may be mounted to look."""
SIDE_NAMES = ("+x", "+y", "+z", "−x", "−y", "−z")


@dataclass(frozen=True, eq=False)
class VirtualInstrument:
    """An instrument that measures a virtual arm.

    Args:
        instrument: What it sees, and how well.
        arm: The actual arm.
        rng: Source of the noise.
        anchors: Places that distances are measured from, and centres of balls, by name [m].
    """

    instrument: Instrument
    arm: Robot
    rng: np.random.Generator
    anchors: Mapping[str, Vector3]

    def read(self, motion: Motion, poses: Float[np.ndarray, "rows 4 4"]) -> dict[str, Any]:
        """The columns of a dataset that it fills without touch, at poses in the measuring frame."""
        observes, rows, (sigma, turn) = self.instrument.observes, len(poses), self.instrument.deviations
        if observes is Observes.TILT:
            return {"tilt": self._tilts(motion)}
        if observes in (Observes.MARKERS, Observes.RIGID_BODY):
            return self._markers(poses)
        if observes is Observes.DISTANCE:
            names = np.array(list(self.anchors))
            places = np.stack([self.anchors[name] for name in names])
            taken = np.arange(rows) % len(names)  # in turn, or the nearest where only that is within reach
            if self.instrument.sight is not None:
                taken = np.linalg.norm(poses[:, None, :3, 3] - places, axis=-1).argmin(axis=1)
            distances = np.linalg.norm(poses[:, :3, 3] - places[taken], axis=1)
            return {"distance": distances + self.rng.normal(0.0, sigma, rows), "anchor": names[taken]}
        columns = {"position": poses[:, :3, 3] + self.rng.normal(0.0, sigma, (rows, 3))}
        if observes is Observes.POSE:
            turns = se3.rotvec_to_matrix(self.rng.normal(0.0, turn or 0.0, (rows, 3)))
            columns["rotation"] = turns @ poses[:, :3, :3]
        return columns

    def _tilts(self, motion: Motion) -> dict[int, Float[np.ndarray, "rows 2"]]:
        """Readings of an inclinometer on every moving link [rad], by link: `data/observations/tilt.py`.

        The noise turns what it sees as upwards about the two axes across that.
        """
        moving = [i for i, joint in enumerate(self.arm.joints) if joint.kind != "fixed"]
        frames, (_, turn), out = link_frames(self.arm, motion), self.instrument.deviations, {}
        level = level_axes(self.arm.gravity) @ self.arm.base.rotation.T
        for number, joint in enumerate(moving, start=1):
            up = seen_from(level @ frames[:, 1 + joint, :3, :3])
            seen = up + np.cross(self.rng.normal(0.0, turn or 0.0, up.shape), up)
            out[number] = reading(seen / np.linalg.norm(seen, axis=1, keepdims=True))
        return out

    def _markers(self, poses: Float[np.ndarray, "rows 4 4"]) -> dict[str, np.ndarray]:
        """The markers themselves, or the pose that fits them."""
        markers = self.instrument.markers
        places = np.einsum("rij,mj->rmi", poses[:, :3, :3], markers) + poses[:, None, :3, 3]
        sigma = self.instrument.sigma_position / np.sqrt(self.instrument.samples)
        seen = places + self.rng.normal(0.0, sigma, places.shape)
        if self.instrument.observes is Observes.MARKERS:
            return {"markers": seen}
        fits = np.stack([se3.best_fit(markers, row) for row in seen])
        return {"position": fits[:, :3, 3], "rotation": fits[:, :3, :3]}

    def unseen(self, poses: Float[np.ndarray, "rows 4 4"], columns: dict) -> tuple[np.ndarray, str]:
        """Why there is no reading of each pose, "" where there is one, and how it was set up."""
        if (sight := self.instrument.sight) is not None and "distance" not in columns:
            place = station(self.arm) if self.instrument.place is None else self.instrument.place
            return _lost(sight, poses, place)
        reasons = np.full(len(poses), "", dtype="<U80")
        if sight is not None:
            out = (columns["distance"] < sight.near) | (columns["distance"] > sight.far)
            reasons[out] = f"the anchor is not within {sight.near:g} to {sight.far:g} m"
        return reasons, ""

    def touch(self, motion: Motion) -> tuple[Motion, np.ndarray, Bool[np.ndarray, " rows"]]:
        """Touch balls at the anchors, or three planes, one after the other, from where the arm is.

        Returns:
            The motion with joint positions in contact, as they were where it can't be reached; the surface's
            name of each row; and whether the contact was made.
        """
        sigma, turn_taking = self.instrument.deviations[0], np.arange(len(motion))
        poses = tool_poses(self.arm, motion)
        if self.instrument.observes is Observes.SPHERE:
            names = np.array(list(self.anchors))[turn_taking % len(self.anchors)]
            centres = np.stack([self.anchors[name] for name in names])
            tips, names = centres + self.rng.normal(0.0, sigma, centres.shape), np.char.add("ball ", names)
        else:
            planes = three_planes(self.arm)
            names = np.array(list(planes))[turn_taking % len(planes)]
            normals, offsets = (np.stack(part) for part in zip(*map(planes.get, names), strict=True))
            offsets = offsets + self.rng.normal(0.0, sigma, len(motion))
            gaps = offsets - (normals * poses[:, :3, 3]).sum(axis=1)
            tips = poses[:, :3, 3] + gaps[:, None] * normals
        targets = se3.pose(poses[:, :3, :3], tips)
        found = inverse.follow_many(self.arm, targets, motion.q, task=Task.POSITION, motion=motion)
        q = np.where(found.converged[:, None], found.q, motion.q)
        return motion.at(q), names, found.converged


def three_anchors(robot: Robot) -> dict[str, Vector3]:
    """Anchors A, B and C on a circle about the base [m]."""
    angles = 2.0 * np.pi * np.arange(3) / 3.0
    circle = ANCHOR_CIRCLE * robot.reach * np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], -1)
    return dict(zip("ABC", circle @ robot.base.rotation.T + robot.base.xyz, strict=True))


def three_planes(robot: Robot) -> dict[str, tuple[Vector3, float]]:
    """Unit normal n and offset d [m] of planes n·p = d in the measuring frame: a floor and two walls."""
    rotation, origin = robot.base.rotation, robot.base.xyz
    distances = robot.reach * np.array([WALL_DISTANCE, WALL_DISTANCE, FLOOR_HEIGHT])
    names = ("plane front", "plane side", "plane floor")
    return {n: (rotation[:, i], float(rotation[:, i] @ origin + distances[i])) for i, n in enumerate(names)}


def station(robot: Robot) -> Vector3:
    """Where an instrument stands in the measuring frame if nothing else is said [m]."""
    away = np.array([INSTRUMENT_DISTANCE + robot.reach, 0.0, INSTRUMENT_HEIGHT])
    return robot.base.rotation @ away + robot.base.xyz


def mounting(sight: Sight, poses: Float[np.ndarray, "rows 4 4"], place: Vector3) -> int:
    """The side of the tool, as in `SIDES`, on which a target is seen in most poses."""
    return int(np.argmax((_angles(poses, place) <= (sight.cone or np.pi)).sum(axis=0)))


def _lost(sight: Sight, poses: Float[np.ndarray, "rows 4 4"], place: Vector3) -> tuple[np.ndarray, str]:
    """Why each pose is not seen from a place, "" where it is, and how the target was mounted."""
    reasons = np.full(len(poses), "", dtype="<U80")
    away = np.linalg.norm(poses[:, :3, 3] - place, axis=1)
    for i in np.flatnonzero((away < sight.near) | (away > sight.far)):
        reasons[i] = f"{away[i]:.2f} m from the instrument, whose range is {sight.near:g} to {sight.far:g} m"
    if sight.cone is None or not len(poses):
        return reasons, ""
    side = mounting(sight, poses, place)
    angles = np.rad2deg(_angles(poses, place)[:, side])
    limit = float(np.rad2deg(sight.cone))
    for i in np.flatnonzero((angles > limit) & (reasons == "")):
        reasons[i] = f"{angles[i]:.0f}° off the line of sight, more than {limit:.0f}°"
    return reasons, f"the target looks along {SIDE_NAMES[side]} of the tool, where most poses are seen"


def _angles(poses: Float[np.ndarray, "rows 4 4"], place: Vector3) -> Float[np.ndarray, "rows sides"]:
    """Angle between the line of sight and each side of the tool."""
    towards = place - poses[:, :3, 3]
    towards = towards / np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-12)
    return np.arccos(np.clip(np.einsum("rij,sj,ri->rs", poses[:, :3, :3], SIDES, towards), -1.0, 1.0))
