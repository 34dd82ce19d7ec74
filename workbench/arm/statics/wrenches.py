"""Wrenches transmitted through the joints, by Newton–Euler over all rows at once.

With the centres of mass c_k and their accelerations a_k in the arm's base axes, the earlier link must exert

    f_j = Σ_k m_k (a_k − g),      τ_j = Σ_k (c_k − p_j) × m_k (a_k − g),      k over all masses after joint j

on the later one at p_j, the origin of the joint's mount: the frame right before the driven element, and
before the rotations of bearing clearance. Both are given in the mount's axes, which are fixed to the earlier
link: the driven axis is the joint's, the other two carry the tilting moments. The component about (along) the
joint's axis is the holding torque (force) of the drive. It is the reaction to the load: minus the moment of
Katana eq. (4.21), which the weight exerts.

Pinocchio's `rnea`, with which the tests compare it, has a fixed tree of joints with rigid links. Here every
element of the chain, joint or constant, may be deflected by effects, differently in every row and in every
step of a fit; and the wrenches are needed at the mount before the tilts of bearing clearance, for which
pinocchio would need additional joints.

Links are point masses at their centres of mass; a payload is one in the tool frame. An external wrench at the
tool adds its negative to every joint's.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from workbench.arm import chain as chains
from workbench.arm.chain import NO_SHIFT, Chain
from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.axes import Insertion, own_components
from workbench.arm.gravity import level_axes
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import RobotError
from workbench.base.types import Vector3, frozen


@dataclass(frozen=True, eq=False)
class Masses:
    """Point masses of a robot, in the order in which the chain reaches them.

    Args:
        after: Element of the full chain after which each link frame lies, non-decreasing.
        mass: Mass of each link [kg].
        com: Centre of mass in its link frame [m].
        gravity: Gravity [m/s²], in the frame after the base.
    """

    after: Int[np.ndarray, " links"]
    mass: Float[np.ndarray, " links"]
    com: Float[np.ndarray, "links 3"]
    gravity: Vector3

    def with_values(self, values: Float[np.ndarray, " links4"]) -> "Masses":
        """The same links with other masses and centres, in the order of `Robot.inertia`."""
        table = np.array(values, float).reshape(-1, 4)
        return replace(self, mass=table[:, 0], com=table[:, 1:])


@lru_cache(maxsize=16)
def masses(robot: Robot) -> Masses:
    """The robot's links as point masses; fixed joints without a mass carry none."""
    for joint in robot.moving:
        if joint.mass is None:
            raise RobotError(
                f"{joint.name} of robot '{robot.name}' has no mass, required for joint moments; add "
                "'mass' [kg] and 'com' [m, link frame] to its [[joint]], or <inertial> to its URDF link",
                found=joint.name,
            )
    ends = [a for a, joint in zip(robot.chain_ends, robot.joints, strict=True) if joint.mass]
    table = np.array([*robot.inertia.values()], float).reshape(-1, 4)
    return Masses(np.array(ends, np.int64), table[:, 0], table[:, 1:], np.array(robot.gravity, float))


@lru_cache(maxsize=16)
def mounts(robot: Robot) -> Int[np.ndarray, " n"]:
    """Element of the full chain right before which each joint's mount lies: its first tilt, or its drive."""
    chain = robot.chain
    out = chain.driven.copy()
    for joint in range(robot.dof):
        tilts = [chain.index.get(Insertion.TILT.element(joint, axis)) for axis in range(3)]
        out[joint] = min([out[joint], *(place for place in tilts if place is not None)])
    return frozen(out)


@dataclass(frozen=True, eq=False)
class TrialArm:
    """A robot with other values than its own, as a fit tries them.

    Args:
        robot: Geometry; n joints.
        chain: Its full chain with the constants in force; K elements.
        effects: Its effects with the coefficients in force.
        weights: Masses and gravity if they are unknown; None for the robot's own.
    """

    robot: Robot
    chain: Chain
    effects: tuple[AbstractEffect, ...]
    weights: Masses | None = None

    @classmethod
    def of(cls, arm: "Robot | TrialArm") -> "TrialArm":
        """A robot as it is, or the trial itself."""
        return arm if isinstance(arm, TrialArm) else cls(arm, arm.chain, arm.effects)

    @property
    def masses(self) -> Masses:
        """Those in force."""
        return masses(self.robot) if self.weights is None else self.weights


