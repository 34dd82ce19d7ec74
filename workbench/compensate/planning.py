"""A tool led along a curve: poses, joints in one branch, velocities and accelerations.

The tool's orientation is held from beginning to end. Arms of six joints and more hold all of it. Arms of five
hold the direction of the tool's z axis and leave the turn about it as it comes: position and axis are five
conditions. Where no axis is asked for, that of the curve's plane is wanted (the z axis pointing into it from
above), and the nearest one is taken that the arm holds all the way, `CLEAR` of its limits and of
singularities.

Joints between the rows are those of a spline of fifth degree that begins and ends at rest; its derivatives
are the velocities and accelerations.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.interpolate import make_interp_spline

from workbench import se3
from workbench.compensate.checks import named, refuse_fast, refuse_singular
from workbench.compensate.curves import Curve, smooth_shares
from workbench.compensate.path import Commanded, command_poses
from workbench.errors import DataError, OptionError
from workbench.model.arm import compile_arm
from workbench.model.branches import margins
from workbench.model.forward import tool_poses
from workbench.model.solutions import task_jacobian
from workbench.motion import Motion
from workbench.robots.robot import Robot
from workbench.types import JointRows, Poses, Rotations, Vector3, frozen

DOWN = np.array([0.0, 0.0, -1.0])
"""Where a tool points on a line, and along which sense of a plane's normal."""
CONE = float(np.deg2rad(45.0))
"""Greatest angle between the axis wanted and the one held where none was asked for [rad]."""
STEP = float(np.deg2rad(2.5))
"""Angle between the axes that are tried [rad]."""
CLEAR = float(np.deg2rad(1.0))
"""Distance from limits that a path chosen here keeps for its correction [rad or m]."""
APART = 0.02
"""Dimensionless singular value that a path chosen here keeps."""
COARSE = 25
"""Points of the curve at which an axis is tried."""
SPINS = np.deg2rad([0.0, 90.0, 180.0, 270.0])
"""Turns about the tool's z axis that are tried where the arm holds it too [rad]."""
LEAST_ROWS = 8
"""Rows below which a curve is no trajectory."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Planned:
    """A trajectory as an arm's controller would run it.

    Args:
        robot: The arm that it was planned for, in its own base frame.
        time: Of every row, from 0 [s].
        poses: Of the tool in the robot's base frame, as the arm takes them.
        motion: Joint positions with their time, velocities and accelerations.
        axis: Direction of the tool's z axis that is held, robot's base.
        notes: What was decided, one sentence each.
    """

    robot: Robot
    time: Float[np.ndarray, " rows"]
    poses: Poses
    motion: Motion
    axis: Vector3
    notes: tuple[str, ...]

    @property
    def q(self) -> JointRows:
        """Joint positions [rad or m]."""
        return self.motion.q


def plan(
    robot: Robot,
    curve: Curve,
    *,
    duration: float,
    rows: int = 200,
    axis: Vector3 | None = None,
    max_speed: float | None = None,
) -> Planned:
    """Lead a tool along a curve, from rest to rest.

    Args:
        robot: The arm as its controller computes it; effects and base do not count.
        curve: In the robot's base frame.
        duration: Time from beginning to end [s].
        rows: Number of samples, evenly in time.
        axis: Direction of the tool's z axis; chosen if None, see the module.
        max_speed: Greatest speed of any joint [rad/s or m/s]; not checked if None.

    Raises:
        OptionError: no time, too few rows, an axis of no length.
        DataError: a point out of reach, at a limit or a singularity, or too fast; names time, row and joint.
    """
    if not (duration > 0.0 and np.isfinite(duration)) or rows < LEAST_ROWS:
        raise OptionError(
            f"a trajectory of {duration:g} s in {rows} rows can't be; give more than 0 s and "
            f"{LEAST_ROWS} rows or more"
        )
    time = np.linspace(0.0, duration, rows)
    points = curve.points(smooth_shares(time))
    if axis is None:
        command, held, notes = _held(robot, curve, points, time)
    else:
        held = _unit(axis)
        command, notes = _command(robot, curve, points, held, time), ()
    refuse_singular(command.nominal, command.q, command.task, time)
    velocity, acceleration = derivatives(time, command.q)
    refuse_fast(robot, velocity, max_speed, time)
    return Planned(
        robot=command.nominal,
        time=frozen(time),
        poses=_taken(command),
        motion=Motion(command.q, time=time, velocity=velocity, acceleration=acceleration),
        axis=frozen(held),
        notes=(*command.notes, *notes),
    )


def derivatives(time: Float[np.ndarray, " rows"], q: JointRows) -> tuple[JointRows, JointRows]:
    """Velocities and accelerations of a trajectory that begins and ends at rest; see the module.

    Args:
        time: Of every row, increasing [s].
        q: Joint positions [rad or m].
    """
    still = [(1, np.zeros(q.shape[1])), (2, np.zeros(q.shape[1]))]
    spline = make_interp_spline(time, q, k=5, bc_type=(still, still))
    return frozen(spline(time, 1)), frozen(spline(time, 2))


def _held(
    robot: Robot, curve: Curve, points: np.ndarray, time: np.ndarray
) -> tuple[Commanded, Vector3, tuple[str, ...]]:
    """The path with the axis nearest to the curve's plane that the arm can hold."""
    wanted = DOWN if curve.normal is None else curve.normal * (-1.0 if curve.normal @ DOWN < 0.0 else 1.0)
    few = np.unique(np.linspace(0, len(points) - 1, COARSE).astype(int))
    refused: DataError | None = None
    for held in _cone(wanted):
        try:
            rough = _command(robot, curve, points[few], held, time[few])
            if _clear(rough):
                command = _command(robot, curve, points, held, time, near=rough.q[0])
                return command, held, _words(curve, wanted, held)
        except DataError as error:
            refused = refused or error
    angle = f"{np.rad2deg(CONE):.0f}°"
    raise DataError(
        f"robot '{robot.name}' holds no direction of its tool within {angle} of {_numbers(wanted)} along "
        f"the whole path; with that direction {refused or named(0, time) + ' comes too near to a limit'}"
    )


