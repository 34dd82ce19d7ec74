"""A virtual arm behind a plate: the stand-in for a real driver, as one call."""

from collections.abc import Iterator

import numpy as np

from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.data.live.stream import Sample
from workbench.data.simulation.driver import Pace, drive
from workbench.data.simulation.instruments import INSTRUMENTS, Instrument, instrument_named
from workbench.data.simulation.simulate import simulate_targets, virtual_arm
from workbench.plate.measuring import DESIGNED, measure_plate
from workbench.plate.plate import Plate

SEAT = "plate"
"""The instrument that sees nothing by itself: the seat holds the tool where the plate says."""
STEERING = (3e-4, float(np.deg2rad(0.03)))
"""How near an operator steers to a wanted pose: standard deviations [m], [rad]."""


def drive_plate(
    robot: Robot,
    plate: Plate,
    *,
    branch: str = DESIGNED,
    instrument: str | Instrument = "tracker-6d",
    actual: Robot | None = None,
    pace: Pace | None = None,
    seed: int = 0,
) -> tuple[Robot, Iterator[Sample]]:
    """A virtual arm with hidden errors, steered to every target of a plate (ARIA 5.1).

    Args:
        robot: Nominal arm.
        plate: The fixture, in the robot's base.
        branch: `designed`, `auto`, `mixed`, or a branch by name, as for `measure_plate`.
        instrument: What sees the tool: an operator then steers until the wanted pose shows, more or less.
            `plate`: nothing does, and the seat holds the tool.
        actual: The arm that moves; one with hidden manufacturing errors if None.
        pace: How it moves and how often it is sampled.
        seed: Of the hidden errors, the steering and the noise.

    Returns:
        The actual arm, and its samples as they come.

    Raises:
        DataError: a target out of reach; says which and why.
        OptionError: a plate without targets, or an instrument that sees no pose and no point.
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
    """Poses beside the wanted ones, by the given standard deviations per axis."""
    turn = se3.rotvec_to_matrix(rng.normal(0.0, spread[1], (len(poses), 3)))
    return se3.pose(turn @ poses[:, :3, :3], poses[:, :3, 3] + rng.normal(0.0, spread[0], (len(poses), 3)))
