"""Readings: what is read at a plate's targets, as whitened rows of an identification Jacobian.

| name     | what a target is                        | what is read                                         |
|----------|-----------------------------------------|------------------------------------------------------|
| seat     | a face with pin and index hole          | the full pose                                        |
| socket   | a cone for a ball                       | the position of the ball's centre                    |
| point    | a centre for a pointed probe            | the position of the tip                              |
| contacts | three perpendicular faces, 3-2-1        | the pose, by six contacts of a cube on the tool      |
| ball-bar | a place in the air                      | distances of a ball on the tool from three anchors   |

A reading gives the derivative of its m components in the tool's twist [v; w] and in its own unknowns, such as
the position of a ball-bar's anchor; these are the derivatives of the observations in identification:

    y = B ξ + U u + noise,      ξ = J δp + e_target,      Σ = diag(σ²/visits) + B diag(σ_t²) Bᵀ

The target itself is uncertain by σ_t, from manufacture or measurement; repeated visits reduce the noise only.
Rows are whitened with the Cholesky factor of Σ. Unknowns of the reading are projected out of the rows of a
whole set together with what is known of them beforehand, which is exact for a linear model (Golub & Pereyra's
variable projection). `linearise_targets` is for a plate whose targets are of different kinds.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.kinematics.forward import identification_jacobian
from workbench.arm.linearisation import Linearisation, linearise
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.base.types import frozen
from workbench.data.dataset import Dataset
from workbench.data.observations import DistanceObservation, PointObservation, PoseObservation
from workbench.plate.plate import ANCHOR_SIGMA, Kind, Plate


class Look(NamedTuple):
    """How components change: per twist of the tool (base axes, at its origin) and per unknown.

    Args:
        by_twist: [1 or m].
        by_unknown: The same for the reading's own unknowns, u of them.
    """

    by_twist: Float[np.ndarray, "rows m 6"]
    by_unknown: Float[np.ndarray, "rows m u"]


@dataclass(frozen=True, eq=False, kw_only=True)
class TargetReading:
    """Reading at a target, and its accuracy.

    Args:
        kind: Degrees of freedom of the tool constrained by the target.
        look: Derivatives of the components at poses of the tool in the measuring frame.
        sigma: Standard deviation of every component at one visit [m or rad].
        unknown_sigma: Prior standard deviation of each of its own unknowns [m].
        visits: How often each target is visited.
        blocks: Whether a block stands under each target.
        anchors: Anchors of a ball-bar, in the plate's frame [m]; none if None.
    """

    name: str
    kind: Kind
    look: Callable[[Float[np.ndarray, "rows 4 4"]], Look]
    sigma: Float[np.ndarray, " m"]
    unknown_sigma: Float[np.ndarray, " u"] = field(default_factory=lambda: np.zeros(0))
    visits: int = 1
    blocks: bool = True
    anchors: Float[np.ndarray, "anchors 3"] | None = None

    @property
    def text(self) -> str:
        """How exactly it reads, for people."""
        turns = f", {np.rad2deg(self.sigma[-1]):.2g}°" if self.name == "seat" else ""
        times = "once" if self.visits == 1 else f"{self.visits} times"
        return f"{self.name} read {times} with {1e3 * self.sigma[0]:.3g} mm{turns}"

    def rows(
        self,
        poses: Float[np.ndarray, "rows 4 4"],
        twists: Float[np.ndarray, "rows 6 p"],
        target_sigma: Float[np.ndarray, "rows 2"],
    ) -> tuple[Float[np.ndarray, "rows m p"], Float[np.ndarray, "rows m u"]]:
        """Whitened rows per parameter and per unknown.

        Args:
            poses: Of the tool in the measuring frame.
            twists: Of the tool per parameter.
            target_sigma: Standard deviation of each target: position [m] and rotation [rad].
        """
        by_twist, by_unknown = self.look(poses)
        made = np.repeat(target_sigma**2, 3, axis=1)
        covariance = (by_twist * made[:, None]) @ np.swapaxes(by_twist, 1, 2)
        covariance += np.diag(self.sigma**2 / self.visits)
        factor = np.linalg.cholesky(covariance)
        both = np.linalg.solve(factor, np.concatenate([by_twist @ twists, by_unknown], axis=2))
        return both[..., : twists.shape[2]], both[..., twists.shape[2] :]


def linearise_reading(
    robot: Robot,
    q: Float[np.ndarray, "rows n"],
    reading: TargetReading,
    *,
    target_sigma: Float[np.ndarray, "rows 2"],
    names: tuple[str, ...],
) -> Linearisation:
    """Linearisation of a set of targets, the reading's unknowns projected out.

    Args:
        q: Joint positions at the targets [rad or m].
        reading: The reading there.
        target_sigma: Standard deviation of each target [m], [rad].
    """
    poses, twists = identification_jacobian(robot, Motion(q), names)
    jacobian, unknown = reading.rows(poses, twists, target_sigma)
    count, components = jacobian.shape[:2]
    prior = reading.unknown_sigma
    flat = np.concatenate([jacobian.reshape(-1, len(names)), np.zeros((len(prior), len(names)))])
    beside = np.linalg.qr(
        np.concatenate([unknown.reshape(count * components, len(prior)), np.diag(1.0 / prior)])
    )[0]
    like = linearise(robot, q[:1], names=names)
    return Linearisation(
        jacobian=frozen(flat - beside @ (beside.T @ flat)),
        names=names,
        units=like.units,
        sigma=frozen(np.concatenate([np.tile(reading.sigma, count), prior])),
        measurement=frozen(np.repeat(np.arange(count + 1), [components] * count + [len(prior)])),
        length=like.length,
    )


Maker = Callable[[Robot, Plate, float, float], TargetReading]
"""From arm, plate and the standard deviations of one visit [m], [rad]."""
HALF_CUBE = 0.02
"""Half the side of the cube on the tool that is pressed against six contacts [m]."""
REACH_OUT = 0.75
"""Distance of contacts from the centre of a face, as a share of half its side."""
INSET, LIFT = 0.06, 0.05
"""Distance of a ball-bar's anchors from the plate's edges, and height of their balls above it [m]."""

SEAT = (1e-4, float(np.deg2rad(0.02)))
"""Default standard deviations: position [m], rotation about an axis [rad]."""
SIGMAS: Mapping[str, tuple[float, float | None]] = MappingProxyType(
    {
        "seat": SEAT,
        "socket": (5e-5, None),
        "point": (1e-4, None),
        "contacts": (3e-5, None),
        "ball-bar": (5e-6, None),
    }
)
"""Standard deviations of one visit: position, contact or distance [m], rotation about an axis [rad]."""


def reading_named(
    name: str, robot: Robot, plate: Plate, *, sigma: tuple[float, float | None] | None = None, visits: int = 1
) -> TargetReading:
    """The reading of that name.

    Args:
        name: As in the table above.
        robot: Whose base the plate stands by.
        plate: Where a ball-bar's anchors stand.
        sigma: Standard deviations of one visit [m], [rad]; usual ones if None.
        visits: How often each target is visited.
    """
    if name not in MAKERS:
        raise OptionError(
            f"unknown reading of a target '{name}'; known: {', '.join(MAKERS)}", option="reading", found=name
        )
    if visits < 1:
        raise OptionError(
            f"visits of a target must be at least 1, got {visits}", option="visits", found=visits
        )
    position, rotation = sigma or SIGMAS[name]
    rotation = SEAT[1] if rotation is None else rotation
    if not (position > 0.0 and (rotation or 1.0) > 0.0):
        raise OptionError(
            "the instrument's standard deviations must be positive", option="sigma", found=sigma
        )
    return replace(MAKERS[name](robot, plate, position, rotation), visits=visits)


def _contacts(robot: Robot, plate: Plate, position: float, rotation: float) -> TargetReading:
    wrenches = contact_rows()

    def look(poses: Float[np.ndarray, "rows 4 4"]) -> Look:
        seen = _seen(PoseObservation, poses)
        turn = np.zeros((len(poses), 6, 6))
        turn[:, :3, :3] = turn[:, 3:, 3:] = np.swapaxes(poses[:, :3, :3], 1, 2)
        return Look(wrenches @ turn @ seen.by_twist, seen.by_unknown)

    return TargetReading(name="contacts", kind=Kind.SEAT, look=look, sigma=frozen(np.full(6, position)))


def _ball_bar(robot: Robot, plate: Plate, position: float, rotation: float) -> TargetReading:
    anchors = anchors_of(robot, plate)

    def look(poses: Float[np.ndarray, "rows 4 4"]) -> Look:
        looks = [_from_anchor(poses, anchors, k) for k in range(len(anchors))]
        return Look(*(np.concatenate(parts, axis=1) for parts in zip(*looks, strict=True)))

    return TargetReading(
        name="ball-bar",
        kind=Kind.POINT,
        look=look,
        sigma=frozen(np.full(len(anchors), position)),
        unknown_sigma=frozen(np.full(3 * len(anchors), ANCHOR_SIGMA)),
        blocks=False,
        anchors=_anchors(plate),
    )


def _seen_by(observation: type[PoseObservation] | type[PointObservation], kind: Kind) -> Maker:
    """What makes the reading of a kind of target that is seen as a whole."""

    def make(robot: Robot, plate: Plate, position: float, rotation: float) -> TargetReading:
        parts = [position, rotation] if observation is PoseObservation else [position]
        look = partial(_seen, observation)
        return TargetReading(name=str(kind), kind=kind, look=look, sigma=frozen(np.repeat(parts, 3)))

    return make


MAKERS: Mapping[str, Maker] = MappingProxyType(
    {
        "seat": _seen_by(PoseObservation, Kind.SEAT),
        "socket": _seen_by(PointObservation, Kind.SOCKET),
        "point": _seen_by(PointObservation, Kind.POINT),
        "contacts": _contacts,
        "ball-bar": _ball_bar,
    }
)
"""Functions that create each reading."""


def contact_rows() -> Float[np.ndarray, "6 6"]:
    """How six contacts of a cube move along their normals with the tool's twist, tool axes: [n; r × n].

    The cube's foot is at the tool's origin and z points into the plate: three contacts under it, two on its
    −x face and one on its −y face (the 3-2-1 rule of locating).
    """
    h, s = HALF_CUBE, REACH_OUT * HALF_CUBE
    x, y, z = np.eye(3)
    contacts = [
        (z, np.array([s, 0.0, 0.0])),
        (z, np.array([-s, s, 0.0])),
        (z, np.array([-s, -s, 0.0])),
        (x, np.array([-h, s, -h])),
        (x, np.array([-h, -s, -h])),
        (y, np.array([0.0, -h, -h])),
    ]
    return np.array([[*n, *np.cross(r, n)] for n, r in contacts])


def anchors_of(robot: Robot, plate: Plate) -> Float[np.ndarray, "anchors 3"]:
    """Places of a ball-bar's anchors, measuring frame [m]."""
    return se3.apply(robot.base.pose @ plate.pose, _anchors(plate))


