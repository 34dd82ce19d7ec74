"""Pairs of postures between which the load on one joint changes, for inclinometers.

The arm stands still in each posture, and every link carries an inclinometer. From one posture of a pair to
the other, one joint moves or a mass is hung onto the tool. On the tested joint

    crosswise   the moment across the axis reverses, which shows its clearance,
    reversal    the moment about the axis changes sign, which shows its backlash,
    size        the moment about the axis grows and keeps its sign, which shows its stiffness.

The mass is hung on for `size` where the arm's own weight would bend the joint by less than the instrument
resolves ten times over. Gravity turns no upright joint, nor one whose load lies on its axis; such a joint is
left out, and `side_loads` pulls sideways at the tool instead. Postures keep the joint limits, and the arm
clear of the table and of itself; the side from which any joint is loaded is beyond doubt.

Source: Katana figs. 4.6 and 5.4, which show six of such postures for joint 3.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm.gravity import level_axes
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.moments import JointMoments, joint_moments
from workbench.base.errors import DataError, OptionError
from workbench.base.types import frozen
from workbench.extras.katana.load_test.tolerance import constants_known, has_certain_load_sides
from workbench.plate.optimiser.meshes import arm_shape
from workbench.plate.poses.sampling import poses_satisfying

RESOLUTION, RESOLVED = float(np.deg2rad(0.001)), 10.0
"""What an inclinometer resolves [rad] (Katana §4.4.1), and how many times as much a joint must bend by."""
SOFT = 2e-5
"""Compliance that is expected of a joint [rad/(N m)]; 85 kg m/° are as much."""
FIRM = 0.1
"""Minimum moment that firmly presses a joint to one side of its play [N m]."""
ROUND = np.cos(np.deg2rad(150.0))
"""Cosine of the minimum angle by which a moment across an axis must turn."""
FORCE, LEVER = 40.0, 0.01
"""Maximum level pull at the tool [N], and the minimum lever by which it turns a joint [m]."""
POSTURES, MOVES, TRIES = 400, 4, 200
"""Number of random postures, of moves of each joint from each, and of pairs that are looked at for one joint
and purpose."""
PULLED = 10
"""Postures in which a joint is pulled."""
SIZES = (1.0, 0.8, 0.65, 0.5)
"""Shares of the maximum moment that is reached, for pairs of one joint and purpose in turn."""
CLEARANCE = 0.02
"""Minimum distance of the arm from itself and from the table [m]."""
SIDE_EFFECT_COST = 0.1
"""What a side effect on another joint, or a full turn of the joint that moves, costs a pair's rank."""


class PairPurpose(StrEnum):
    """What changes between the two postures."""

    CROSSWISE = "crosswise"
    REVERSAL = "reversal"
    SIZE = "size"


@dataclass(frozen=True, eq=False)
class PosturePair:
    """Two postures that load one joint differently.

    Args:
        joint: The joint, from 0.
        purpose: What changes.
        q: Joint positions [rad or m].
        added: Mass at the tool [kg].
    """

    joint: int
    purpose: PairPurpose
    q: Float[np.ndarray, "2 n"]
    added: Float[np.ndarray, "2"]


@dataclass(frozen=True, eq=False, kw_only=True)
class LoadTestPlan:
    """An experiment with inclinometers.

    Args:
        pairs: The pairs of postures, joint by joint.
        unturned: Joints that gravity does not turn, from 0; they show their clearance at most.
        missing: Joints and purposes for which no posture is reached.
    """

    pairs: tuple[PosturePair, ...]
    unturned: tuple[int, ...]
    missing: tuple[tuple[int, PairPurpose], ...] = ()

    @property
    def joints(self) -> tuple[int, ...]:
        return tuple(dict.fromkeys(pair.joint for pair in self.pairs))

    @property
    def q(self) -> Float[np.ndarray, "rows n"]:
        """All postures, pair by pair [rad or m]."""
        return np.concatenate([pair.q for pair in self.pairs])

    @property
    def added(self) -> Float[np.ndarray, " rows"]:
        """Mass at the tool in each [kg]."""
        return np.concatenate([pair.added for pair in self.pairs])


@dataclass(frozen=True, eq=False)
class _Moves:
    """Pairs of postures between which one joint moves, with their moments under one load.

    Args:
        q: Joint positions [rad or m].
        base: Number of each pair's first posture.
        mass: At the tool; where it is negative, so much is hung on for the second posture [kg].
        moments: In the first and in the second posture.
    """

    q: Float[np.ndarray, "2 pairs n"]
    base: Int[np.ndarray, " pairs"]
    mass: float
    moments: tuple[JointMoments, JointMoments]


