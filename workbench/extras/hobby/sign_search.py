"""Which way each motor counts, by trial of every choice of signs; mounting unknown at both ends.

    B_i = X · C_0 Z(s_1 m_i1 + o_1) C_1 … Z(s_n m_in + o_n) C_n · Y,      s_k = ±1

m are the motors' angles, B measured poses, X and Y the unknown mounting of camera and board. o_1 is a turn
of X and o_n one of Y: both stay 0. Every choice of signs is begun at every choice of quarter turns of the
other offsets, X and Y by the closed form of hand–eye calibration, and the best of each choice of signs are
refined by Gauss–Newton. If no choice fits, motors are exchanged as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.inverse.reduced_arm import ReducedArm, compile_arm
from workbench.arm.many_starts import descend
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.hand_eye import base_and_tool

WEIGHT = 0.3
"""Length at which an angle counts, as a share of the arm's."""
REFINED = 4
"""Starts of each choice of signs that are refined."""
QUARTERED = 6
"""Joints up to which every quarter turn is tried."""
QUARTERS = (0.0, 0.5 * np.pi, np.pi, -0.5 * np.pi)
SERVO_ERRORS = (0.05, float(np.deg2rad(6.0)))
"""Root mean square that servo arms leave: position, as a share of the arm's length, and angle [rad]."""


@dataclass(frozen=True, eq=False)
class Counting:
    """How motors count.

    Args:
        order: Motor of each joint, from 0.
        signs: 1, or −1 where the motor counts against the joint.
        offsets: Joint position where the motor's angle is 0 [rad]; 0 at the first and last joint.
        errors: Root mean square of what is left: position [m], angle [rad].
        cost: The same as one length, in parts of the arm's.
        base: X, pose of the arm's base in the measuring frame.
        end: Y, pose of the board in the arm's last frame.
    """

    order: Int[np.ndarray, " n"]
    signs: Float[np.ndarray, " n"]
    offsets: Float[np.ndarray, " n"]
    errors: tuple[float, float]
    cost: float
    base: Float[np.ndarray, "4 4"]
    end: Float[np.ndarray, "4 4"]

    @property
    def turned(self) -> float:
        """Sum of all offsets, whichever way [rad]."""
        return float(np.abs(self.offsets).sum())

    def joints(self, motors: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "rows n"]:
        return self.signs * motors[:, self.order] + self.offsets

    def fits(self, length: float) -> bool:
        """Whether no more is left than servo arms leave."""
        return self.errors[0] < SERVO_ERRORS[0] * length and self.errors[1] < SERVO_ERRORS[1]


def find_counting(
    robot: Robot, motors: Float[np.ndarray, "rows n"], poses: Float[np.ndarray, "rows 4 4"]
) -> list[Counting]:
    """The best refined start of every choice of signs, the best first; exchanged motors if no other fits."""
    arm = compile_arm(robot.bare)
    n = arm.dof
    found = _of_order(arm, motors, poses, np.arange(n), QUARTERS if n <= QUARTERED else (0.0,))
    if not any(each.fits(arm.length) for each in found):
        for pair in combinations(range(n), 2):
            order = np.arange(n)
            order[list(pair)] = pair[::-1]
            found += _of_order(arm, motors, poses, order, (0.0,))
    return sorted(found, key=lambda c: c.cost)


def _of_order(arm: ReducedArm, motors, poses, order: np.ndarray, turns: Sequence[float]) -> list[Counting]:
    q = motors[:, order]
    begun = [_begin(arm, q, poses, signs, turns) for signs in product((1.0, -1.0), repeat=arm.dof)]
    signs, offsets = (np.concatenate(parts) for parts in zip(*begun, strict=True))
    offsets, base, end, error = _refined(arm, q, poses, signs, offsets)
    size = np.sqrt([(error[..., part] ** 2).sum(2).mean(1) for part in (slice(0, 3), slice(3, 6))])
    cost = np.hypot(size[0] / arm.length, WEIGHT * size[1])
    out = []
    for first in range(0, len(cost), each := len(begun[0][0])):
        k = first + int(np.argmin(cost[first : first + each]))
        errors = float(size[0, k]), float(size[1, k])
        out.append(Counting(order, signs[k], offsets[k], errors, float(cost[k]), base[k], end[k]))
    return out


