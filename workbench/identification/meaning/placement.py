"""Base, tool and joint zeros of many readings at once: closed forms, then damped Gauss–Newton steps."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm import chain as chains
from workbench.arm.many_starts import descend
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.hand_eye import base_and_tool, base_and_tool_by_places, nearest_rotation
from workbench.base.types import Matrix4
from workbench.identification.errors.row_errors import quantile
from workbench.identification.meaning.bounds import WEIGHT, affine_map, flange_poses

STEPS, SEARCHED = 4, 25
"""Steps from the closed forms, and where zeros are unknown."""
AFFINE_ROWS = 8
"""Rows from which on points alone begin best; orientations are the start of fewer."""
POOR = 0.005
"""Usual distance as a share of the reach above which the closed form of points may have misled."""
MIN_ROWS = 4
"""Minimum number of rows of which one may be set apart."""


@dataclass(frozen=True, eq=False)
class PlacedReadings:
    """Readings with the base, tool and zeros that fit their rows best.

    Args:
        base: Poses of the arm's base.
        tool: Poses of what was measured in the flange.
        zero: What is added to the joints [rad or m].
        error: Distances of the rows [m].
        turn: Angles of the rows [rad]; NaN without orientations.
        flange: Poses of the bare flange in the arm's base.
    """

    base: Float[np.ndarray, "s 4 4"]
    tool: Float[np.ndarray, "s 4 4"]
    zero: Float[np.ndarray, "s n"]
    error: Float[np.ndarray, "s rows"]
    turn: Float[np.ndarray, "s rows"]
    flange: Float[np.ndarray, "s rows 4 4"]

    def better(self, other: "PlacedReadings") -> "PlacedReadings":
        """Of each reading the one whose usual row is nearer."""
        own = np.median(self.error, axis=1) <= np.median(other.error, axis=1)
        pairs = ((getattr(self, f.name), getattr(other, f.name)) for f in fields(self))
        return PlacedReadings(*(np.where(own.reshape(-1, *[1] * (a.ndim - 1)), a, b) for a, b in pairs))

    @cached_property
    def apart(self) -> Bool[np.ndarray, "s rows"]:
        """Rows that stand off, about a fifth at most."""
        if self.error.shape[1] < MIN_ROWS:
            return np.zeros(self.error.shape, bool)
        middle, most = (quantile(self.error.T, share)[:, None] for share in (0.5, 0.8))
        return self.error > np.maximum(5.0 * middle, most)


def place(
    robot: Robot,
    joints: Float[np.ndarray, "s rows n"],
    points: Float[np.ndarray, "s rows 3"],
    rotations: Float[np.ndarray, "s rows 3 3"] | None,
    *,
    zeros: Sequence[int] = (),
    given: tuple[Matrix4, Matrix4] | None = None,
    robust: bool = True,
    by: Float[np.ndarray, "s rows 1"] | float = 1.0,
) -> PlacedReadings:
    """The best base and tool for each of some readings of one arm, robust against a few rows.

    Args:
        zeros: Joints whose zeros are unknown, too.
        given: Base and tool, if they are known.
        robust: Whether rows may be set apart.
        by: What multiplies the zeros row by row, as the column that a joint follows.
    """
    fit = _Fit(robot, joints, points, rotations, list(zeros), given, by)
    start = fit.start()
    if given is not None and not zeros:
        return fit.placed(*start)
    everything = np.ones(points.shape[:2])
    found = fit.placed(*fit.descended(start, everything))
    if rotations is not None and given is None:
        poor = np.median(found.error, axis=1) > POOR * robot.reach
        if poor.any():  # points in a plane can mislead their closed form
            found = found.better(fit.placed(*fit.descended(fit.start(by_turns=poor), everything)))
    apart = found.apart
    if not robust or not apart.any():
        return found
    return fit.placed(*fit.descended((found.base, found.tool, found.zero), np.where(apart, 0.0, everything)))


@dataclass(frozen=True, eq=False)
class _Fit:
    robot: Robot
    joints: Float[np.ndarray, "s rows n"]
    points: Float[np.ndarray, "s rows 3"]
    rotations: Float[np.ndarray, "s rows 3 3"] | None
    zeros: list[int]
    given: tuple[Matrix4, Matrix4] | None
    by: Float[np.ndarray, "s rows 1"] | float

    def start(self, by_turns: Bool[np.ndarray, " s"] | None = None) -> tuple[np.ndarray, ...]:
        """Bases, tools and zeros by closed forms, of orientations where wanted or where points are few."""
        count, rows, n = self.joints.shape
        base, tool = (np.tile(pose, (count, 1, 1)) for pose in self.given or (np.eye(4), np.eye(4)))
        zero = np.zeros((count, n))
        if self.given is not None:
            if self.zeros and self.rotations is not None:
                zero[:, [0, -1]] = self._ends(self.rotations)
            return base, tool, zero
        for k, (flange, points) in enumerate(zip(self.still, self.points, strict=True)):
            is_turned = by_turns is not None and by_turns[k]
            if self.rotations is not None and (is_turned or rows < AFFINE_ROWS):
                solve = base_and_tool_by_places if is_turned else base_and_tool
                base[k], tool[k] = solve(flange, se3.pose(self.rotations[k], points))
                continue
            linear, tool[k, :3, 3] = affine_map(flange, points)
            base[k, :3, :3] = nearest_rotation(linear.T)
            reached = flange[:, :3, 3] + flange[:, :3, :3] @ tool[k, :3, 3]
            base[k, :3, 3] = (points - reached @ base[k, :3, :3].T).mean(0)
            if self.rotations is not None:
                turned = base[k, :3, :3] @ flange[:, :3, :3]
                tool[k, :3, :3] = nearest_rotation((np.swapaxes(turned, 1, 2) @ self.rotations[k]).sum(0))
        return base, tool, zero

    def _ends(self, rotations: np.ndarray) -> Float[np.ndarray, "s 2"]:
        """Zeros of the first and the last joint, as a base and tool that are known would have to turn."""
        poses, twists = chains.joint_twists(self.robot.chain, self.joints[0, :1])
        first, last = twists[0, 3:, 0], poses[0, :3, :3].T @ twists[0, 3:, -1]
        turned = map(base_and_tool, self.still, se3.pose(rotations, self.points))
        return np.array([(_angle(base, first), _angle(tool, last)) for base, tool in turned])

    @cached_property
    def still(self) -> Float[np.ndarray, "s rows 4 4"]:
        """Poses of the bare flange with all zeros as given."""
        return flange_poses(self.robot, self.joints)

    def placed(self, base: np.ndarray, tool: np.ndarray, zero: np.ndarray) -> PlacedReadings:
        flange = flange_poses(self.robot, self.joints + self.by * zero[:, None]) if zero.any() else self.still
        at = base[:, None] @ flange @ tool[:, None]
        error = np.linalg.norm(at[..., :3, 3] - self.points, axis=2)
        turn = np.full(error.shape, np.nan)
        if self.rotations is not None:
            turn = np.linalg.norm(_turned(self.rotations, at[..., :3, :3]), axis=2)
        return PlacedReadings(base, tool, zero, error, turn, flange)

    def descended(self, start: tuple[np.ndarray, ...], weights: np.ndarray) -> tuple[np.ndarray, ...]:
        """Base, tool and zeros that leave least of the rows by weight."""
        count, n = len(weights), self.joints.shape[-1]
        angle, is_free = WEIGHT * self.robot.reach, self.given is None

        def linearise(base, tool, zero):
            flange = self.still
            if self.zeros:
                q = np.ascontiguousarray((self.joints + self.by * zero[:, None]).reshape(-1, n))
                both = chains.joint_twists(self.robot.chain, q)
                flange, twists = (part.reshape(*weights.shape, *part.shape[1:]) for part in both)
            arm = base[:, None] @ flange
            turned, lever = arm[..., :3, :3], (arm[..., :3, :3] @ tool[:, None, :3, 3:])[..., 0]
            at, seen = arm[..., :3, 3] + lever, turned @ tool[:, None, :3, :3]
            eye = np.broadcast_to(np.eye(3), turned.shape)
            moves = []  # velocity and rate of turning for each unknown
            if is_free:
                moves = [(-se3.skew(at - base[:, None, :3, 3]), eye), (eye, 0.0 * eye), (turned, 0.0 * eye)]
            if self.zeros:
                some = twists[..., self.zeros] * np.asarray(self.by)[..., None]
                some = some.reshape(*weights.shape, 2, 3, -1)
                along, about = np.moveaxis(base[:, None, None, :3, :3] @ some, 2, 0)
                moves.append((along - se3.skew(lever) @ about, about))
            if is_free and self.rotations is not None:
                moves.append((0.0 * eye, seen))
            velocity, turning = (np.concatenate(part, axis=3) for part in zip(*moves, strict=True))
            error, jacobian = self.points - at, velocity
            if self.rotations is not None:
                error = np.concatenate([error, angle * _turned(self.rotations, seen)], axis=2)
                jacobian = np.concatenate([velocity, angle * turning], axis=2)
            error, jacobian = weights[..., None] * error, weights[..., None, None] * jacobian
            return error.reshape(count, -1), jacobian.reshape(count, -1, jacobian.shape[-1])

        def moved(base, tool, zero, step):
            base, tool, zero = base.copy(), tool.copy(), zero.copy()
            frames, ends = step[:, : 9 * is_free], step[:, 9 * is_free :]
            zero[:, self.zeros] += ends[:, : len(self.zeros)]
            if is_free:
                base[:, :3, :3] = se3.rotvec_to_matrix(frames[:, :3]) @ base[:, :3, :3]
                base[:, :3, 3] += frames[:, 3:6]
                tool[:, :3, 3] += frames[:, 6:9]
                if self.rotations is not None:
                    tool[:, :3, :3] = tool[:, :3, :3] @ se3.rotvec_to_matrix(ends[:, -3:])
            return base, tool, zero

        return descend(start, linearise, moved, steps=SEARCHED if self.zeros else STEPS)[0]


def _turned(measured: np.ndarray, predicted: np.ndarray) -> Float[np.ndarray, "s rows 3"]:
    """Rotation vectors from predicted to measured orientations."""
    return se3.matrix_to_rotvec(measured @ np.swapaxes(predicted, -1, -2))


def _angle(pose: Float[np.ndarray, "4 4"], axis: Float[np.ndarray, "3"]) -> float:
    """The angle [rad] of the rotation about an axis that is nearest to a pose's; 0 without an axis."""
    turn = pose[:3, :3]
    sine = axis @ (turn[[2, 0, 1], [1, 2, 0]] - turn[[1, 2, 0], [2, 0, 1]])
    return float(np.arctan2(sine, np.trace(turn) - axis @ turn @ axis) * np.linalg.norm(axis))