def plan_load_test(
    robot: Robot, *, added_mass: float = 0.0, each: int = 4, rng: np.random.Generator
) -> LoadTestPlan:
    """Choose pairs of postures for all joints that gravity turns.

    Args:
        added_mass: Mass that can be hung onto the tool [kg].
        each: Pairs for every joint and purpose.
    """
    if added_mass < 0.0:
        raise OptionError(f"added mass must be at least 0 kg, got {added_mass:g}", option="added_mass")
    if each < 1:
        raise OptionError(f"--pairs must be at least 1, got {each}", option="--pairs")
    q, base = _moves(robot, rng)
    moves, heavy = (_loaded(robot, q, base, mass) for mass in (0.0, added_mass))
    unturned = tuple(np.flatnonzero(np.abs(heavy.moments[0].about).max(axis=0) < FIRM).tolist())
    turned = [j for j in range(robot.dof) if j not in unturned]
    found = {(j, p): _pairs(robot, moves, heavy, j, p, each) for j in turned for p in PairPurpose}
    if not any(found.values()):
        raise DataError(
            f"no posture that robot '{robot.name}' reaches surely loads a joint in both directions, or "
            "lightly and heavily; widen its limits, or add mass at the tool"
        )
    pairs = tuple(pair for picked in found.values() for pair in picked)
    return LoadTestPlan(
        pairs=pairs, unturned=unturned, missing=tuple(key for key, picked in found.items() if not picked)
    )


def possible(robot: Robot, q: Float[np.ndarray, "rows n"]) -> Bool[np.ndarray, " rows"]:
    """Postures in which the arm keeps clear of the table and of itself.

    The table lies at the height of the measuring frame's origin if the arm's base stands higher, else at that
    of the base.
    """
    shape, table = arm_shape(robot, CLEARANCE), min(0.0, -float(robot.base.xyz[2]))
    found = shape.clearances(shape.placements(q), floor=table, minimum=CLEARANCE)
    return found.min(axis=1) >= CLEARANCE


def _moves(
    robot: Robot, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "2 pairs n"], Int[np.ndarray, " pairs"]]:
    """Possible postures, each beside the possible ones that a move of one joint leads to; and its number."""

    def complaint(found: int, tries: int) -> str:
        return (
            f"robot '{robot.name}' is rarely above its table without touching itself ({found} of "
            f"{tries} random joint positions); check its limits and lengths"
        )

    start = poses_satisfying(robot, POSTURES, lambda q: possible(robot, q), rng=rng, complaint=complaint)
    base, joint = np.repeat(np.arange(POSTURES), robot.dof * MOVES), np.arange(robot.dof)
    moved = np.tile(np.repeat(joint, MOVES), POSTURES)
    other = start[base]
    low, high = robot.search_limits.T
    other[np.arange(len(base)), moved] = rng.uniform(low[moved], high[moved])
    keep = possible(robot, other)
    return np.stack([start[base[keep]], other[keep]]), base[keep]


def _loaded(robot: Robot, q: np.ndarray, base: np.ndarray, mass: float) -> _Moves:
    load = np.full(q.shape[1], mass)
    first, second = (joint_moments(robot, Motion(rows, payload=load)) for rows in q)
    return _Moves(q, base, mass, (first, second))


def _pairs(
    robot: Robot, moves: _Moves, heavy: _Moves, joint: int, purpose: PairPurpose, each: int
) -> list[PosturePair]:
    """The best pairs for one joint and purpose, of several sizes and from different postures, if any."""
    is_weak = _value(moves, joint, PairPurpose.SIZE).max() * SOFT < RESOLVED * RESOLUTION
    first = _hung(moves, heavy) if purpose is PairPurpose.SIZE and heavy.mass and is_weak else moves
    for chosen in (first, heavy):  # the mass settles the side of a load that errors of the arm leave in doubt
        strong = _value(chosen, joint, purpose).max() >= FIRM
        if strong and (picked := _picked(robot, chosen, heavy, joint, purpose, each)):
            return picked
    return []


