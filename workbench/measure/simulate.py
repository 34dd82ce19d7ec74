"""Virtual arms and virtual measurements: the paper's first two ways of acquisition without an arm.

A virtual arm is the nominal one with hidden manufacturing errors. It is measured either at given joint
positions (ARIA §4.1.2, first way), or at the targets of a fixture (second way): there the pose is imposed,
and the joint angles are what the actual arm takes to be there, from its own inverse kinematics.

    measured pose = actual pose ⊕ noise,   p + N(0, σp²) per axis,   exp(N(0, σr²) per axis) R, base axes
"""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from workbench import se3
from workbench.errors import DataError, OptionError
from workbench.measure.dataset import Dataset
from workbench.measure.instruments import Instrument, Observes
from workbench.model import inverse
from workbench.model.forward import tool_poses
from workbench.motion import Motion
from workbench.robots.robot import Robot
from workbench.types import Vector3

AUTO, MIXED = "auto", "mixed"
LENGTH_ERROR = 5e-3
"""Greatest manufacturing error of a length [m]."""
ANGLE_ERROR = float(np.deg2rad(5.0))
"""Greatest manufacturing error of an angle [rad]."""
ANCHOR_CIRCLE = 0.6
"""Radius of the circle of three anchors about the base where none are given, as a share of the reach."""


def virtual_arm(
    robot: Robot,
    *,
    rng: np.random.Generator,
    length: float = LENGTH_ERROR,
    angle: float = ANGLE_ERROR,
    names: tuple[str, ...] | None = None,
) -> Robot:
    """An actual arm: the nominal one with even manufacturing errors of its constants.

    Args:
        robot: The nominal arm.
        rng: Source of the errors.
        length: Greatest error of a length [m].
        angle: Greatest error of an angle [rad].
        names: Constants with errors; the robot's default free ones if None.

    Returns:
        The arm; `values(names)` tells what is hidden in it.
    """
    names = robot.default_free if names is None else names
    elements = robot.chain.elements
    bounds = np.array(
        [angle if elements[i].axis.turns else length for i in robot.chain.indices(names)], float
    )
    actual = robot.values(names) + rng.uniform(-1.0, 1.0, len(names)) * bounds
    return robot.with_values(dict(zip(names, actual.tolist(), strict=True)))


def simulate(
    actual: Robot,
    q: Float[np.ndarray, "rows n"],
    *,
    instrument: Instrument,
    rng: np.random.Generator,
    joint_noise: float = 0.0,
    anchors: Mapping[str, Vector3] | None = None,
    motion: Motion | None = None,
) -> Dataset:
    """Measure an arm at given joint positions.

    Args:
        actual: The arm that is measured.
        q: Joint positions [rad or m].
        instrument: What measures it.
        rng: Source of the noise.
        joint_noise: Standard deviation of the joint readings [rad or m]; 0 for exact ones.
        anchors: Places that distances are measured from [m]; three about the base if None.
        motion: What drives the arm's effects beside q, one row a joint position; written into the rows.

    Returns:
        One row a joint position; its `q` are the readings.

    Raises:
        OptionError: the instrument touches fixed points, which joint positions don't name.
    """
    if instrument.observes is Observes.CONTACT:
        raise OptionError(
            f"instrument '{instrument.name}' touches fixed points; simulate it at targets, several "
            "orientations at each point"
        )
    anchors = _three_anchors(actual) if anchors is None else anchors
    state = None if motion is None else motion.at(q)
    seen = _observe(instrument, tool_poses(actual, q, motion=state), rng, anchors)
    return _dataset(actual, q, instrument, rng, joint_noise, seen, motion=motion)


