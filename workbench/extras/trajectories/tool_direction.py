"""A tool's direction held as nearly as possible, if an arm can't hold it exactly.

With more joints than positions require, the postures of a path are optimised together: the joints q_k of
knots along it minimise

    Σ |z(q_k) − z*|² + s² Σ |q_{k−1} − 2 q_k + q_{k+1}|² + h² Σ (max(0, m − margin(q_k)))²

with the tool at its points: z the direction of the tool's z axis, z* the requested one, m a margin from
the limits. A closed path ends in its initial posture. Gauss–Newton with step halving; the positions are part
of the sum with a large weight and are met exactly afterwards.
"""

import numpy as np
from jaxtyping import Float
from scipy import linalg

from workbench.arm.inverse.branch import margins
from workbench.arm.inverse.damped_newton import Task, refine
from workbench.arm.inverse.reduced_arm import ReducedArm, compile_arm
from workbench.arm.inverse.solutions import STARTS, nearby_starts
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import JointRows, Positions, Vector3
from workbench.extras.trajectories.curves import Curve, Shares
from workbench.extras.trajectories.path import followed

KNOTS = 41
"""Number of optimised postures; those between follow a spline."""
POINT_GAIN = 1e4
"""Weight of the positions [1/m]."""
SMOOTH = 3.0
"""Weight s of the curvature of the joints' paths."""
LIMIT_MARGIN = float(np.deg2rad(3.0))
"""Margin m from the limits [rad or m]."""
MIN_LIMIT_MARGIN = float(np.deg2rad(1.0))
"""Minimum margin of every row [rad or m]."""
LIMIT_WEIGHT = 30.0
"""Weight h of missing margin."""
ITERATIONS = 60
"""Maximum number of steps."""
RIDGE = 1e-6
"""Added to the Hessian, which is singular along some directions in posture space."""
START_POSTURES, FAR = 4, 0.5
"""Number of postures at the first point from which the search starts, and how far apart [rad or m]."""
TOLERANCE = 1e-6
"""Relative decrease of the sum below which it has converged."""
ALLOWED = 1e-6
"""Maximum distance from its point [m]."""


def follow_near_direction(robot: Robot, curve: Curve, shares: Shares, wanted: Vector3) -> JointRows | None:
    """Joints that move the tool along a curve with its z axis near a direction; None if none are found.

    Args:
        robot: Geometry with limits, more than three joints; its base frame is that of the curve.
        curve: Curve for the tool.
        shares: Share of its length at every row.
        wanted: Requested unit vector of the tool's z axis.
    """
    from scipy.interpolate import make_interp_spline  # no page needs it to begin with

    arm, limits = compile_arm(robot), robot.limits
    few = np.linspace(0.0, 1.0, KNOTS)
    knots, aims = curve.points(few), _aims(curve.points(shares))
    found: list[tuple[float, JointRows]] = []
    for start in _starts(robot, knots[0], wanted):
        led = followed(arm, _aims(knots), start, task=Task.POSITION, limits=limits)
        if len(led) < KNOTS:
            continue
        x, cost = _optimised(arm, knots, led, wanted, limits)
        rows = make_interp_spline(few, x, k=5)(shares)
        met = refine(arm, aims, rows, task=Task.POSITION, limits=limits)
        if met.position_error.max() < ALLOWED and margins(met.q, limits).min() > MIN_LIMIT_MARGIN:
            found.append((cost, met.q))
    return min(found, key=lambda pair: pair[0])[1] if found else None


