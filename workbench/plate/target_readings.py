"""Readings: what is read at a plate's targets, as whitened rows of an identification Jacobian.

| name     | what a target is                        | what is read                                         |
|----------|-----------------------------------------|------------------------------------------------------|
| seat     | a face with pin and index hole          | the full pose                                        |
| socket   | a cone for a ball                       | the position of the ball's centre                    |
| point    | a centre for a pointed probe            | the position of the tip                              |
| contacts | three perpendicular faces, 3-2-1        | the pose, by six contacts of a cube on the tool      |
| ball-bar | a place in the air                      | distances of a ball on the tool from three anchors   |

A reading gives the derivative of its m components in the tool's twist [v; w] and in its own unknowns, the
places of a ball-bar's anchors:

    y = B ξ + U u + noise,      ξ = J δp + e_target,      Σ = diag(σ²/visits) + B diag(σ_t²) Bᵀ

The target itself is uncertain by σ_t, from manufacture or measurement; repeated visits reduce the noise only.
Rows are whitened with the Cholesky factor of Σ. Unknowns of the reading are solved for with what is known of
them beforehand, P: rows are whitened once more by the symmetric root of I + U P Uᵀ of the whole set, which is
the same for a linear model.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from types import MappingProxyType

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.kinematics.forward import identification_jacobian
from workbench.arm.linearisation import Linearisation, linearise
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.base.types import Poses, frozen
from workbench.plate.plate import ANCHOR_SIGMA, Kind, Plate

HALF_CUBE = 0.02
"""Half the side of the cube on the tool that is pressed against six contacts [m]."""
REACH_OUT = 0.75
"""Distance of contacts from the centre of a face, as a share of half its side."""
INSET, LIFT = 0.06, 0.05
"""Distance of a ball-bar's anchors from the plate's edges, and height of their balls above it [m]."""
SEAT = (1e-4, float(np.deg2rad(0.02)))
"""Default standard deviations of a seat's reading: position [m], rotation about an axis [rad]."""
READINGS: Mapping[str, tuple[Kind, float]] = MappingProxyType(
    {
        "seat": (Kind.SEAT, SEAT[0]),
        "socket": (Kind.SOCKET, 5e-5),
        "point": (Kind.POINT, 1e-4),
        "contacts": (Kind.SEAT, 3e-5),
        "ball-bar": (Kind.POINT, 5e-6),
    }
)
"""What each constrains, and the usual standard deviation of one visit: position, contact or distance [m]."""

ByTwist = Callable[[Poses], Float[np.ndarray, "rows m 6"]]
"""From poses of the tool in the measuring frame, derivatives of the components in its twist."""


