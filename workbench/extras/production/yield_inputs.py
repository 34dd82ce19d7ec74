"""What a trial of many arms needs: the plate and its errors, the arms' errors, the evaluation poses."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm.kinematics.forward import geometric_jacobian, identification_jacobian
from workbench.arm.linearisation import Linearisation, linearise
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.errors import DataError, OptionError
from workbench.base.types import frozen
from workbench.data.accuracy_requirement import Requirement, Wanted
from workbench.extras.production.reach_targets import branches_by_distance, deflected
from workbench.plate.plate import Kind, Plate

ACROSS = 1e3
"""Least well known direction of a place read by distances, in deviations of a distance."""
EXACT_SIGMA = 1e-9
"""Standard deviation by which exact readings are weighted [m or rad]."""
TESTS = 48
"""Poses of the region at which each arm is judged."""
SOURCES = {
    "seat position": "seat_position",
    "seat rotation": "seat_rotation",
    "joint readings": "joint",
    "target position": "target_position",
    "target rotation": "target_rotation",
    "play in the seats": "play",
    "anchors of the ball-bar": "anchor",
    "undeclared effects": "undeclared",
}
"""Sources of error by their fields."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ErrorSizes:
    """Errors between the drawing and the measurement; standard deviations per axis.

    Args:
        seat_position: How well the tool returns to a seat, and what the instrument adds [m].
        seat_rotation: The same for its orientation [rad].
        joint: Of the joint readings [rad or m].
        target_position: How well the places of targets are known, one for each [m].
        target_rotation: And their orientations [rad].
        play: Of the probe in each target: position [m] and rotation [rad]; none if None.
        away: Of a ball-bar, unit vectors from its anchors to each target, measuring frame; else None.
            The seat's position error is then the bar's.
        anchor: How well its anchors are known along each axis, the same for all targets [m].
        undeclared: The nominal arm with effects that the calibration does not know; None for none.
    """

    seat_position: float
    seat_rotation: float
    joint: float
    target_position: Float[np.ndarray, " targets"]
    target_rotation: Float[np.ndarray, " targets"]
    play: Float[np.ndarray, "targets 2"] | None = None
    away: Float[np.ndarray, "targets anchors 3"] | None = None
    anchor: float = 0.0
    undeclared: Robot | None = None

    def __post_init__(self):
        given = (self.seat_position, self.seat_rotation, self.joint)
        if min(*given, self.target_position.min(initial=0.0), self.target_rotation.min(initial=0.0)) < 0.0:
            raise OptionError(
                "a standard deviation of the yield's errors is negative; give 0 or more", option="sigma"
            )

    def alone(self) -> dict[str, "ErrorSizes"]:
        """Every source of error that is not zero, each by itself."""
        none: dict[str, Any] = dict.fromkeys(("seat_position", "seat_rotation", "joint", "anchor"), 0.0)
        none |= dict.fromkeys(("target_position", "target_rotation"), np.zeros_like(self.target_position))
        silent = replace(self, **none, play=None, undeclared=None)
        sources = {label: replace(silent, **{name: getattr(self, name)}) for label, name in SOURCES.items()}
        return {label: errors for label, errors in sources.items() if errors.any}

    @property
    def any(self) -> bool:
        """Whether anything goes wrong at all."""
        scalars = self.seat_position or self.seat_rotation or self.joint
        plate = self.target_position.any() or self.target_rotation.any() or self.played.any()
        return bool(scalars or plate or self.anchor or self.undeclared)

    @property
    def played(self) -> Float[np.ndarray, "targets 2"]:
        return np.zeros((len(self.target_position), 2)) if self.play is None else self.play

    @property
    def spread(self) -> Float[np.ndarray, "targets 3 3"]:
        """Covariance of a place read by its distances from a ball-bar's anchors, in variances of a distance.

        In the anchors' plane no distance shows the direction across it: `ACROSS` is taken.
        """
        assert self.away is not None
        return np.linalg.inv(np.swapaxes(self.away, 1, 2) @ self.away + np.eye(3) / ACROSS**2)

    @property
    def assumed(self) -> Float[np.ndarray, "targets 6"]:
        """Deviations by which the identification weights its rows: seat, play and target together."""
        position = np.hypot(np.hypot(self.seat_position, self.target_position), self.played[:, 0])
        if self.away is not None:
            along = np.sqrt(np.diagonal(self.spread, axis1=1, axis2=2)) * self.seat_position
            return np.maximum(np.column_stack([along, np.ones_like(along)]), EXACT_SIGMA)
        rotation = np.hypot(np.hypot(self.seat_rotation, self.target_rotation), self.played[:, 1])
        return np.maximum(np.repeat(np.column_stack([position, rotation]), 3, axis=1), EXACT_SIGMA)