def _anchors(plate: Plate) -> Float[np.ndarray, "anchors 3"]:
    """The plate's own anchors, or usual ones near two corners and an edge."""
    if plate.anchors is not None:
        return plate.anchors
    half = np.array([0.3, 0.3]) if plate.size is None else 0.5 * plate.size[:2]
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0]]) * np.maximum(half - INSET, 0.5 * half)
    return frozen(np.column_stack([corners, np.full(3, LIFT)]))


def _from_anchor(poses: np.ndarray, anchors: np.ndarray, number: int) -> Look:
    """Distances from one anchor, by the tool's twist and by the places of all anchors."""
    distance = np.linalg.norm(poses[:, :3, 3] - anchors[number], axis=1)
    data = _rows(poses, distance=distance, anchor=np.full(len(poses), str(number)))
    seen = DistanceObservation.of(data).linearise(poses, anchors[number])
    by_anchor = np.zeros((len(poses), 1, len(anchors), 3))
    by_anchor[:, :, number] = seen.by_unknown
    return Look(seen.by_twist, by_anchor.reshape(len(poses), 1, -1))


def _seen(observation: type[PoseObservation] | type[PointObservation], poses: np.ndarray) -> Look:
    data = _rows(poses, position=poses[:, :3, 3], rotation=poses[:, :3, :3])
    seen = observation.of(data).linearise(poses, np.zeros(0))
    return Look(seen.by_twist, seen.by_unknown)


