"""Virtual arms, measured: at chosen poses or on a plate (the first two acquisitions of ARIA 4.1.2)."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from workbench.arm.effects import AbstractEffect
from workbench.arm.robot import Robot
from workbench.base.arguments import Count, LengthAndAngle, Like, Seed, checked_arguments
from workbench.base.errors import OptionError
from workbench.base.threads import one_thread
from workbench.base.wording import plural
from workbench.data.arguments import RobotLike
from workbench.data.dataset import Dataset
from workbench.data.simulation.hidden_effects import hidden_effects, varied_state
from workbench.data.simulation.instruments import Instrument, instrument_named
from workbench.data.simulation.simulate import LIKELY_ERRORS, simulate, simulate_targets, virtual_arm
from workbench.plate.arguments import PlateLike
from workbench.plate.poses.iso_cube import iso_cube_poses
from workbench.plate.poses.sampling import random_poses
from workbench.plate.region_poses import plate_region_poses
from workbench.plate.target_branches import choose_branches, measurable, plate_solutions

RANDOM, ISO_CUBE = "random", "iso-cube"
"""Names of the choices of poses, by chance alone and by ISO 9283."""


@checked_arguments()
@one_thread()
def measure_poses(
    robot: RobotLike,
    number: Count,
    *,
    choice: str = RANDOM,
    instrument: str | Instrument = "tracker-6d",
    actual: RobotLike | None = None,
    effects: Sequence[str | AbstractEffect] = (),
    errors: Like[LengthAndAngle] = LIKELY_ERRORS,
    seed: Seed = 0,
) -> tuple[Robot, Dataset]:
    """A virtual arm measured at joint positions.

    Args:
        robot: Nominal arm.
        number: How many poses.
        choice: `random`, or `iso-cube` (ISO 9283, Katana §3.4).
        instrument: What measures.
        actual: The arm to measure; one with hidden manufacturing errors if None.
        effects: Also hidden in it, such as `joint-compliance:2`; see `data.simulation.hidden_effects`.
        errors: Maximum manufacturing errors of lengths [m] and angles [rad], where `actual` is None.
        seed: Of the hidden errors, the poses and the noise.

    Returns:
        The actual arm and the rows.
    """
    rng = np.random.default_rng(seed)
    actual, notes = _hidden(robot, actual, effects, rng, errors)
    if choice not in (RANDOM, ISO_CUBE):
        raise OptionError(f"no choice of poses '{choice}'; choose {RANDOM} or {ISO_CUBE}")
    is_cube = choice == ISO_CUBE
    seen = instrument_named(instrument) if isinstance(instrument, str) else instrument
    q = iso_cube_poses(robot, number, rng=rng).q if is_cube else random_poses(robot, number, rng=rng)
    rows = simulate(actual, varied_state(actual, q, rng=rng), instrument=seen, rng=rng)
    note = f"simulated: {plural(number, 'pose')} ({choice}), {seen.name}, seed {seed}"
    return actual, replace(rows, source=note, notes=(*rows.notes, *notes))


@checked_arguments()
@one_thread()
def measure_plate(
    robot: RobotLike,
    plate: PlateLike,
    *,
    instrument: str | Instrument = "plate",
    actual: RobotLike | None = None,
    effects: Sequence[str | AbstractEffect] = (),
    errors: Like[LengthAndAngle] = LIKELY_ERRORS,
    seed: Seed = 0,
) -> tuple[Robot, Dataset]:
    """A virtual arm brought to the targets of a plate, in branches that they mean, mixed for the smallest
    predicted error.

    Args:
        robot: Nominal arm.
        plate: The fixture, taken as true.
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
    can, goal = measurable(robot, plate), plate_region_poses(robot, plate)
    near = np.stack([solutions[0].q for solutions in plate_solutions(robot, plate)])
    near[can.rows] = choose_branches(robot, can.plate, can.solutions, goal=goal, rng=rng).q
    seen = instrument_named(instrument) if isinstance(instrument, str) else instrument
    nowhere = np.zeros((len(plate), actual.dof))
    motion = varied_state(actual, nowhere, rng=rng) if actual.effects else None
    rows = simulate_targets(actual, plate.poses, instrument=seen, rng=rng, near=near, motion=motion)
    rows = without(rows, np.array(can.hits))
    note = f"simulated: plate '{plate.name}', {seen.name}, seed {seed}"
    return actual, replace(rows, source=note, notes=(*plate.notes, *rows.notes, *notes))


def without(rows: Dataset, reasons: np.ndarray) -> Dataset:
    """The same rows, with nothing measured in those that have a reason, which are kept out."""
    gone = reasons != ""
    if not gone.any():
        return rows
    named = ((name, getattr(rows, name)) for name in ("position", "rotation", "markers", "distance"))
    blank: dict[str, Any] = {name: values.copy() for name, values in named if values is not None}
    for values in blank.values():
        values[gone] = np.nan
    note = f"{int(gone.sum())} of {len(rows)} poses can't be measured; of the first one: {reasons[gone][0]}"
    kept_out = rows.kept_out({row: str(reasons[row]) for row in np.flatnonzero(gone).tolist()})
    return replace(kept_out, notes=(*rows.notes, note), **blank)


def _hidden(
    robot: Robot,
    actual: Robot | None,
    effects: Sequence[str | AbstractEffect],
    rng: np.random.Generator,
    errors: tuple[float, float],
) -> tuple[Robot, tuple[str, ...]]:
    """The arm to measure, with what is hidden in it, and a sentence on each effect."""
    if actual is None:
        actual = virtual_arm(robot, rng=rng, errors=errors)
    hidden, notes = hidden_effects(actual, effects, rng=rng)
    return actual.with_effects(*actual.effects, *hidden) if hidden else actual, notes
