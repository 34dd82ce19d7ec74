"""Which way each motor counts, by trial of every choice of signs; mounting unknown at both ends.

    B_i = X · C_0 Z(s_1 m_i1 + o_1) C_1 … Z(s_n m_in + o_n) C_n · Y,      s_k = ±1

m are the motors' angles, B measured poses, X and Y the unknown mounting of camera and board. o_1 is a turn
of X and o_n one of Y: both stay 0. Every choice of signs is begun at every choice of quarter turns of the
other offsets, X and Y by the closed form of hand–eye calibration, and the best of each choice of signs are
refined by Gauss–Newton.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.hand_eye import base_and_tool
from workbench.base.progress import check_cancelled
from workbench.identification.meaning.bounds import WEIGHT, flange_poses
from workbench.identification.meaning.placement import place

REFINED = 4
"""Starts of each choice of signs that are refined."""
QUARTERED, QUARTERS = 6, (0.0, 0.5 * np.pi, np.pi, -0.5 * np.pi)
"""Joints up to which every quarter turn is tried, and these [rad]."""
SERVO_ERRORS = (0.05, float(np.deg2rad(6.0)))
"""Root mean square that servo arms leave: position, as a share of the arm's length, and angle [rad]."""


@dataclass(frozen=True, eq=False)
class Counting:
    """How motors count.

    Args:
        signs: 1, or −1 where the motor counts against the joint.
        offsets: Joint position where the motor's angle is 0 [rad]; 0 at the first and last joint.
        errors: Root mean square of what is left: position [m], angle [rad].
        cost: The same as one length, in parts of the arm's.
        base: X, pose of the arm's base in the measuring frame.
        end: Y, pose of the board in the arm's last frame.
    """

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
        return self.signs * motors + self.offsets

    def fits(self, length: float) -> bool:
        """Whether no more is left than servo arms leave."""
        return self.errors[0] < SERVO_ERRORS[0] * length and self.errors[1] < SERVO_ERRORS[1]


def find_counting(
    robot: Robot, motors: Float[np.ndarray, "rows n"], poses: Float[np.ndarray, "rows 4 4"]
) -> list[Counting]:
    """The best refined start of every choice of signs, the best first."""
    bare, n = robot.bare, robot.dof
    turns = QUARTERS if n <= QUARTERED else (0.0,)
    begun = [_begin(bare, motors, poses, signs, turns) for signs in product((1.0, -1.0), repeat=n)]
    signs, offsets = (np.concatenate(parts) for parts in zip(*begun, strict=True))
    q, seen = signs[:, None] * motors + offsets[:, None], np.broadcast_to(poses, (len(signs), *poses.shape))
    at = place(bare, q, seen[..., :3, 3], seen[..., :3, :3], zeros=range(1, n - 1))
    offsets = (offsets + at.zero + np.pi) % (2.0 * np.pi) - np.pi
    size = np.sqrt([(error**2).mean(1) for error in (at.error, at.turn)])
    cost = np.hypot(size[0] / bare.reach, WEIGHT * size[1])
    out = []
    for first in range(0, len(cost), each := len(begun[0][0])):
        k = first + int(np.argmin(cost[first : first + each]))
        errors = float(size[0, k]), float(size[1, k])
        out.append(Counting(signs[k], offsets[k], errors, float(cost[k]), at.base[k], at.tool[k]))
    return sorted(out, key=lambda c: c.cost)


def _begin(bare: Robot, q: np.ndarray, poses: np.ndarray, signs: tuple[float, ...], turns: Sequence[float]):
    """The most promising quarter turns of one choice of signs."""
    check_cancelled()
    offsets = np.array([(0.0, *o, 0.0) for o in product(turns, repeat=bare.dof - 2)])
    tool = flange_poses(bare, np.array(signs) * q + offsets[:, None])
    base, end = base_and_tool(tool, poses)
    error = se3.pose_error(np.broadcast_to(poses, tool.shape), base[:, None] @ tool @ end[:, None])
    scaled = error * np.repeat([1.0 / bare.reach, WEIGHT], 3)
    best = np.argsort((scaled**2).sum((1, 2)), kind="stable")[:REFINED]
    return np.tile(signs, (len(best), 1)), offsets[best]
