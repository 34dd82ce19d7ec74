"""Virtual arms and virtual measurements: the paper's first two ways of acquisition without an arm.

A virtual arm is the nominal one with hidden manufacturing errors. It is measured either at given joint
positions (ARIA §4.1.2, first way), or at the targets of a fixture (second way): there the pose is imposed,
and the joint angles are what the actual arm takes to be there, from its own inverse kinematics.

    measured pose = actual pose ⊕ noise,   p + N(0, σp²) per axis,   exp(N(0, σr²) per axis) R, base axes
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse import solve as inverse
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.base.types import Vector3
from workbench.data.dataset import Dataset
from workbench.data.simulation.instruments import Instrument, Observes
from workbench.data.simulation.readings import VirtualInstrument, three_anchors

AUTO = "auto"
MAX_LENGTH_ERROR = 1e-3
"""Maximum manufacturing error of a length, as of a good industrial arm [m]."""
ANGLE_ERROR = float(np.deg2rad(0.3))
"""The same of an angle [rad]."""
LIKELY_ERRORS = MAX_LENGTH_ERROR, ANGLE_ERROR


def virtual_arm(
    robot: Robot, *, rng: np.random.Generator, length: float = MAX_LENGTH_ERROR, angle: float = ANGLE_ERROR
) -> Robot:
    """An actual arm: the nominal one with even manufacturing errors of its default free constants.

    Args:
        length: Maximum error of a length [m].
        angle: Maximum error of an angle [rad].
    """
    names = robot.default_free
    turns = [robot.chain.elements[i].axis.turns for i in robot.chain.indices(names)]
    actual = robot.values(names) + rng.uniform(-1.0, 1.0, len(names)) * np.where(turns, angle, length)
    return robot.with_values(dict(zip(names, actual.tolist(), strict=True)))


def simulate(
    actual: Robot,
    motion: Motion,
    *,
    instrument: Instrument,
    rng: np.random.Generator,
    joint_noise: float = 0.0,
    anchors: Mapping[str, Vector3] | None = None,
) -> Dataset:
    """Measure an arm at given joint positions.

    Args:
        motion: Joint positions, and what drives the arm's effects, which is written into the rows.
        joint_noise: Standard deviation of the joint readings [rad or m]; 0 for exact ones.
        anchors: Places that distances are measured from [m]; three about the base if None.

    Returns:
        One row a joint position; its `q` are the readings.
    """
    if instrument.observes is Observes.CONTACT:
        where = "targets, several orientations at each point"
        text = f"instrument '{instrument.name}' touches fixed points; simulate it at {where}"
        raise OptionError(text, option="instrument", found=instrument.name)
    seen = VirtualInstrument(instrument, actual, rng, three_anchors(actual) if anchors is None else anchors)
    rows = _rows(seen, motion, seen.read(motion, tool_poses(actual, motion)))
    if joint_noise > 0.0:
        rows = replace(rows, q=rows.q + rng.normal(0.0, joint_noise, rows.q.shape))
    return rows


def simulate_targets(
    actual: Robot,
    targets: Float[np.ndarray, "targets 4 4"],
    *,
    instrument: Instrument,
    rng: np.random.Generator,
    branch: str = AUTO,
    near: Float[np.ndarray, "targets n"] | None = None,
    motion: Motion | None = None,
) -> Dataset:
    """Bring an arm to the targets of a fixture and measure it there.

    Args:
        actual: The arm that is measured; its own inverse kinematics gives the joint positions.
        targets: Poses of the tool in the robot's base, such as `plate.poses`.
        instrument: What measures it: `plate` is the seat itself. One that touches fixed points holds the
            tool's position with its noise and sees nothing else; equal places are one point.
        rng: Source of the noise.
        branch: `auto` (the branch that reaches all targets with the largest margin to the limits; each
            target's own best where none does), or the name of a branch.
        near: Joint positions of the nominal arm at the targets, such as a plate's chosen ones: the actual
            arm takes the solution next to them, whatever `branch` says; where its limits forbid that one,
            the nearest other, and a note says so.
        motion: What drives the arm's effects beside q, one row a target; written into the rows.

    Returns:
        One row a target.
    """
    imposed = actual.base.pose @ targets
    if instrument.observes is Observes.CONTACT:
        noise = rng.normal(0.0, instrument.sigma_position, (len(targets), 3))
        imposed = se3.pose(imposed[:, :3, :3], imposed[:, :3, 3] + noise)
    notes: tuple[str, ...] = ()
    if near is None:
        q = _in_branches(actual, imposed, branch, motion)
    else:
        actual.check_joints(near, "near")
        q, notes = _follow(actual, imposed, near, motion)
    state = Motion(q) if motion is None else motion.at(q)
    seen = VirtualInstrument(instrument, actual, rng, three_anchors(actual))
    if instrument.observes is Observes.CONTACT:
        columns: dict[str, Any] = {"contact": _points(targets[:, :3, 3])}
    else:
        columns = seen.read(state, imposed)
    return _rows(seen, state, columns, notes)


def _rows(seen: VirtualInstrument, motion: Motion, columns, notes=()) -> Dataset:
    """The rows; of the state what a table of measurements holds, as poses are taken at rest."""
    position, rotation = seen.instrument.deviations
    sigma = np.tile([position] * 3 + [np.nan if rotation is None else rotation] * 3, (len(motion), 1))
    known = Dataset.__dataclass_fields__.keys() - {"row"}
    state: dict[str, Any] = {name: values for name, values in motion.drivers.items() if name in known}
    return Dataset(
        q=motion.q,
        row=np.arange(len(motion)),
        sigma=sigma if position > 0 else None,
        source=f"virtual {seen.arm.name}",
        notes=(f"simulated with instrument '{seen.instrument.name}'", *notes),
        more=motion.more,
        **columns,
        **state,
    )


def without(rows: Dataset, reasons: np.ndarray) -> Dataset:
    """The same rows, with nothing measured in those that have a reason, which are kept out."""
    gone = reasons != ""
    if not gone.any():
        return rows
    if gone.all():
        raise DataError(f"{rows.source}: no pose can be measured; of the first one: {reasons[0]}")
    named = ((name, getattr(rows, name)) for name in ("position", "rotation", "markers", "distance"))
    blank: dict[str, Any] = {name: values.copy() for name, values in named if values is not None}
    for values in blank.values():
        values[gone] = np.nan
    note = f"{int(gone.sum())} of {len(rows)} poses can't be measured; of the first one: {reasons[gone][0]}"
    kept_out = rows.kept_out({row: str(reasons[row]) for row in np.flatnonzero(gone).tolist()})
    return replace(kept_out, notes=(*rows.notes, note), **blank)


def _points(places: Float[np.ndarray, "rows 3"]) -> np.ndarray:
    """`point 1`, `point 2` … of rows that share a place to a micrometre."""
    number = dict[tuple[float, ...], int]()
    rounded = map(tuple, np.round(places, 6).tolist())
    return np.array([f"point {number.setdefault(place, len(number) + 1)}" for place in rounded])


def _follow(
    actual: Robot, poses: np.ndarray, near: np.ndarray, motion: Motion | None
) -> tuple[np.ndarray, tuple[str, ...]]:
    """The solutions next to given joint positions, and a note on each that the limits turned elsewhere."""
    followed = inverse.follow_many(actual, poses, near, motion=motion)
    q, notes = followed.q.copy(), []
    for row in np.flatnonzero(~followed.converged).tolist():
        state = None if motion is None else motion.take(np.array([row]))
        result = inverse.solve(actual, poses[row], motion=state)
        other = inverse.choose(result, near=near[row])
        if other is None:
            raise DataError(f"target {row + 1} is not reachable within limits: {result.reason}", target=row)
        q[row] = other.q
        outside = "the chosen branch is outside this arm's limits"
        notes.append(f"target {row + 1}: {outside}; measured in '{other.name}'")
    return q, tuple(notes)


def _in_branches(actual: Robot, poses: np.ndarray, branch: str, motion: Motion | None) -> np.ndarray:
    solutions = []
    for number, result in enumerate(inverse.solve_many(actual, poses, motion=motion), start=1):
        if not result.reachable:
            text = f"target {number} is not reachable within limits: {result.reason}"
            raise DataError(text, target=number - 1)
        solutions.append({b.name: b for b in result.within_limits})
    shared = [name for name in solutions[0] if all(name in target for target in solutions)]
    common = max(shared, key=lambda name: min(t[name].margin for t in solutions), default=None)
    name, q = common if branch == AUTO else branch, []
    for k, target in enumerate(solutions):
        if name is not None and name not in target:
            text = f"target {k + 1} has no branch '{name}' within limits; it has {', '.join(target)}"
            raise DataError(text, target=k, found=name)
        q.append((max(target.values(), key=lambda b: b.margin) if name is None else target[name]).q)
    return np.stack(q)
