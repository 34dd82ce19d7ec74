"""Virtual arms, measured: at chosen poses or on a plate (the first two acquisitions of ARIA 4.1.2), or driven
live."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from workbench.arm.effects import AbstractEffect
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.base.threads import one_thread
from workbench.base.types import frozen
from workbench.base.wording import plural
from workbench.data.dataset import Dataset
from workbench.data.live.capture import CaptureTarget
from workbench.data.live.sample import Sample
from workbench.data.simulation.driver import DrivePace, drive
from workbench.data.simulation.hidden_effects import hidden_effects, varied_state
from workbench.data.simulation.instruments import INSTRUMENTS, Instrument, instrument_named
from workbench.data.simulation.simulate import (
    AUTO,
    LIKELY_ERRORS,
    MIXED,
    evenly_mixed,
    simulate,
    simulate_targets,
    virtual_arm,
    without,
)
from workbench.plate.argument_types import checked_arguments
from workbench.plate.collision import hits
from workbench.plate.plate import Plate
from workbench.plate.poses.circle_points import circle_poses
from workbench.plate.poses.informative_poses import informative_poses
from workbench.plate.poses.iso_cube import iso_cube_poses
from workbench.plate.poses.sampling import random_poses
from workbench.plate.region_poses import plate_region_poses
from workbench.plate.target_branches import choose_branches, measurable, plate_solutions

RANDOM = "random"
"""Name of the choice of poses that chooses nothing."""
CIRCLE_POINTS = "circle-points"
"""Name of the choice of poses that turns one joint after the other."""
ISO_CUBE = "iso-cube"
"""Name of the choice of poses by ISO 9283."""
DESIGNED = "designed"
"""Name of the choice of branches that spreads them for the smallest predicted error."""


@checked_arguments()
@one_thread()
def measure_poses(
    robot: Robot,
    number: int,
    *,
    index: str = RANDOM,
    instrument: str | Instrument = "tracker-6d",
    actual: Robot | None = None,
    effects: Sequence[str | AbstractEffect] = (),
    errors: tuple[float, float] = LIKELY_ERRORS,
    seed: int = 0,
) -> tuple[Robot, Dataset]:
    """A virtual arm measured at random or informative joint positions.

    Args:
        robot: Nominal arm.
        number: How many poses.
        index: `random`; `iso-cube` (ISO 9283, Katana §3.4); `circle-points` (one joint turned at a time);
            or the observability index to maximise (ARIA eqs. 17, 18): `O`, `O1` … `O5`.
        instrument: What measures.
        actual: The arm to measure; one with hidden manufacturing errors if None.
        effects: Also hidden in it, such as `joint-compliance:2`; see `data.simulation.hidden_effects`.
        errors: Maximum manufacturing errors of lengths [m] and angles [rad], where `actual` is None.
        seed: Of the hidden errors, the poses and the noise.

    Returns:
        The actual arm and the rows.
    """
    if number < 1:
        raise OptionError(f"number must be at least 1, got {number}")
    rng = np.random.default_rng(seed)
    actual, notes = _hidden(robot, actual, effects, rng, errors)
    if index == RANDOM:
        q = random_poses(robot, number, rng=rng)
    elif index == CIRCLE_POINTS:
        q = circle_poses(robot, number, rng=rng)
    elif index == ISO_CUBE:
        q = iso_cube_poses(robot, number, rng=rng).q
    else:
        q = informative_poses(robot, number, index=index, rng=rng).q
    state = varied_state(actual, q, rng=rng)
    rows = simulate(actual, state, instrument=_instrument(instrument), rng=rng)
    note = f"simulated: {plural(number, 'pose')} ({index}), {_instrument(instrument).name}, seed {seed}"
    return actual, replace(rows, source=note, notes=(*rows.notes, *notes))


@checked_arguments()
@one_thread()
def measure_plate(
    robot: Robot,
    plate: Plate,
    *,
    branch: str = DESIGNED,
    instrument: str | Instrument = "plate",
    actual: Robot | None = None,
    effects: Sequence[str | AbstractEffect] = (),
    errors: tuple[float, float] = LIKELY_ERRORS,
    seed: int = 0,
) -> tuple[Robot, Dataset]:
    """A virtual arm brought to the targets of a plate.

    Args:
        robot: Nominal arm.
        plate: The fixture, taken as true.
        branch: `designed`, the mix with the smallest predicted error; `mixed`, all alike; both where the arm
            keeps clear. `auto`, or a branch by name, whatever is in the way.
        instrument: What measures; `plate` is the seat itself.
        actual: The arm to measure; one with hidden manufacturing errors if None.
        effects: Also hidden in it, such as `joint-compliance:2`; see `data.simulation.hidden_effects`.
        errors: Maximum manufacturing errors of lengths [m] and angles [rad], where `actual` is None.
        seed: Of the hidden errors and the noise.

    Returns:
        The actual arm and the rows, one a target; those where the arm would run into plate or blocks are
        kept out, with the reason.

    Raises:
        DataError: a target out of reach, or the arm can stand at none.
    """
    rng = np.random.default_rng(seed)
    actual, notes = _hidden(robot, actual, effects, rng, errors)
    near = None
    if branch in (DESIGNED, MIXED):
        can = measurable(robot, plate)
        near = np.stack([solutions[0].q for solutions in plate_solutions(robot, plate)])
        if branch == DESIGNED:
            goal = plate_region_poses(robot, plate)
            near[can.rows] = choose_branches(robot, can.plate, can.solutions, goal=goal, rng=rng).q
        else:
            clear = [{b.name: b.q for b in target} for target in can.solutions]
            near[can.rows] = [q[n] for q, n in zip(clear, evenly_mixed(clear), strict=True)]
        branch = AUTO
    nowhere = np.zeros((len(plate), actual.dof))
    rows = simulate_targets(
        actual,
        plate.poses,
        instrument=_instrument(instrument),
        rng=rng,
        branch=branch,
        near=near,
        motion=varied_state(actual, nowhere, rng=rng) if actual.effects else None,
    )
    posed = (actual, rows.q) if near is None else (robot, near)  # what was planned clear counts as clear
    rows = without(rows, np.array(hits(posed[0], plate, range(len(plate)), posed[1])))
    note = f"simulated: plate '{plate.name}', {_instrument(instrument).name}, seed {seed}"
    return actual, replace(rows, source=note, notes=(*plate.notes, *rows.notes, *notes))


def _hidden(
    robot: Robot,
    actual: Robot | None,
    effects: Sequence[str | AbstractEffect],
    rng: np.random.Generator,
    errors: tuple[float, float],
) -> tuple[Robot, tuple[str, ...]]:
    """The arm to measure, with what is hidden in it, and a sentence on each effect."""
    if actual is None:
        actual = virtual_arm(robot, rng=rng, length=errors[0], angle=errors[1])
    hidden, notes = hidden_effects(actual, effects, rng=rng)
    return actual.with_effects(*actual.effects, *hidden) if hidden else actual, notes


def _instrument(instrument: str | Instrument) -> Instrument:
    return instrument_named(instrument) if isinstance(instrument, str) else instrument


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