def simulate_targets(
    actual: Robot,
    targets: Float[np.ndarray, "targets 4 4"],
    *,
    instrument: Instrument,
    rng: np.random.Generator,
    branch: str | Sequence[str] = AUTO,
    near: Float[np.ndarray, "targets n"] | None = None,
    joint_noise: float = 0.0,
    anchors: Mapping[str, Vector3] | None = None,
    motion: Motion | None = None,
) -> Dataset:
    """Bring an arm to the targets of a fixture and measure it there.

    Args:
        actual: The arm that is measured; its own inverse kinematics gives the joint positions.
        targets: Poses of the tool in the robot's base, such as `plate.poses`.
        instrument: What measures it: `plate` is the seat itself. One that touches fixed points holds the
            tool's position with its noise and sees nothing else; equal places are one point.
        rng: Source of the noise.
        branch: `auto` (the branch that reaches all targets with the greatest margin to the limits; each
            target's own best where none does), `mixed` (every branch as often as the others), the name of
            a branch, or one of these names per target.
        near: Joint positions of the nominal arm at the targets, such as a plate's chosen ones: the actual
            arm takes the solution next to them, whatever `branch` says; where its limits forbid that one,
            the nearest other, and a note says so.
        joint_noise: Standard deviation of the joint readings [rad or m]; 0 for exact ones.
        anchors: Places that distances are measured from [m]; three about the base if None.
        motion: What drives the arm's effects beside q, one row a target; written into the rows.

    Returns:
        One row a target.

    Raises:
        DataError: a target out of reach, or a branch that it does not have; says which and why.
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
    anchors = _three_anchors(actual) if anchors is None else anchors
    if instrument.observes is Observes.CONTACT:
        seen = {"contact": _points(targets[:, :3, 3])}
    else:
        seen = _observe(instrument, imposed, rng, anchors)
    return _dataset(actual, q, instrument, rng, joint_noise, seen, notes, motion)


def _dataset(actual, q, instrument, rng, joint_noise, seen, notes=(), motion=None) -> Dataset:
    readings = q + rng.normal(0.0, joint_noise, q.shape) if joint_noise > 0 else q.copy()
    sigma = None
    if instrument.sigma_position > 0:
        turn = np.nan if instrument.sigma_rotation is None else instrument.sigma_rotation
        sigma = np.tile([instrument.sigma_position] * 3 + [turn] * 3, (len(q), 1))
    return Dataset(
        q=readings,
        row=np.arange(len(q)),
        sigma=sigma,
        source=f"virtual {actual.name}",
        notes=(f"simulated with instrument '{instrument.name}'", *notes),
        **seen,
        **({} if motion is None else motion.drivers),
    )


def _observe(
    instrument: Instrument, poses: np.ndarray, rng: np.random.Generator, anchors: Mapping[str, Vector3]
) -> dict[str, np.ndarray]:
    """The columns that the instrument fills when the tool is at the poses."""
    rows, sigma = len(poses), instrument.sigma_position
    if instrument.observes is Observes.MARKERS:
        places = np.einsum("rij,mj->rmi", poses[:, :3, :3], instrument.markers) + poses[:, None, :3, 3]
        return {"markers": places + rng.normal(0.0, sigma, places.shape)}
    if instrument.observes is Observes.DISTANCE:
        names = np.array(list(anchors))[np.arange(rows) % len(anchors)]
        places = np.stack([anchors[name] for name in names])
        distances = np.linalg.norm(poses[:, :3, 3] - places, axis=1)
        return {"distance": distances + rng.normal(0.0, sigma, rows), "anchor": names}
    columns = {"position": poses[:, :3, 3] + rng.normal(0.0, sigma, (rows, 3))}
    if instrument.observes is Observes.POSE:
        turns = se3.rotvec_to_matrix(rng.normal(0.0, instrument.sigma_rotation or 0.0, (rows, 3)))
        columns["rotation"] = turns @ poses[:, :3, :3]
    return columns


def _three_anchors(robot: Robot) -> dict[str, Vector3]:
    angles = 2.0 * np.pi * np.arange(3) / 3.0
    circle = ANCHOR_CIRCLE * robot.reach * np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], -1)
    return dict(zip("ABC", circle @ robot.base.rotation.T + robot.base.xyz, strict=True))


def _points(places: Float[np.ndarray, "rows 3"]) -> np.ndarray:
    """`point 1`, `point 2` … of rows that share a place to a micrometre."""
    _, number = np.unique(np.round(places, 6), axis=0, return_inverse=True)
    order = {n: i + 1 for i, n in enumerate(dict.fromkeys(number.tolist()))}
    return np.array([f"point {order[n]}" for n in number.tolist()])


def _follow(
    actual: Robot, poses: np.ndarray, near: np.ndarray, motion: Motion | None
) -> tuple[np.ndarray, tuple[str, ...]]:
    """The solutions next to given joint positions, and a note on each that the limits turned elsewhere."""
    followed = inverse.follow_many(actual, poses, near, motion=motion)
    q, notes = followed.q.copy(), []
    for row in np.flatnonzero(~followed.converged):
        state = None if motion is None else motion.take(np.array([row]))
        result = inverse.solve(actual, poses[row], motion=state)
        other = inverse.choose(result, near=near[row])
        if other is None:
            raise DataError(f"target {row + 1} is not reachable within limits: {result.reason}")
        q[row] = other.q
        notes.append(
            f"target {row + 1}: the wanted branch is outside this arm's limits; measured in '{other.name}'"
        )
    return q, tuple(notes)


def _in_branches(
    actual: Robot, poses: np.ndarray, branch: str | Sequence[str], motion: Motion | None
) -> np.ndarray:
    solutions = []
    for number, result in enumerate(inverse.solve_many(actual, poses, motion=motion), start=1):
        if not result.reachable:
            raise DataError(f"target {number} is not reachable within limits: {result.reason}")
        solutions.append({b.name: b for b in result.within_limits})
    wanted = [branch] * len(solutions) if isinstance(branch, str) else list(branch)
    if len(wanted) != len(solutions):
        raise OptionError(f"{len(wanted)} branches were named for {len(solutions)} targets; name each")
    if MIXED in wanted:
        spread = _mixed(solutions)
        wanted = [s if w == MIXED else w for s, w in zip(spread, wanted, strict=True)]
    common = _roomiest(solutions)
    return np.stack(
        [
            _named(target, common if name == AUTO else name, i)
            for i, (target, name) in enumerate(zip(solutions, wanted, strict=True), start=1)
        ]
    )


def _named(target: dict, name: str | None, number: int) -> np.ndarray:
    if name is None:
        return max(target.values(), key=lambda b: b.margin).q
    if name not in target:
        raise DataError(f"target {number} has no branch '{name}' within limits; it has {', '.join(target)}")
    return target[name].q


def _roomiest(solutions: list[dict]) -> str | None:
    """The branch that all targets share and whose least margin to the limits is greatest."""
    shared = [name for name in solutions[0] if all(name in target for target in solutions)]
    return max(shared, key=lambda name: min(t[name].margin for t in solutions), default=None)


def _mixed(solutions: list[dict]) -> list[str]:
    """A branch per target so that all are used alike: always the least used, in alphabetical order."""
    used = dict.fromkeys(sorted({name for target in solutions for name in target}), 0)
    chosen = []
    for target in solutions:
        name = min(target, key=lambda n: (used[n], n))
        used[name] += 1
        chosen.append(name)
    return chosen