@dataclass(frozen=True, eq=False, kw_only=True)
class TargetReading:
    """Reading at a target, and its accuracy.

    Args:
        kind: Degrees of freedom of the tool constrained by the target.
        by_twist: B.
        sigma: Standard deviation of every component at one visit [m or rad].
        visits: How often each target is visited.
        anchors: Of a ball-bar, whose places are its unknowns, in the plate's frame [m]; none if None.
    """

    name: str
    kind: Kind
    by_twist: ByTwist
    sigma: Float[np.ndarray, " m"]
    visits: int = 1
    anchors: Float[np.ndarray, "anchors 3"] | None = None

    @property
    def blocks(self) -> bool:
        """Whether a block stands under each target."""
        return self.anchors is None

    @property
    def unknown_sigma(self) -> Float[np.ndarray, " u"]:
        """Prior standard deviation of each of its own unknowns [m]."""
        return np.full(0 if self.anchors is None else self.anchors.size, ANCHOR_SIGMA)

    @property
    def text(self) -> str:
        """How exactly it reads, for people."""
        turns = f", {np.rad2deg(self.sigma[-1]):.2g}°" if self.name == "seat" else ""
        times = "once" if self.visits == 1 else f"{self.visits} times"
        return f"{self.name} read {times} with {1e3 * self.sigma[0]:.3g} mm{turns}"

    def rows(
        self, poses: Poses, twists: Float[np.ndarray, "rows 6 p"], target_sigma: Float[np.ndarray, "rows 2"]
    ) -> tuple[Float[np.ndarray, "rows m q"], Float[np.ndarray, "rows m"]]:
        """Whitened rows per parameter, then per unknown; and standard deviation of each before.

        Args:
            poses: Of the tool in the measuring frame.
            twists: Of the tool per parameter.
            target_sigma: Standard deviation of each target: position [m] and rotation [rad].
        """
        by_twist = self.by_twist(poses)
        rows = by_twist @ twists
        if self.anchors is not None:  # every distance falls as its own anchor comes nearer
            own = -np.eye(len(self.sigma))[:, :, None] * by_twist[:, :, None, :3]
            rows = np.concatenate([rows, own.reshape(*by_twist.shape[:2], -1)], axis=2)
        made = np.repeat(target_sigma**2, 3, axis=1)
        covariance = (by_twist * made[:, None]) @ np.swapaxes(by_twist, 1, 2)
        covariance += np.diag(self.sigma**2 / self.visits)
        sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
        return np.linalg.solve(np.linalg.cholesky(covariance), rows), sigma


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
    if name not in READINGS:
        raise OptionError(
            f"unknown reading of a target '{name}'; known: {', '.join(READINGS)}",
            option="reading",
            found=name,
        )
    if visits < 1:
        wrong = f"visits of a target must be at least 1, got {visits}"
        raise OptionError(wrong, option="visits", found=visits)
    kind, usual = READINGS[name]
    position, rotation = sigma or (usual, None)
    rotation = SEAT[1] if rotation is None else rotation
    if not (position > 0.0 and rotation > 0.0):
        wrong = "the instrument's standard deviations must be positive"
        raise OptionError(wrong, option="sigma", found=sigma)
    anchors = _anchors(plate) if name == "ball-bar" else None
    by_twist: ByTwist = _contacts
    deviations = [position] * (6 if anchors is None else len(anchors))
    if anchors is not None:
        by_twist = partial(_distances, anchors_of(robot, plate))
    elif name != "contacts":
        deviations = [position] * 3 + [rotation] * (3 if name == "seat" else 0)
        by_twist = lambda poses: np.tile(np.eye(6)[: len(deviations)], (len(poses), 1, 1))  # noqa: E731
    return TargetReading(
        name=name, kind=kind, by_twist=by_twist, sigma=np.array(deviations), visits=visits, anchors=anchors
    )


def _distances(anchors: Float[np.ndarray, "m 3"], poses: Poses) -> Float[np.ndarray, "rows m 6"]:
    away = poses[:, None, :3, 3] - anchors
    away /= np.linalg.norm(away, axis=2, keepdims=True)
    return np.concatenate([away, np.zeros_like(away)], axis=2)


def _contacts(poses: Poses) -> Float[np.ndarray, "rows 6 6"]:
    return np.concatenate(
        [part @ np.swapaxes(poses[:, :3, :3], 1, 2) for part in np.split(contact_rows(), 2, axis=1)], axis=2
    )


def contact_rows() -> Float[np.ndarray, "6 6"]:
    """How six contacts of a cube move along their normals with the tool's twist, tool axes: [n; r × n].

    The cube's foot is at the tool's origin and z points into the plate: three contacts under it, two on its
    −x face and one on its −y face (the 3-2-1 rule of locating).
    """
    h, s = HALF_CUBE, REACH_OUT * HALF_CUBE
    normals = np.eye(3)[[2, 2, 2, 0, 0, 1]]
    places = np.array([[s, 0, 0], [-s, s, 0], [-s, -s, 0], [-h, s, -h], [-h, -s, -h], [0, -h, -h]])
    return np.hstack([normals, np.cross(places, normals)])


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


def usual_reading(plate: Plate) -> str:
    """The default reading at the targets; a seat's pose if they differ."""
    kinds = {target.kind for target in plate.targets}
    return "ball-bar" if plate.anchors is not None else str(next(iter(kinds))) if len(kinds) == 1 else "seat"


