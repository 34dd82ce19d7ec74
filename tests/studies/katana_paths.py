"""The paths of the Katana thesis (§5.5.1), from rest to rest, the pencil held as asked or nearly so.

Where the arm can't hold the tool's z axis along z*, the postures q_k of knots minimise together

    Σ |z(q_k) − z*|² + s² Σ |q_{k−1} − 2 q_k + q_{k+1}|² + h² Σ (max(0, m − margin(q_k)))²

and, with a large weight, their distances from the points; a closed path ends as it begins.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import linalg
from scipy.interpolate import make_interp_spline

from workbench import Frame, Motion, Robot, tool_poses
from workbench.arm.inverse.damped_newton import Task, refine
from workbench.arm.inverse.reduced_arm import ReducedArm, compile_arm
from workbench.arm.inverse.solutions import STARTS, nearby_starts
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.types import JointRows, Poses, Positions, Vector3
from workbench.extras.trajectories.path import command_poses, followed

POINT_GAIN, SMOOTH, LIMIT_WEIGHT, RIDGE = 1e4, 3.0, 30.0, 1e-6
"""Weights of positions [1/m], of bends s, of a missing margin h, and of what nothing else holds."""
KNOTS, LIMIT_MARGIN = 41, np.deg2rad(3.0)
START_POSTURES, FAR = 4, 0.5  # at the first point, and how far apart [rad]
Curve = Callable[[np.ndarray], Positions]  # points by their shares of the way


class Path(NamedTuple):
    """Joints of an arm with their velocities and accelerations, and the tool's poses in the arm's base."""

    robot: Robot
    poses: Poses
    motion: Motion


def circle_through(points: Positions) -> tuple[Curve, Vector3]:
    """The circle from the first point towards the second, and its normal."""
    away = points - points.mean(0)
    design = np.insert(2.0 * away, 3, 1.0, axis=1)  # Kåsa, IEEE Trans. Instrum. Meas. 25 (1976)
    *middle, power = np.linalg.lstsq(design, (away**2).sum(1), rcond=1e-3)[0]
    centre, radius = points.mean(0) + middle, np.sqrt(power + np.dot(middle, middle))
    first, second = points[:2] - centre
    normal = np.cross(first, second) / np.linalg.norm(np.cross(first, second))
    along = first / np.linalg.norm(first)
    sides = radius * np.array([along, np.cross(normal, along)])

    def curve(shares: np.ndarray) -> Positions:
        return centre + np.hstack([f(2.0 * np.pi * shares[:, None]) for f in (np.cos, np.sin)]) @ sides

    return curve, normal


def smooth_shares(time: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
    """Of the way at every time, from rest to rest: Flash, Hogan, J. Neurosci. 5(7), 1985."""
    t = time / time[-1]
    return t**3 * (10.0 - 15.0 * t + 6.0 * t**2)


def plan(robot: Robot, curve: Curve, wanted: Vector3, *, duration: float, rows: int) -> Path:
    """The tool along a curve in the robot's base with its z axis in a direction."""
    time, free = np.linspace(0.0, duration, rows), robot.with_effects().with_frames(base=Frame())
    points = curve(smooth_shares(time))
    y = np.cross(wanted, points[rows // 2] - points[0])
    y /= np.linalg.norm(y)
    turn = np.column_stack([np.cross(y, wanted), y, wanted])
    try:
        q = command_poses(free, free, se3.pose(np.tile(turn, (rows, 1, 1)), points)).q
    except DataError:
        q = _near_direction(free, curve, points, wanted)
    rest = [(1, np.zeros(robot.dof)), (2, np.zeros(robot.dof))]
    spline = make_interp_spline(time, q, k=5, bc_type=(rest, rest))
    motion = Motion(q, time=time, velocity=spline(time, 1), acceleration=spline(time, 2))
    return Path(free, tool_poses(free, Motion(q)), motion)


def _near_direction(robot: Robot, curve: Curve, points: Positions, wanted: Vector3) -> JointRows:
    arm, few, found = compile_arm(robot), np.linspace(0.0, 1.0, KNOTS), []
    knots, shares = curve(few), smooth_shares(np.linspace(0.0, 1.0, len(points)))
    for start in _starts(robot, knots[0], wanted):
        led = followed(arm, _aims(knots), start, task=Task.POSITION, limits=robot.limits)
        if len(led) == KNOTS:
            x, cost = _optimised(arm, knots, led, wanted, robot.limits)
            rows = make_interp_spline(few, x, k=5)(shares)
            met = refine(arm, _aims(points), rows, task=Task.POSITION, limits=robot.limits)
            assert met.position_error.max() < 1e-6
            found.append((cost, met.q))
    return min(found, key=lambda each: each[0])[1]


def _aims(points: Positions) -> Poses:
    return se3.pose(np.tile(np.eye(3), (len(points), 1, 1)), points)


def _starts(robot: Robot, point: Vector3, wanted: Vector3) -> list[np.ndarray]:
    """Postures at the first point, far from each other, whose direction is nearest to the requested one."""
    across = np.linalg.svd(wanted[None])[2][1:]
    arm, pose = compile_arm(robot), se3.pose(np.column_stack([*across, wanted]), point)
    near = nearby_starts(arm, pose[None], Task.POSITION_AXIS, STARTS, is_limited=True)[0]
    met = refine(arm, pose[None], near, task=Task.POSITION, limits=robot.limits)
    postures, found = met.q[met.converged], list[np.ndarray]()
    for q in postures[np.argsort(-(arm.geometry(postures)[0][:, :3, 2] @ wanted))]:
        if len(found) < START_POSTURES and all(np.abs(q - other).max() > FAR for other in found):
            found.append(q)
    return found


def _optimised(arm: ReducedArm, points: Positions, x: np.ndarray, wanted: Vector3, limits: np.ndarray):
    """The postures of smallest cost near the given ones by Gauss–Newton, and their cost."""
    bends = np.diff(np.eye(len(x)), 2, axis=0)
    if np.linalg.norm(points[-1] - points[0]) < 1e-6:
        over, same = np.zeros((2, len(x)))
        over[[-2, 0, 1]], same[[0, -1]] = (1.0, -2.0, 1.0), (POINT_GAIN, -POINT_GAIN)
        bends = np.vstack([bends, over, same])
    residual, jacobian = _terms(arm, points, x, wanted, limits, bends)
    cost = float(residual @ residual)
    for _ in range(60):
        curvature = jacobian.T @ jacobian + RIDGE * np.eye(x.size)
        step = -linalg.solve(curvature, jacobian.T @ residual, assume_a="pos").reshape(x.shape)
        for share in 0.5 ** np.arange(8):
            terms = _terms(arm, points, tried := x + share * step, wanted, limits, bends)
            if (lower := float(terms[0] @ terms[0])) < cost:
                break
        else:
            break
        fell, cost, x, (residual, jacobian) = cost - lower, lower, tried, terms
        if fell < 1e-6 * cost:
            break
    return x, cost


def _terms(arm: ReducedArm, points: Positions, x: np.ndarray, wanted: Vector3, limits, bends):
    """All terms of the sum, and their derivatives in the joints of all knots."""
    rows, n = x.shape
    tool, axes, places = arm.geometry(x)
    pointing = tool[:, :, 2]
    low, high = LIMIT_MARGIN - (x - limits[:, 0]), LIMIT_MARGIN - (limits[:, 1] - x)
    near = np.where(low > 0.0, low, np.where(high > 0.0, -high, 0.0))
    moves = POINT_GAIN * np.cross(axes, tool[:, None, :, 3] - places)
    moves, turns = (np.swapaxes(p, 1, 2) @ arm.drives for p in (moves, np.cross(axes, pointing[:, None])))
    own = np.concatenate([moves, turns, -LIMIT_WEIGHT * (near != 0.0)[:, None] * np.eye(n)], 1)
    jacobian = np.zeros((rows, own.shape[1], rows, n))
    jacobian[np.arange(rows), :, np.arange(rows)] = own
    value = np.concatenate([POINT_GAIN * (tool[:, :, 3] - points), pointing - wanted, LIMIT_WEIGHT * near], 1)
    bent = SMOOTH * np.einsum("br,ij->birj", bends, np.eye(n))
    return (
        np.concatenate([value.ravel(), SMOOTH * (bends @ x).ravel()]),
        np.concatenate([jacobian.reshape(-1, rows * n), bent.reshape(-1, rows * n)]),
    )