def _rows(poses: np.ndarray, **columns: Any) -> Dataset:
    return Dataset(q=np.zeros((len(poses), 1)), row=np.arange(len(poses)), **columns)


def usual_reading(plate: Plate) -> str:
    """The default reading at the targets; a seat's pose if they differ."""
    kinds = {target.kind for target in plate.targets}
    return "ball-bar" if plate.anchors is not None else str(next(iter(kinds))) if len(kinds) == 1 else "seat"


def usual_sigma(plate: Plate) -> tuple[float, float]:
    """Default standard deviations of the reading at the targets [m], [rad]."""
    return SIGMAS[usual_reading(plate)][0], SEAT[1]


def assumptions(plate: Plate, sigma: tuple[float, float]) -> str:
    """What a predicted error holds, for people: instrument, making, and play in the seats."""
    turns = f", {np.rad2deg(sigma[1]):.2g}°" if plate.has_seats else ""
    return f"instrument {1e3 * sigma[0]:.3g} mm{turns}; {plate.assumptions}"


def linearise_targets(
    robot: Robot,
    plate: Plate,
    q: Float[np.ndarray, "rows n"],
    *,
    slots: Int[np.ndarray, " rows"] | None = None,
    names: tuple[str, ...] | None = None,
    sigma: tuple[float, float] = SEAT,
    additive: bool = False,
) -> Linearisation:
    """Linearisation of measurements at a plate's targets.

    Args:
        q: Joint positions at targets [rad or m].
        slots: Target of each row; all in order if None.
        names: Constants to identify; the robot's default free ones if None.
        sigma: Standard deviations of the instrument's positions [m] and rotations [rad].
        additive: Whether each measurement must stand for itself, so that sets add up: a ball-bar's anchors
            then count as if drawn anew for every target.
    """
    whole = linearise(robot, q, names=names, sigma_position=sigma[0], sigma_rotation=sigma[1])
    slots = np.arange(len(plate)) if slots is None else slots
    return (
        rows_of_targets(whole, plate, slots)
        if plate.anchors is None
        else _distances(robot, whole, plate, slots, additive)
    )