@dataclass(frozen=True, eq=False, kw_only=True)
class YieldJob:
    """One trial.

    Args:
        names: Constants that are made with errors and identified.
        poses: Nominal poses of the tool at the targets, measuring frame.
        q: Nominal joint positions there [rad or m].
        constrained: What of [p; φ] each target constrains.
        errors: What goes wrong.
        sigma: By which the identification weights its rows [m, rad].
        length: Maximum manufacturing error of a length [m].
        angle: Maximum manufacturing error of an angle [rad].
        bank: Joint positions of the evaluation poses [rad or m].
        cells: Cube of the region that each of them lies in.
        tests: At how many of them each arm is judged.
        wanted: What every pose of an arm has to keep.
    """

    robot: Robot
    names: tuple[str, ...]
    poses: Float[np.ndarray, "targets 4 4"]
    q: Float[np.ndarray, "targets n"]
    constrained: Bool[np.ndarray, "targets 6"]
    errors: ErrorSizes
    sigma: Float[np.ndarray, "targets 6"]
    length: float
    angle: float
    bank: Float[np.ndarray, "rows n"]
    cells: Int[np.ndarray, " rows"]
    tests: int = TESTS
    wanted: Wanted = field(default_factory=lambda: Requirement().wanted)

    @cached_property
    def branches(self) -> Float[np.ndarray, "targets branches n"]:
        """The planned joint positions at every target, then those of its other branches."""
        return frozen(branches_by_distance(self.robot, self.poses, self.q))

    @cached_property
    def linearisation(self) -> Linearisation:
        """Of the targets at the nominal arm, as identified; a ball-bar's anchors are solved for."""
        _, twists = identification_jacobian(self.robot, Motion(self.q), self.names)
        like = linearise(self.robot, self.q[:1], names=self.names)
        rows = (twists / self.sigma[:, :, None])[self.constrained]
        anchors = (self.anchored / self.sigma[:, :, None])[self.constrained]
        known = anchors.shape[1]  # a row for what is known of each coordinate of an anchor
        beside = np.linalg.qr(np.concatenate([anchors, np.eye(known) / (self.errors.anchor or 1.0)]))[0]
        rows = np.concatenate([rows, np.zeros((known, rows.shape[1]))])
        return Linearisation(
            jacobian=frozen(rows - beside @ (beside.T @ rows)),
            names=self.names,
            units=like.units,
            sigma=frozen(np.append(self.sigma[self.constrained], np.full(known, self.errors.anchor))),
            measurement=frozen(np.append(np.nonzero(self.constrained)[0], np.full(known, len(self.q)))),
            length=like.length,
        )

    @cached_property
    def anchored(self) -> Float[np.ndarray, "targets 6 u"]:
        """How targets move with the coordinates of a ball-bar's anchors; no columns where they are exact."""
        away = self.errors.away
        if away is None or not self.errors.anchor:
            return np.zeros((len(self.q), 6, 0))
        count = away.shape[1]
        lengths = np.eye(count)[None, :, :, None] * away[:, :, None, :]
        moved = np.linalg.pinv(away) @ lengths.reshape(len(away), count, 3 * count)
        return frozen(np.concatenate([moved, np.zeros_like(moved)], axis=1))

    @cached_property
    def prior(self) -> Float[np.ndarray, " p"]:
        """What is known of each constant's error beforehand, from its bounds: 1/σ² [1/m² or 1/rad²]."""
        chain = self.robot.chain
        turns = np.array([chain.elements[i].axis.turns for i in chain.indices(self.names)], bool)
        bounds = np.maximum(np.where(turns, self.angle, self.length), EXACT_SIGMA)
        return frozen(3.0 / bounds**2)

    @cached_property
    def bend(self) -> Float[np.ndarray, "rows k"]:
        """What undeclared effects add to the chain at the evaluation poses, loaded as the nominal arm is."""
        actual = self.errors.undeclared or self.robot
        return frozen(deflected(actual, self.bank, np.zeros((len(self.bank), len(actual.chain.elements)))))

    def predicted(self) -> Float[np.ndarray, "rows 2"]:
        """Predicted mean square position [m²] and rotation error [rad²] at the evaluation poses.

        To first order at the nominal arm, undeclared effects left aside: with the rows' Jacobian A, their
        weights S⁻² and true covariance Σ, the identification is off by C AᵀS⁻² e, so that its covariance is
        C AᵀS⁻² Σ S⁻²A C.
        """
        whitened = self.linearisation.jacobian
        covariance = self.linearisation.covariance
        pull = covariance @ whitened.T
        noise = np.eye(len(whitened))
        if self.errors.joint > 0.0:
            steps = geometric_jacobian(self.robot, self.q) * (self.errors.joint / self.sigma[:, :, None])
            spread = np.zeros((*self.constrained.shape, *self.constrained.shape))
            own = np.arange(len(self.q))
            spread[own, :, own] = steps @ np.swapaxes(steps, 1, 2)
            rows = self.constrained.sum()
            noise[:rows, :rows] += spread[self.constrained][:, self.constrained]
        _, twists = identification_jacobian(self.robot, Motion(self.bank), self.names)
        off = twists @ (pull @ np.linalg.cholesky(noise))
        return np.stack([(off[:, :3] ** 2).sum((1, 2)), (off[:, 3:] ** 2).sum((1, 2))], -1)


def constrained_by(plate: Plate) -> Bool[np.ndarray, "targets 6"]:
    """What of [p; φ] each target constrains: a seat all, others the position."""
    return np.array([[True] * 3 + [t.kind is Kind.SEAT] * 3 for t in plate.targets], bool).reshape(-1, 6)


def check_job(job: YieldJob) -> None:
    """Refuse a trial that can't be carried out."""
    if len(job.q) < 3:
        raise DataError(f"a yield needs three targets or more, got {len(job.q)}", found=len(job.q))
    check_seats(job.robot, bool(job.constrained[:, 3:].any()))


def check_seats(robot: Robot, has_seats: bool) -> None:
    """Refuse seats for an arm with too few joints to sit in them."""
    if has_seats and robot.dof < 6:
        raise DataError(
            f"robot '{robot.name}' has {robot.dof} joints and can't sit in a seat; "
            "try a plate of sockets or points",
            found=robot.dof,
        )
