"""A trajectory from its file to corrected joints in another: what `workbench compensate` runs."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from workbench.arm.motion import Motion
from workbench.arm.robot import JointKind, Robot
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.base.threads import one_thread
from workbench.base.types import JointRows
from workbench.data.dataset import Dataset
from workbench.data.directions import with_directions
from workbench.data.readers.trajectory import Trajectory
from workbench.data.writer import write_measurements
from workbench.paths.correction import Compensation, Method, compensate
from workbench.paths.path import Commanded, command_joints, command_poses
from workbench.paths.planning import derivatives

LEAST_MOVING = 6
"""Rows from which velocities and accelerations can be told."""


@one_thread()
def compensate_trajectory(
    calibrated: Robot,
    trajectory: Trajectory,
    *,
    nominal: Robot | None = None,
    method: Method | str = Method.ITERATED,
    payload: float | None = None,
    temperature: float | None = None,
    max_speed: float | None = None,
    positions_only: bool = False,
    moving: bool = False,
) -> Compensation:
    """Joint positions with which a calibrated arm takes the poses that a trajectory means.

    Args:
        calibrated: The arm that moves, with its effects.
        trajectory: Joints, which mean the poses that the nominal arm has there; or poses in the robot's base
            frame. Where it has both, the joints count.
        nominal: The arm as the controller computes it. Poses can do without: then the calibrated geometry
            stands for it.
        method: `iterated`, or `one-step` (Katana eq. 5.22).
        payload: Mass at the tool [kg]; the trajectory's own where None.
        temperature: Temperature [degC]; the trajectory's own where None.
        max_speed: Greatest speed of any joint [rad/s or m/s]; not checked if None.
        positions_only: Whether orientations do not matter.
        moving: Whether the inertia of the links counts beside their weight.

    Raises:
        OptionError: joints without a nominal arm, or motion without time.
        DataError: a row that can't be, named with its joint.
    """
    if trajectory.q is not None and nominal is None:
        raise OptionError(
            f"{trajectory.source} has joints, and only the nominal model says which poses they mean; "
            "give it (--nominal ROBOT)"
        )
    commanded = _commanded(calibrated, trajectory, nominal, positions_only)
    state = path_state(commanded.q, trajectory, payload=payload, temperature=temperature)
    if moving:
        state = _in_motion(state, trajectory.source)
    return compensate(commanded, motion=state, method=method, max_speed=max_speed)


def write_trajectory(found: Compensation, path: Path | str) -> Path:
    """Write the corrected joints as a table with units, `time[s]` where the trajectory has it."""
    robot = found.commanded.calibrated
    rows = Dataset(q=found.q, row=np.arange(len(found.q)), time=found.motion.time)
    sliding = [i for i, joint in enumerate(robot.moving) if joint.kind is JointKind.PRISMATIC]
    return write_measurements(rows, path, prismatic=sliding)


def _commanded(
    calibrated: Robot, trajectory: Trajectory, nominal: Robot | None, positions_only: bool
) -> Commanded:
    time = trajectory.time
    if trajectory.q is not None and nominal is not None:
        return command_joints(calibrated, nominal, trajectory.q, positions_only=positions_only, time=time)
    assert trajectory.position is not None  # a trajectory has one or the other
    turned = trajectory.rotation
    rotation = np.tile(np.eye(3), (len(trajectory.position), 1, 1)) if turned is None else turned
    return command_poses(
        calibrated,
        calibrated.with_effects() if nominal is None else nominal,
        se3.pose(rotation, trajectory.position),
        positions_only=positions_only or turned is None,
        time=time,
    )


def _in_motion(state: Motion, source: str) -> Motion:
    """The state with velocities and accelerations."""
    if state.time is None or len(state) < LEAST_MOVING:
        raise OptionError(
            f"{source}: a path in motion needs its time (time[s]) and {LEAST_MOVING} rows or more"
        )
    velocity, acceleration = derivatives(state.time, state.q, at_rest=False)
    return replace(state, velocity=velocity, acceleration=acceleration)


def path_state(
    q: JointRows,
    trajectory: Trajectory,
    *,
    payload: float | None = None,
    temperature: float | None = None,
) -> Motion:
    """What drives effects along a path; directions follow from the order of the rows.

    Args:
        q: Joint positions, a row of the trajectory each [rad or m].
        trajectory: Where time, payload and temperature come from.
        payload: Mass at the tool instead [kg].
        temperature: Temperature instead [degC].
    """
    rows = len(q)
    time = np.arange(rows, dtype=float) if trajectory.time is None else trajectory.time
    path = with_directions(Dataset(q=q, row=np.arange(rows), time=time))

    def constant(value: float | None, own: np.ndarray | None) -> np.ndarray | None:
        return own if value is None else np.full(rows, value)

    return Motion(
        q,
        direction=path.direction,
        time=trajectory.time,
        payload=constant(payload, trajectory.payload),
        temperature=constant(temperature, trajectory.temperature),
    )