def motion_wrenches(
    arm: Robot | TrialArm, motion: Motion, *, shift: Float[np.ndarray, "_ _"] = NO_SHIFT
) -> Float[np.ndarray, "rows n 6"]:
    """Wrench [f; τ] that the link before each joint exerts on the link after it, in the joint's own axes.

    Args:
        arm: With masses.
        motion: Rows with payload, wrench at the tool and motion if known.
        shift: What effects add to each element's value; an empty array for nothing.

    Returns:
        By column of q: force [N] and moment [N m] at the origin of the joint's mount, in the mount's axes.
        `own_axis` gives the component along the joint's axis.
    """
    arm = TrialArm.of(arm)
    return _summed(arm, motion, arm.masses, shift)[:, 0]


def load_regressor(
    arm: Robot | TrialArm,
    motion: Motion,
    varying: Int[np.ndarray, " w"],
    *,
    shift: Float[np.ndarray, "_ _"] = NO_SHIFT,
) -> Float[np.ndarray, "rows n 6 w"]:
    """Derivative of `motion_wrenches` in masses and centres, and in the two angles of gravity.

    Wrenches are linear in gravity, proportional to a point mass, linear in its position at rest and quadratic
    in motion, so that the differences below are exact. Payload and external wrench depend on gravity alone.

    Pinocchio's regressors are those of the drives' own torques, without deflection; here the moments across
    the joints' axes are needed too. The tests compare the two where both apply.

    Args:
        varying: Which columns to compute, ascending: indices in `Robot.inertia`, followed by the two angles.
    """
    arm = TrialArm.of(arm)
    known, is_weight = arm.masses, varying < 4 * len(arm.masses.mass)
    found = [np.zeros((len(motion), arm.robot.dof, 6, 0))]
    if is_weight.any():
        still = motion.velocity is None and motion.acceleration is None
        steps = np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])[: 4 if still else 7]
        points = known.com[:, None] + steps
        mass = np.where(steps.any(1), known.mass[:, None], 1.0)
        parts = Masses(np.repeat(known.after, len(steps)), mass.ravel(), points.reshape(-1, 3), known.gravity)
        each = _summed(arm, replace(motion, payload=None, wrench=None), parts, shift, separate=True)
        table = each.reshape(len(motion), len(points), len(steps), arm.robot.dof, 6)
        here = known.mass[:, None, None, None] * table[:, :, :1]
        by_com = table[:, :, 1:4] - here if still else 0.5 * (table[:, :, 1:4] - table[:, :, 4:])
        table = np.concatenate([table[:, :, :1], by_com], axis=2).reshape(len(motion), -1, arm.robot.dof, 6)
        found.append(np.moveaxis(table, 1, 3)[..., varying[is_weight]])
    if not is_weight.all():
        rest = replace(motion, wrench=None, velocity=None, acceleration=None)
        turned = np.cross(level_axes(arm.robot.gravity)[:2], known.gravity)
        sums = [_summed(arm, rest, replace(known, gravity=gravity), shift)[:, 0] for gravity in turned]
        found.append(np.stack(sums, axis=-1)[..., varying[~is_weight] - 4 * len(known.mass)])
    return np.concatenate(found, axis=3)