def _starts(robot: Robot, point: Vector3, wanted: Vector3) -> list[np.ndarray]:
    """Postures at the first point, far from each other, whose direction is nearest to the requested one."""
    across = np.linalg.svd(wanted[None])[2][1:]
    arm, pose = compile_arm(robot), se3.pose(np.column_stack([*across, wanted]), point)
    near = nearby_starts(arm, pose[None], Task.POSITION_AXIS, STARTS, is_limited=True)[0]
    met = refine(arm, pose[None], near, task=Task.POSITION, limits=robot.limits)
    postures = met.q[met.converged]
    postures = postures[np.argsort(-(arm.geometry(postures)[0][:, :3, 2] @ wanted))]
    found: list[np.ndarray] = []
    for q in postures:
        if len(found) < START_POSTURES and all(np.abs(q - other).max() > FAR for other in found):
            found.append(q)
    return found


def _aims(points: Positions) -> Float[np.ndarray, "rows 4 4"]:
    return se3.pose(np.tile(np.eye(3), (len(points), 1, 1)), points)


def _optimised(
    arm: ReducedArm, points: np.ndarray, x: np.ndarray, wanted: Vector3, limits: np.ndarray
) -> tuple[np.ndarray, float]:
    """The postures of smallest cost near the given ones, and their cost."""
    closed = bool(np.linalg.norm(points[-1] - points[0]) < ALLOWED)
    bends = _bends(len(x), closed)
    residual, jacobian = _terms(arm, points, x, wanted, limits, bends)
    cost = float(residual @ residual)
    for _ in range(ITERATIONS):
        curvature = jacobian.T @ jacobian + RIDGE * np.eye(x.size)
        step = -linalg.solve(curvature, jacobian.T @ residual, assume_a="pos").reshape(x.shape)
        for share in 0.5 ** np.arange(8):
            tried = x + share * step
            terms = _terms(arm, points, tried, wanted, limits, bends)
            if (lower := float(terms[0] @ terms[0])) < cost:
                break
        else:
            return x, cost
        fell, cost, x, (residual, jacobian) = cost - lower, lower, tried, terms
        if fell < TOLERANCE * cost:
            break
    return x, cost


def _bends(rows: int, closed: bool) -> Float[np.ndarray, "bends rows"]:
    """Second differences; for a closed path also across its end."""
    plain = np.diff(np.eye(rows), 2, axis=0)
    if not closed:
        return plain
    over, same = np.zeros(rows), np.zeros(rows)
    over[[-2, 0, 1]] = 1.0, -2.0, 1.0
    same[[0, -1]] = POINT_GAIN, -POINT_GAIN
    return np.vstack([plain, over, same])


def _terms(
    arm: ReducedArm, points: np.ndarray, x: np.ndarray, wanted: Vector3, limits: np.ndarray, bends: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """All terms of the sum, and their derivatives in the joints of all knots."""
    rows, n = x.shape
    tool, axes, places = arm.geometry(x)
    pointing = tool[:, :, 2]
    lever = np.cross(axes, tool[:, None, :, 3] - places)
    slides = arm.slides[None, :, None]
    moves = POINT_GAIN * np.where(slides, axes, lever)
    turns = np.where(slides, 0.0, np.cross(axes, pointing[:, None]))
    low, high = LIMIT_MARGIN - (x - limits[:, 0]), LIMIT_MARGIN - (limits[:, 1] - x)
    near = np.where(low > 0.0, low, np.where(high > 0.0, -high, 0.0))
    push = -LIMIT_WEIGHT * (near != 0.0)
    moves, turns = (np.swapaxes(part, 1, 2) @ arm.drives for part in (moves, turns))
    own = np.concatenate([moves, turns, push[:, None] * np.eye(n)], 1)
    jacobian = np.zeros((rows, own.shape[1], rows, n))
    jacobian[np.arange(rows), :, np.arange(rows)] = own
    value = np.concatenate([POINT_GAIN * (tool[:, :, 3] - points), pointing - wanted, LIMIT_WEIGHT * near], 1)
    deflected = SMOOTH * np.einsum("br,ij->birj", bends, np.eye(n))
    return (
        np.concatenate([value.ravel(), SMOOTH * (bends @ x).ravel()]),
        np.concatenate([jacobian.reshape(-1, rows * n), deflected.reshape(-1, rows * n)]),
    )
