"""What is read at a plate's targets, as whitened rows of an identification Jacobian.

| kind   | what a target is                  | what is read                      |
|--------|-----------------------------------|-----------------------------------|
| seat   | a face with pin and index hole    | the full pose                     |
| socket | a cone for a ball                 | the position of the ball's centre |
| point  | a centre for a pointed probe      | the position of the tip           |

The target itself is uncertain by σ_t, from manufacture or measurement; each component is read with

    y = J δp + e_target + noise,      variance σ² + σ_t².
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.kinematics.forward import identification_jacobian
from workbench.arm.linearisation import SIGMA, Linearisation, linearise
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.base.types import frozen
from workbench.plate.plate import Kind, Plate

SEAT = SIGMA
"""Default standard deviations of a seat's reading: position [m], rotation about an axis [rad]."""
POSITIONS = {Kind.SEAT: SEAT[0], Kind.SOCKET: 5e-5, Kind.POINT: 1e-4}
"""Default standard deviation of a position that is read [m]."""


def usual_kind(plate: Plate) -> Kind:
    """The kind of all targets; a seat if they differ."""
    kinds = {target.kind for target in plate.targets}
    return kinds.pop() if len(kinds) == 1 else Kind.SEAT


def sigma_of(kind: Kind, given: tuple[float, float | None] | None = None) -> tuple[float, float]:
    """Standard deviations of a reading [m], [rad]: as far as given, else those usual for a kind of target."""
    position, rotation = given or (POSITIONS[kind], None)
    sigma = position, SEAT[1] if rotation is None else rotation
    if not min(sigma) > 1e-30:  # whose square is 0 to a computer
        wrong = "the instrument's standard deviations must be positive"
        raise OptionError(wrong, option="sigma", found=sigma)
    return sigma


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
) -> Linearisation:
    """Linearisation of measurements at a plate's targets, each of its own kind.

    Args:
        q: Joint positions at targets [rad or m].
        slots: Target of each row; all in order if None.
        names: Constants to identify; the robot's default free ones if None.
        sigma: Standard deviations of the instrument's positions [m] and rotations [rad].
    """
    slots = np.arange(len(plate)) if slots is None else slots
    names = robot.default_free if names is None else names
    twists = identification_jacobian(robot, Motion(q), names)[1]
    deviations = np.repeat(np.hypot(sigma, np.hypot(plate.known, plate.play)[slots]), 3, axis=1)
    is_read = np.ones((len(q), 6), bool)
    is_read[:, 3:] = np.array([[plate.targets[slot].kind is Kind.SEAT] for slot in slots]).reshape(-1, 1)
    return replace(
        _no_rows(robot, names),
        jacobian=frozen((twists / deviations[:, :, None])[is_read]),
        sigma=frozen(deviations[is_read]),
        measurement=frozen(np.repeat(np.arange(len(q)), is_read.sum(1))),
    )


@lru_cache(maxsize=4)
def _no_rows(robot: Robot, names: tuple[str, ...]) -> Linearisation:
    """Names, units and length of an arm's constants; kept, since a drag asks for them again and again."""
    return linearise(robot, np.zeros((0, robot.dof)), names=names)