def _summed(
    arm: TrialArm, motion: Motion, weights: Masses, shift: Float[np.ndarray, "_ _"], *, separate: bool = False
) -> Float[np.ndarray, "rows sums n 6"]:
    """Wrenches of all point masses together, with payload and external wrench, or of each separately."""
    robot, chain, rates = arm.robot, arm.chain, (motion.velocity, motion.acceleration)
    robot.check_joints(motion.q)
    for rows, source in zip(rates, ("joint velocities", "joint accelerations"), strict=True):
        if rows is not None:
            robot.check_joints(rows, source)
    mass, com, after = weights.mass[None], weights.com, weights.after
    if motion.payload is not None:  # one more mass, behind all joints
        mass = np.column_stack([np.tile(mass, (len(motion), 1)), motion.payload])
        com = np.vstack([com, np.zeros(3)])
        after = np.append(after, len(chain.elements) - 1)
    ends, mounted, placed, drives, bodies = _stops(robot, after.tobytes())
    frames = chains.frames(chain, motion.q, ends, first=robot.base_size, shift=shift)
    # components first, so that all of one component lie side by side
    at = np.moveaxis(frames[:, :, :3], (3, 2), (0, 1)).copy()
    axes, links = np.take(at, mounted, axis=3), np.take(at, placed, axis=3)
    points = sum(links[i] * com[:, i] for i in range(3)) + links[3]
    force = -weights.gravity[:, None, None] * mass
    if any(rows is not None for rows in rates):
        pushed = _accelerations(chain, motion, frames[:, drives], np.moveaxis(points, 0, 2), after)
        force = force + mass * np.moveaxis(pushed, 2, 0)
    loads = np.stack([np.broadcast_to(force, points.shape), se3.cross(points.T, force.T).T])
    if motion.wrench is not None:
        pull = -motion.wrench.T.reshape(2, 3, -1, 1)
        pull[1] += se3.cross(at[3, :, :, -1:].T, pull[0].T).T
        loads, bodies = np.append(loads, pull, axis=3), np.append(bodies, robot.dof)
    carried = (bodies[:, None] > np.arange(robot.dof)).astype(float)
    sums = loads[..., None] * carried if separate else (loads @ carried)[:, :, :, None]
    sums[1] += se3.cross(sums[0].T, axes[3, :, :, None].T).T
    own = sum(sums[:, i, None] * axes[:3, i, :, None] for i in range(3))
    return np.moveaxis(own.reshape(6, *own.shape[2:]), 0, -1)


@lru_cache(maxsize=64)
def _stops(robot: Robot, after: bytes) -> tuple[Int[np.ndarray, " stops"], ...]:
    """Frames of a chain for masses after these elements; kept, as a fixed point asks again and again.

    Returns:
        Elements after which they lie, increasing, the last one the tool's; which of them are the joints'
        mounts, the masses', and those right before the driven elements; how many joints carry each mass.
    """
    chain, mount, behind = robot.chain, mounts(robot), np.frombuffer(after, np.int64)
    parts = (mount - 1, behind, np.flatnonzero(chain.drivers >= 0) - 1, [len(chain.elements) - 1])
    ends, where = np.unique(np.concatenate(parts), return_inverse=True)
    mounted, placed, driven, _ = np.split(where, np.cumsum([len(part) for part in parts[:3]]))
    return ends, mounted, placed, driven, np.searchsorted(mount, behind, side="right")


def _accelerations(
    chain: Chain,
    motion: Motion,
    drives: Float[np.ndarray, "rows d 4 4"],
    points: Float[np.ndarray, "rows m 3"],
    after: Int[np.ndarray, " m"],
) -> Float[np.ndarray, "rows m 3"]:
    """Accelerations of points after some elements, body by body from the base outwards, by the frames right
    before the driven elements.

    A point at r from a body's origin o has a_o + α × r + ω × (ω × r). A joint about z adds ω × z q̇ + z q̈
    to α and z q̇ to ω, one along z adds 2 ω × z q̇ + z q̈ to a_o.
    """
    speed, rate = (
        chain.positions(np.zeros(motion.q.shape) if rows is None else rows)
        for rows in (motion.velocity, motion.acceleration)
    )
    origin, spin, change, start = np.zeros((4, len(motion), 1, 3))

    def at(points: np.ndarray) -> np.ndarray:
        away = points - origin
        return start - se3.cross(away, change) + se3.cross(se3.cross(away, spin), spin)

    out = np.zeros(points.shape)
    for k, element in enumerate(np.flatnonzero(chain.drivers >= 0)):
        frame, column = drives[:, k, None, :3], chain.drivers[element]
        z, moved, pushed = frame[..., chain.axes[element] % 3], speed[:, column], rate[:, column]
        turned = se3.cross(spin, z) * moved[:, None, None]
        start, origin = at(frame[..., 3]), frame[..., 3]
        if chain.axes[element] < 3:
            change = change + turned + z * pushed[:, None, None]
            spin = spin + z * moved[:, None, None]
        else:
            start = start + 2.0 * turned + z * pushed[:, None, None]
        behind = after >= element
        out[:, behind] = at(points[:, behind])
    return out


def own_axis(robot: Robot) -> Int[np.ndarray, " n"]:
    """Component of a joint's wrench held by its drive: 3–5 for a rotation, 0–2 for a translation."""
    return own_components(robot.chain, range(robot.dof))[:, 1]