def _distances(
    robot: Robot, whole: Linearisation, plate: Plate, slots: Int[np.ndarray, " rows"], additive: bool
) -> Linearisation:
    """Of full poses, six rows each, the distances from a ball-bar's anchors; each is off by its anchor too.

    The anchors are off alike for all targets: rows are whitened by the symmetric root of their covariance
    σ² I + U Uᵀ, the same as solving for the anchors with what is known of them (`linearise_reading`).
    """
    away = plate.from_anchors[slots] @ robot.base.pose[:3, :3].T
    count = away.shape[1]
    moves = whole.unwhitened.reshape(len(slots), 6, -1)[:, :3]
    bar = np.repeat(whole.sigma.reshape(-1, 6)[:, 0], count)
    sigma = np.hypot(bar, ANCHOR_SIGMA)
    rows = (away @ moves).reshape(len(sigma), -1)
    if additive:
        rows = rows / sigma[:, None]
    else:
        own = np.eye(count)[None, :, :, None] * away[:, :, None, :] * ANCHOR_SIGMA
        shared = own.reshape(len(sigma), -1)
        values, vectors = np.linalg.eigh(np.diag(bar**2) + shared @ shared.T)
        rows = (vectors / np.sqrt(values)) @ (vectors.T @ rows)
    return replace(
        whole,
        jacobian=frozen(rows),
        sigma=frozen(sigma),
        measurement=frozen(np.repeat(np.arange(len(slots)), count)),
    )


def rows_of_targets(
    linearisation: Linearisation, plate: Plate, slots: Int[np.ndarray, " measurements"]
) -> Linearisation:
    """Of full poses, six rows each, what each measurement's target constrains, as well as it is known.

    Args:
        linearisation: Of full poses.
        slots: Target of each measurement.
    """
    targets = [plate.targets[slot] for slot in slots]
    own = plate.target_sigma[slots]
    sigma = np.hypot(linearisation.sigma, np.repeat(own, 3, axis=1).ravel())
    seats = np.array([t.kind is Kind.SEAT for t in targets], bool)
    constrained = np.repeat(np.column_stack([np.ones_like(seats), seats]), 3, axis=1).ravel()
    return replace(
        linearisation,
        jacobian=frozen((linearisation.unwhitened / sigma[:, None])[constrained]),
        sigma=frozen(sigma[constrained]),
        measurement=frozen(linearisation.measurement[constrained]),
    )
