"""A virtual arm that is driven to the targets of a plate, in place of a real one (ARIA 5.1)."""

from collections.abc import Iterator

import numpy as np

from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.base.types import frozen
from workbench.data.simulation.instruments import INSTRUMENTS, Instrument, instrument_named
from workbench.data.simulation.simulate import simulate_targets, virtual_arm
from workbench.extras.live.capture import CaptureTarget
from workbench.extras.live.driver import DrivePace, drive
from workbench.extras.live.sample import Sample
from workbench.plate.plate import Plate
from workbench.plate.simulated_measurement import DESIGNED, measure_plate

SEAT = "plate"
"""No instrument: the seat constrains the tool where the plate says."""
STEERING = (3e-4, float(np.deg2rad(0.03)))
"""How near an operator steers to a target's pose: standard deviations [m], [rad]."""


def plate_targets(robot: Robot, plate: Plate) -> tuple[CaptureTarget, ...]:
    """The targets of a plate as poses in the measuring frame."""
    if not len(plate):
        raise OptionError(f"plate '{plate.name}' has no targets to measure; add [[target]] tables")
    return tuple(
        CaptureTarget(name=f"target {number}", pose=frozen(robot.base.pose @ target.pose), q=target.q)
        for number, target in enumerate(plate.targets, start=1)
    )


def drive_plate(
    robot: Robot,
    plate: Plate,
    *,
    branch: str = DESIGNED,
    instrument: str | Instrument = "tracker-6d",
    actual: Robot | None = None,
    pace: DrivePace | None = None,
    seed: int = 0,
) -> tuple[Robot, Iterator[Sample]]:
    """A virtual arm with hidden errors, steered to every target of a plate (ARIA 5.1).

    Args:
        robot: Nominal arm.
        plate: The fixture, in the robot's base.
        branch: `designed`, `auto`, `mixed`, or a branch by name, as for `measure_plate`.
        instrument: What sees the tool: an operator then steers until the target's pose shows, more or less.
            `plate`: nothing does, and the seat constrains the tool.
        actual: The arm that moves; one with hidden manufacturing errors if None.
        pace: How it moves and how often it is sampled.
        seed: Of the hidden errors, the steering and the noise.

    Returns:
        The actual arm, and its samples as they come.
    """
    if not len(plate):
        raise OptionError(f"plate '{plate.name}' has no targets to drive to; add [[target]] tables")
    instrument = instrument_named(instrument) if isinstance(instrument, str) else instrument
    rng = np.random.default_rng(seed)
    actual = virtual_arm(robot, rng=rng) if actual is None else actual
    seated = instrument.name == SEAT
    spread = (instrument.sigma_position, instrument.sigma_rotation or 0.0) if seated else STEERING
    exact = INSTRUMENTS["ideal"]
    _, rows = measure_plate(robot, plate, branch=branch, instrument=exact, actual=actual, seed=seed)
    q = simulate_targets(actual, beside(plate.poses, spread, rng), instrument=exact, rng=rng, near=rows.q).q
    return actual, drive(actual, q, rng=rng, instrument=None if seated else instrument, pace=pace)


def beside(poses: np.ndarray, spread: tuple[float, float], rng: np.random.Generator) -> np.ndarray:
    """Poses beside the given ones, by the given standard deviations per axis."""
    turn = se3.rotvec_to_matrix(rng.normal(0.0, spread[1], (len(poses), 3)))
    return se3.pose(turn @ poses[:, :3, :3], poses[:, :3, 3] + rng.normal(0.0, spread[0], (len(poses), 3)))