def _picked(
    robot: Robot, chosen: _Moves, heavy: _Moves, joint: int, purpose: PairPurpose, each: int
) -> list[PosturePair]:
    """The best of some pairs for one joint and purpose, all of them surely loaded from one side."""
    value = _value(chosen, joint, purpose)
    rank = value / value.max() - SIDE_EFFECT_COST * _side_effects(chosen, joint)
    rank[value < FIRM] = -np.inf
    gaps_of = [np.abs(rank - rank.max() * size) for size in SIZES]
    near = np.unique([np.argsort(gaps, kind="stable")[: TRIES // len(SIZES)] for gaps in gaps_of])
    near, added = near[value[near] >= FIRM], [0.0, heavy.mass] if chosen.mass < 0.0 else [chosen.mass] * 2
    free = near[_certain(robot, chosen, near, added)]
    picked: list[PosturePair] = []
    while len(free) and len(picked) < each:
        best = int(free[np.argmin(gaps_of[len(picked) % len(SIZES)][free])])
        q = frozen(chosen.q[:, best].copy())
        picked.append(PosturePair(joint, purpose, q, frozen(np.array(added))))
        free = free[chosen.base[free] != chosen.base[best]]
    return picked


def _certain(
    robot: Robot, moves: _Moves, pairs: Int[np.ndarray, " k"], added: list[float]
) -> Bool[np.ndarray, " k"]:
    """Whether in both postures of a pair every joint is surely loaded from the side that the model says."""
    q = np.concatenate(moves.q[:, pairs])
    motion = Motion(q, payload=np.repeat(added, len(pairs)))
    about, across = has_certain_load_sides(robot, motion, constants_known(robot))
    loads = moves.moments[0]
    turned, tipped = ((np.abs(sizes) >= FIRM).any(axis=0) for sizes in (loads.about, loads.tipping))
    sides = np.hstack([about[:, turned], across[:, tipped]])
    return np.asarray(sides.all(axis=1).reshape(2, -1).all(axis=0))


def _hung(moves: _Moves, heavy: _Moves) -> _Moves:
    """Pairs of a posture with itself, without and with the mass."""
    _, first = np.unique(moves.base, return_index=True)
    q = np.stack([moves.q[0, first]] * 2)
    both = tuple(JointMoments(m.moments[0].about[first], m.moments[0].across[first]) for m in (moves, heavy))
    return _Moves(q, moves.base[first], -heavy.mass, (both[0], both[1]))


def _value(moves: _Moves, joint: int, purpose: PairPurpose) -> Float[np.ndarray, " pairs"]:
    """Size of the change that a purpose requires [N m]; 0 where it is not there."""
    a, b = (m.about[:, joint] for m in moves.moments)
    if purpose is PairPurpose.REVERSAL:
        return np.where(a * b < 0.0, np.minimum(np.abs(a), np.abs(b)), 0.0)
    if purpose is PairPurpose.SIZE:
        firm = (a * b > 0.0) & (np.minimum(np.abs(a), np.abs(b)) > FIRM)
        return np.where(firm, np.abs(b - a), 0.0)
    s, t = (m.across[:, joint] for m in moves.moments)
    sizes = np.stack([m.tipping[:, joint] for m in moves.moments])
    turned = (s * t).sum(axis=1) < ROUND * sizes.prod(axis=0)
    return np.where(turned, sizes.min(axis=0), 0.0)


def _side_effects(moves: _Moves, joint: int) -> Float[np.ndarray, " pairs"]:
    """Other joints that change flanks, and turns of the joint that moves."""
    a, b = (m.about for m in moves.moments)
    flipped = (a * b < 0.0) & (np.minimum(np.abs(a), np.abs(b)) > FIRM)
    flipped[:, joint] = False
    return flipped.sum(axis=1) + np.abs(moves.q[1] - moves.q[0]).sum(axis=1) / (2.0 * np.pi)


@dataclass(frozen=True, eq=False)
class SideLoads:
    """Sideways pulls at the tool that turn one joint both ways, for measured poses.

    Args:
        joint: The joint, from 0.
        q: Joint positions [rad or m].
        wrench: What pulls at the tool in each row, in the axes of the robot's gravity [N, N m].
    """

    joint: int
    q: Float[np.ndarray, "rows n"]
    wrench: Float[np.ndarray, "rows 6"]


def side_loads(robot: Robot, joint: int, *, rng: np.random.Generator) -> SideLoads:
    """Level pulls, full and half, to either side in several postures; those with the longest levers."""
    q = np.unique(_moves(robot, rng)[0][0], axis=0)
    lever = _levers(robot, joint, q)
    length = np.linalg.norm(lever, axis=1)
    best = np.argsort(-length)[:PULLED]
    pulls = np.array([1.0, -1.0, 0.5, -0.5]) * FORCE
    along = lever[best] / length[best, None]
    wrench = np.concatenate([pulls[None, :, None] * along[:, None], np.zeros((len(best), 4, 3))], axis=2)
    return SideLoads(joint, frozen(np.repeat(q[best], 4, axis=0)), frozen(wrench.reshape(-1, 6)))


def pullable(robot: Robot, joint: int, *, rng: np.random.Generator) -> bool:
    """Whether level pulls at the tool turn a joint; not one that the tool's point lies on."""
    low, high = robot.search_limits.T
    q = rng.uniform(low, high, (POSTURES, robot.dof))
    return bool(np.linalg.norm(_levers(robot, joint, q), axis=1).max() > LEVER)


def _levers(robot: Robot, joint: int, q: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "rows 3"]:
    """Moment about a joint's axis per newton of a level pull along each axis of the robot's gravity [m]."""
    up = level_axes(robot.gravity)[2]
    none = joint_moments(robot, Motion(q)).about[:, joint]
    pulls = (np.tile([*axis, 0.0, 0.0, 0.0], (len(q), 1)) for axis in np.eye(3))
    by_axis = [joint_moments(robot, Motion(q, wrench=pull)).about[:, joint] - none for pull in pulls]
    return np.stack(by_axis, axis=1) @ (np.eye(3) - np.outer(up, up))