def _cone(wanted: Vector3) -> Iterator[Vector3]:
    """The direction wanted, and others around it, the nearest first."""
    yield wanted
    side = np.linalg.svd(wanted[None])[2][1:]
    for angle in np.arange(STEP, CONE + 0.5 * STEP, STEP):
        turns = np.linspace(0.0, 2.0 * np.pi, max(6, int(np.sin(angle) * 2.0 * np.pi / (2.0 * STEP))), False)
        for turn in turns:
            yield np.cos(angle) * wanted + np.sin(angle) * (np.cos(turn) * side[0] + np.sin(turn) * side[1])


def _command(
    robot: Robot,
    curve: Curve,
    points: np.ndarray,
    axis: Vector3,
    time: np.ndarray,
    *,
    near: np.ndarray | None = None,
) -> Commanded:
    """The path with an axis held; whatever turn about it the arm follows, if the turn counts."""
    refused: DataError | None = None
    for spin in SPINS if robot.dof >= 6 else SPINS[:1]:
        poses = se3.pose(_orientations(curve, axis, spin, len(points)), points)
        try:
            return command_poses(robot.with_effects(), robot.with_effects(), poses, near=near, time=time)
        except DataError as error:
            refused = refused or error
    assert refused is not None  # there is a spin, and it was refused
    raise refused


def _orientations(curve: Curve, axis: Vector3, spin: float, rows: int) -> Rotations:
    """Rotations with this z axis, x near the curve's direction and turned about z by the spin [rad]."""
    y = np.cross(axis, curve.along)
    if np.linalg.norm(y) < 0.1:
        y = np.linalg.svd(axis[None])[2][1]
    y = y / np.linalg.norm(y)
    turn = se3.rotvec_to_matrix(np.array([0.0, 0.0, spin]))
    return np.tile(np.column_stack([np.cross(y, axis), y, axis]) @ turn, (rows, 1, 1))


def _clear(command: Commanded) -> bool:
    """Whether a path leaves room for its correction."""
    arm = compile_arm(command.nominal)
    jacobian = task_jacobian(arm, command.q[:, arm.columns], command.task)
    singular = np.linalg.svd(jacobian, compute_uv=False)[:, -1]
    return bool(margins(command.q, command.nominal.known_limits).min() > CLEAR and singular.min() > APART)


def _taken(command: Commanded) -> Poses:
    """The poses that the nominal arm has: with five joints the turn about the axis is what it comes to."""
    return frozen(tool_poses(command.nominal, command.q))


def _words(curve: Curve, wanted: Vector3, held: Vector3) -> tuple[str, ...]:
    angle = np.rad2deg(np.arccos(np.clip(wanted @ held, -1.0, 1.0)))
    if angle < 1e-3:
        return (f"the tool's z axis is held along {_numbers(held)}",)
    what = "straight down" if curve.normal is None else "the normal of the path's plane"
    return (
        f"the tool's z axis is held along {_numbers(held)}, {angle:.1f}° from {what}: the nearest direction "
        "tried that the arm can hold all the way",
    )


def _unit(axis: Vector3) -> Vector3:
    if not np.linalg.norm(axis) > 0.0:
        raise OptionError(f"the tool's axis {_numbers(axis)} has no length; give a direction")
    return axis / np.linalg.norm(axis)


def _numbers(vector: np.ndarray) -> str:
    return "(" + ", ".join(f"{v:.3f}" for v in vector) + ")"