def _begin(arm: ReducedArm, q: np.ndarray, poses: np.ndarray, signs: tuple[float, ...], turns):
    """The most promising quarter turns of one choice of signs."""
    offsets = np.array([(0.0, *o, 0.0) for o in product(turns, repeat=arm.dof - 2)])
    tool = _tools(arm, np.array(signs) * q + offsets[:, None])[0]
    base, end = base_and_tool(tool, poses)
    error = se3.pose_error(np.broadcast_to(poses, tool.shape), base[:, None] @ tool @ end[:, None])
    best = np.argsort(((error * _scale(arm)) ** 2).sum((1, 2)), kind="stable")[:REFINED]
    return np.tile(signs, (len(best), 1)), offsets[best]


def _scale(arm: ReducedArm) -> np.ndarray:
    return np.repeat([1.0 / arm.length, WEIGHT], 3)


def _tools(arm: ReducedArm, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Poses (c, m, 4, 4), axes and their points (c, m, n, 3) of joint positions (c, m, n)."""
    tool, axes, points = arm.geometry(q[..., arm.columns].reshape(-1, arm.dof))
    full = se3.pose(tool[:, :, :3], tool[:, :, 3]).reshape(*q.shape[:2], 4, 4)
    return full, axes.reshape(*q.shape, 3), points.reshape(*q.shape, 3)


def _refined(arm: ReducedArm, q, poses, signs, offsets) -> tuple[np.ndarray, ...]:
    """Offsets, X and Y, and the errors that are left (c, m, 6), after damped Gauss–Newton steps."""
    base, end = base_and_tool(_tools(arm, signs[:, None] * q + offsets[:, None])[0], poses)
    scale, free = _scale(arm), slice(1, arm.dof - 1)

    def linearise(offsets, base, end):
        error, jacobian = _linear(arm, q, poses, signs, offsets, base, end)
        lines = (jacobian * scale[:, None]).reshape(len(signs), -1, jacobian.shape[-1])
        return (error * scale).reshape(len(signs), -1), lines

    def moved(offsets, base, end, step):
        own = offsets.copy()
        own[:, free] += step[:, :-12]
        return own, _small(step[:, -12:-6]) @ base, end @ _small(step[:, -6:])

    (offsets, base, end), left = descend((offsets, base, end), linearise, moved)
    error = left.reshape(*base.shape[:1], -1, 6) / scale
    return (offsets + np.pi) % (2.0 * np.pi) - np.pi, base, end, error


def _linear(arm: ReducedArm, q, poses, signs, offsets, base, end) -> tuple[np.ndarray, np.ndarray]:
    """Errors (c, m, 6) and their derivatives (c, m, 6, n + 10) by middle offsets, X and Y."""
    tool, axes, points = _tools(arm, signs[:, None] * q + offsets[:, None])
    ends = base[:, None] @ tool @ end[:, None]
    error = se3.pose_error(np.broadcast_to(poses, ends.shape), ends)
    turn = base[:, None, None, :3, :3]
    places = np.argsort(arm.columns)[1:-1]
    axes = (turn @ axes[:, :, places, :, None])[..., 0]
    points = (turn @ points[:, :, places, :, None])[..., 0] + base[:, None, None, :3, 3]
    joint = np.concatenate([np.cross(axes, ends[:, :, None, :3, 3] - points), axes], -1).swapaxes(2, 3)
    at_base = np.zeros((*ends.shape[:2], 6, 6))
    at_base[..., :3, :3] = at_base[..., 3:, 3:] = np.eye(3)
    at_base[..., :3, 3:] = -se3.skew(ends[..., :3, 3])
    at_end = np.zeros_like(at_base)
    at_end[..., :3, :3] = at_end[..., 3:, 3:] = ends[..., :3, :3]
    return error, np.concatenate([joint, at_base, at_end], -1)


def _small(twist: np.ndarray) -> np.ndarray:
    """A small motion, about the origin of the frame whose axes it has."""
    return se3.pose(se3.rotvec_to_matrix(twist[:, 3:]), twist[:, :3])
