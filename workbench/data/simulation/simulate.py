"""Virtual arms and virtual measurements: the paper's first two ways of acquisition without an arm.

A virtual arm is the nominal one with hidden manufacturing errors. It is measured either at given joint
positions (ARIA §4.1.2, first way), or at the targets of a fixture (second way): there the pose is imposed,
and the joint angles are what the actual arm takes to be there, from its own inverse kinematics.

    measured pose = actual pose ⊕ noise,   p + N(0, σp²) per axis,   exp(N(0, σr²) per axis) R, base axes
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.arm.gravity import level_axes
from workbench.arm.inverse import solve as inverse
from workbench.arm.kinematics.forward import link_frames, tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.base.types import Vector3
from workbench.data.dataset import Dataset
from workbench.data.observations.tilt import reading, seen_from
from workbench.data.simulation.instruments import Instrument, Observes

LIKELY_ERRORS = 1e-3, float(np.deg2rad(0.3))
"""Maximum manufacturing errors of a length [m] and of an angle [rad], as of a good industrial arm."""
ANCHOR_CIRCLE = 0.6
"""Radius of the circle of three anchors about the base where none are given, as a share of the reach."""

Poses = Float[np.ndarray, "rows 4 4"]


def virtual_arm(
    robot: Robot, *, rng: np.random.Generator, errors: tuple[float, float] = LIKELY_ERRORS
) -> Robot:
    """An actual arm: the nominal one with even manufacturing errors of its default free constants.

    Args:
        errors: Maximum errors of lengths [m] and of angles [rad].
    """
    names = robot.default_free
    turns = [robot.chain.elements[i].axis.turns for i in robot.chain.indices(names)]
    actual = robot.values(names) + rng.uniform(-1.0, 1.0, len(names)) * np.where(turns, errors[1], errors[0])
    return robot.with_values(dict(zip(names, actual.tolist(), strict=True)))


def simulate(actual: Robot, motion: Motion, *, instrument: Instrument, rng: np.random.Generator) -> Dataset:
    """Measure an arm at given joint positions.

    Args:
        motion: Joint positions, and what drives the arm's effects, which is written into the rows.

    Returns:
        One row a joint position; distances are from three places about the base.
    """
    if instrument.observes is Observes.CONTACT:
        text = f"instrument '{instrument.name}' touches fixed points: simulate it at targets, turned there"
        raise OptionError(text, option="instrument", found=instrument.name)
    columns = readings(instrument, actual, motion, tool_poses(actual, motion), rng)
    return _rows(instrument, actual, motion, columns)


def simulate_targets(
    actual: Robot,
    targets: Float[np.ndarray, "targets 4 4"],
    *,
    instrument: Instrument,
    rng: np.random.Generator,
    near: Float[np.ndarray, "targets n"],
    motion: Motion | None = None,
) -> Dataset:
    """Bring an arm to the targets of a fixture and measure it there.

    Args:
        actual: The arm that is measured; its own inverse kinematics gives the joint positions.
        targets: Poses of the tool in the robot's base, such as `plate.poses`.
        instrument: What measures it: `plate` is the seat itself. One that touches fixed points holds the
            tool's position with its noise and sees nothing else; equal places are one point.
        rng: Source of the noise.
        near: Joint positions of the nominal arm at the targets, such as a plate's chosen ones: the actual
            arm takes the solution next to them; where its limits forbid that one, the nearest other, and a
            note says so.
        motion: What drives the arm's effects beside q, one row a target; written into the rows.

    Returns:
        One row a target.
    """
    imposed = actual.base.pose @ targets
    if instrument.observes is Observes.CONTACT:
        noise = rng.normal(0.0, instrument.sigma_position, (len(targets), 3))
        imposed = se3.pose(imposed[:, :3, :3], imposed[:, :3, 3] + noise)
    actual.check_joints(near, "near")
    q, notes = _follow(actual, imposed, near, motion)
    state = Motion(q) if motion is None else motion.at(q)
    if instrument.observes is Observes.CONTACT:
        return _rows(instrument, actual, state, {"contact": _points(targets[:, :3, 3])}, notes)
    return _rows(instrument, actual, state, readings(instrument, actual, state, imposed, rng), notes)


def _rows(instrument: Instrument, actual: Robot, motion: Motion, columns, notes=()) -> Dataset:
    """The rows; of the state what a table of measurements holds, as poses are taken at rest."""
    position, rotation = instrument.deviations
    sigma = np.tile([position] * 3 + [np.nan if rotation is None else rotation] * 3, (len(motion), 1))
    known = Dataset.__dataclass_fields__.keys() - {"row", "place"}
    state: dict[str, Any] = {name: values for name, values in motion.drivers.items() if name in known}
    return Dataset(
        q=motion.q,
        sigma=sigma if position > 0 else None,
        source=f"virtual {actual.name}",
        notes=(f"simulated with instrument '{instrument.name}'", *notes),
        more=motion.more,
        **columns,
        **state,
    )


def _points(places: Float[np.ndarray, "rows 3"]) -> np.ndarray:
    """`point 1`, `point 2` … of rows that share a place to a micrometre."""
    once = [*dict.fromkeys(rounded := [*map(tuple, np.round(places, 6).tolist())])]
    return np.array([f"point {once.index(place) + 1}" for place in rounded])


def _follow(
    actual: Robot, poses: np.ndarray, near: np.ndarray, motion: Motion | None
) -> tuple[np.ndarray, tuple[str, ...]]:
    """The solutions next to given joint positions, and a note on each that the limits turned elsewhere."""
    followed = inverse.follow_many(actual, poses, near, motion=motion)
    q, notes = followed.q.copy(), []
    for row in np.flatnonzero(~followed.converged).tolist():
        state = None if motion is None else motion.take(np.array([row]))
        result = inverse.solve(actual, poses[row], motion=state)
        other = inverse.choose(result, near=near[row])
        if other is None:
            raise DataError(f"target {row + 1} is not reachable within limits: {result.reason}", target=row)
        q[row] = other.q
        outside = "the chosen branch is outside this arm's limits"
        notes.append(f"target {row + 1}: {outside}; measured in '{other.name}'")
    return q, tuple(notes)


def readings(
    instrument: Instrument, arm: Robot, motion: Motion, poses: Poses, rng: np.random.Generator
) -> dict[str, Any]:
    """The columns of a dataset that an instrument fills, at poses of an arm in the measuring frame."""
    observes, rows, (sigma, turn) = instrument.observes, len(poses), instrument.deviations
    if observes is Observes.TILT:
        return {"tilt": _tilts(arm, motion, turn or 0.0, rng)}
    if observes in (Observes.MARKERS, Observes.RIGID_BODY):
        return _markers(instrument, poses, rng)
    if observes is Observes.DISTANCE:
        anchors = three_anchors(arm)
        names, places = np.array([*anchors]), np.stack([*anchors.values()])
        taken = np.arange(rows) % len(names)
        distances = np.linalg.norm(poses[:, :3, 3] - places[taken], axis=1)
        return {"distance": distances + rng.normal(0.0, sigma, rows), "anchor": names[taken]}
    columns = {"position": poses[:, :3, 3] + rng.normal(0.0, sigma, (rows, 3))}
    if observes is Observes.POSE:
        turns = se3.rotvec_to_matrix(rng.normal(0.0, turn or 0.0, (rows, 3)))
        columns["rotation"] = turns @ poses[:, :3, :3]
    return columns


def _tilts(arm: Robot, motion: Motion, turn: float, rng: np.random.Generator) -> dict[int, np.ndarray]:
    """Readings of an inclinometer on every moving link [rad], by link: `data/observations/tilt.py`.

    The noise turns what it sees as upwards about the two axes across that.
    """
    moving = [i for i, joint in enumerate(arm.joints, start=1) if joint.kind != "fixed"]
    links = np.swapaxes(link_frames(arm, motion)[:, moving, :3, :3], 0, 1)
    up = seen_from(level_axes(arm.gravity) @ arm.base.rotation.T @ links)
    seen = up + np.cross(rng.normal(0.0, turn, up.shape), up)
    return dict(enumerate(reading(seen / np.linalg.norm(seen, axis=-1, keepdims=True)), start=1))


def _markers(instrument: Instrument, poses: Poses, rng: np.random.Generator) -> dict[str, np.ndarray]:
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