def usual_sigma(plate: Plate) -> tuple[float, float]:
    """Default standard deviations of the reading at the targets [m], [rad]."""
    return READINGS[usual_reading(plate)][1], SEAT[1]


def assumptions(plate: Plate, sigma: tuple[float, float]) -> str:
    """What a predicted error holds, for people: instrument, making, and play in the seats."""
    turns = f", {np.rad2deg(sigma[1]):.2g}°" if plate.has_seats else ""
    return f"instrument {1e3 * sigma[0]:.3g} mm{turns}; {plate.assumptions}"


def linearise_reading(
    robot: Robot,
    q: Float[np.ndarray, "rows n"],
    reading: TargetReading,
    *,
    target_sigma: Float[np.ndarray, "rows 2"],
    names: tuple[str, ...],
    additive: bool = False,
) -> Linearisation:
    """Linearisation of a set of targets that are all read alike.

    Args:
        q: Joint positions at the targets [rad or m].
        reading: The reading there.
        target_sigma: Standard deviation of each target [m], [rad].
        additive: Whether each measurement must stand for itself, so that sets add up: a ball-bar's anchors
            then count as if drawn anew for every target.
    """
    poses, twists = identification_jacobian(robot, Motion(q), names)
    whole, sigma = reading.rows(poses, twists, target_sigma)
    rows, unknown = np.split(whole, [len(names)], axis=2)
    if unknown.size:
        beside = unknown * reading.unknown_sigma
        sigma = sigma * np.sqrt(1.0 + (beside**2).sum(2))
        sets = len(q) if additive else 1
        rows = _whitened(*(part.reshape(sets, -1, part.shape[2]) for part in (rows, beside)))
    return replace(
        _no_rows(robot, names),
        jacobian=frozen(rows.reshape(-1, len(names))),
        sigma=frozen(sigma.ravel()),
        measurement=frozen(np.repeat(np.arange(len(q)), sigma.shape[1])),
    )


@lru_cache(maxsize=4)
def _no_rows(robot: Robot, names: tuple[str, ...]) -> Linearisation:
    """Names, units and length of an arm's constants; kept, since a drag asks for them again and again."""
    return linearise(robot, np.zeros((0, robot.dof)), names=names)


def _whitened(
    rows: Float[np.ndarray, "sets m p"], beside: Float[np.ndarray, "sets m u"]
) -> Float[np.ndarray, "sets m p"]:
    """Rows of the covariance I + U Uᵀ, by its symmetric root."""
    covariance = np.eye(rows.shape[1]) + beside @ np.swapaxes(beside, 1, 2)
    values, vectors = np.linalg.eigh(covariance)
    return (vectors / np.sqrt(values)[:, None]) @ (np.swapaxes(vectors, 1, 2) @ rows)


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
    """Linearisation of measurements at a plate's targets, each of its own kind.

    Args:
        q: Joint positions at targets [rad or m].
        slots: Target of each row; all in order if None.
        names: Constants to identify; the robot's default free ones if None.
        sigma: Standard deviations of the instrument's positions [m] and rotations [rad].
        additive: As of `linearise_reading`.
    """
    slots = np.arange(len(plate)) if slots is None else slots
    found = linearise_reading(
        robot,
        q,
        reading_named("seat" if plate.anchors is None else "ball-bar", robot, plate, sigma=sigma),
        target_sigma=plate.target_sigma[slots],
        names=robot.default_free if names is None else names,
        additive=additive,
    )
    seats = np.array([plate.targets[slot].kind is Kind.SEAT for slot in slots], bool)
    if plate.anchors is not None or seats.all():
        return found
    constrained = np.repeat(np.column_stack([np.ones_like(seats), seats]), 3, axis=1).ravel()
    return replace(
        found,
        jacobian=frozen(found.jacobian[constrained]),
        sigma=frozen(found.sigma[constrained]),
        measurement=frozen(found.measurement[constrained]),
    )
