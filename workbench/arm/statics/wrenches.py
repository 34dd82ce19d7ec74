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
from typing import no_type_check

import numpy as np
from jaxtyping import Float, Int
from numba import njit

from workbench.arm.chain import NO_SHIFT, Chain, _advance, inner
from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.axes import Insertion, own_components
from workbench.arm.gravity import level_axes
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.errors import RobotError
from workbench.base.types import Vector3, frozen

NO_PULL = np.zeros((0, 6))


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

    def __post_init__(self) -> None:
        # one array type, since numba compiles again for each
        for name in ("after", "mass", "com", "gravity"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

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
    arm: Robot | TrialArm,
    motion: Motion,
    *,
    payload_com: Vector3 | None = None,
    shift: Float[np.ndarray, "_ _"] = NO_SHIFT,
) -> Float[np.ndarray, "rows n 6"]:
    """Wrench [f; τ] that the link before each joint exerts on the link after it, in the joint's own axes.

    Args:
        arm: With masses.
        motion: Rows with payload, wrench at the tool and motion if known.
        payload_com: Centre of the payload in the tool frame [m]; the tool's origin if None.
        shift: What effects add to each element's value; an empty array for nothing.

    Returns:
        By column of q: force [N] and moment [N m] at the origin of the joint's mount, in the mount's axes.
        `own_axis` gives the component along the joint's axis.
    """
    arm = TrialArm.of(arm)
    return _summed(arm, motion, arm.masses, shift, payload_com=payload_com)[:, 0]


def inertia_regressor(
    arm: Robot | TrialArm, motion: Motion, *, shift: Float[np.ndarray, "_ _"] = NO_SHIFT
) -> Float[np.ndarray, "rows n 6 links4"]:
    """Derivative of `motion_wrenches` in every link's mass and centre, in the order of `Robot.inertia`.

    Wrenches are proportional to a point mass, linear in its position at rest and quadratic in motion, so that
    the differences below are exact. Payload and external wrench do not depend on them.

    Pinocchio's regressors are those of the drives' own torques, without deflection; here the moments across
    the joints' axes are needed too. The tests compare the two where both apply.
    """
    arm = TrialArm.of(arm)
    known, still = arm.masses, motion.velocity is None and motion.acceleration is None
    steps = np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])[: 4 if still else 7]
    points = known.com[:, None] + steps
    mass = np.where(steps.any(1), known.mass[:, None], 1.0)
    parts = Masses(np.repeat(known.after, len(steps)), mass.ravel(), points.reshape(-1, 3), known.gravity)
    bare = replace(motion, payload=None, wrench=None)
    found = _summed(arm, bare, parts, shift, separate=True)
    table = found.reshape(len(motion), len(points), len(steps), arm.robot.dof, 6)
    here = known.mass[:, None, None, None] * table[:, :, :1]
    by_com = table[:, :, 1:4] - here if still else 0.5 * (table[:, :, 1:4] - table[:, :, 4:])
    out = np.concatenate([table[:, :, :1], by_com], axis=2)
    return np.moveaxis(out.reshape(len(motion), 4 * len(points), arm.robot.dof, 6), 1, 3)


def load_regressor(
    arm: Robot | TrialArm,
    motion: Motion,
    varying: Int[np.ndarray, " w"],
    *,
    shift: Float[np.ndarray, "_ _"] = NO_SHIFT,
) -> Float[np.ndarray, "rows n 6 w"]:
    """Derivative of `motion_wrenches` in masses and centres, and in the angles of gravity.

    Args:
        varying: Which columns to compute, ascending: indices in `Robot.inertia`, followed by the two angles.
    """
    arm = TrialArm.of(arm)
    size = 4 * len(arm.masses.mass)
    parts = [np.zeros((len(motion), arm.robot.dof, 6, 0))]
    if (varying < size).any():
        parts.append(inertia_regressor(arm, motion, shift=shift)[..., varying[varying < size]])
    if (varying >= size).any():
        parts.append(gravity_regressor(arm, motion, shift=shift)[..., varying[varying >= size] - size])
    return np.concatenate(parts, axis=3)


def gravity_regressor(
    arm: Robot | TrialArm, motion: Motion, *, shift: Float[np.ndarray, "_ _"] = NO_SHIFT
) -> Float[np.ndarray, "rows n 6 2"]:
    """Derivative of `motion_wrenches` in the two angles of gravity (`arm/gravity.py`): it is linear in g."""
    arm = TrialArm.of(arm)
    still = replace(motion, wrench=None, velocity=None, acceleration=None)
    turned = np.cross(level_axes(arm.robot.gravity)[:2], arm.masses.gravity)
    parts = [_summed(arm, still, replace(arm.masses, gravity=gravity), shift)[:, 0] for gravity in turned]
    return np.stack(parts, axis=-1)


def _summed(
    arm: TrialArm,
    motion: Motion,
    weights: Masses,
    shift: Float[np.ndarray, "_ _"],
    *,
    separate: bool = False,
    payload_com: Vector3 | None = None,
) -> Float[np.ndarray, "rows sums n 6"]:
    """Wrenches of all point masses together, with payload and external wrench, or of each separately."""
    robot, chain, rates = arm.robot, arm.chain, (motion.velocity, motion.acceleration)
    robot.check_joints(motion.q)
    for rows, source in zip(rates, ("joint velocities", "joint accelerations"), strict=True):
        if rows is not None:
            robot.check_joints(rows, source)
    none = NO_SHIFT if all(rows is None for rows in rates) else np.zeros(motion.q.shape)
    out = np.zeros((len(motion), len(weights.mass) if separate else 1, robot.dof, 6))
    _wrenches(
        robot.base_size,  # gravity is given in the frame after the base
        chain.axes,
        chain.drivers,
        mounts(robot),
        frozen(chain.values),
        chain.constants,
        weights.after,
        separate,
        weights.mass,
        weights.com,
        weights.gravity,
        *(
            frozen(chain.positions(np.asarray(none if rows is None else rows, float)))
            for rows in (motion.q, *rates)
        ),
        frozen(np.zeros(0) if motion.payload is None else np.asarray(motion.payload, float)),
        frozen(np.zeros(3) if payload_com is None else np.asarray(payload_com, float)),
        frozen(NO_PULL if motion.wrench is None else np.asarray(motion.wrench, float)),
        frozen(shift),
        out,
    )
    return out


def own_axis(robot: Robot) -> Int[np.ndarray, " n"]:
    """Component of a joint's wrench held by its drive: 3–5 for a rotation, 0–2 for a translation."""
    return own_components(robot.chain, range(robot.dof))[:, 1]


@inner
@no_type_check
def _accelerate(point, origin, spin, change, start, out):
    """Acceleration of a point of a body: start + change × r + spin × (spin × r), r = point − origin."""
    x, y, z = point[0] - origin[0], point[1] - origin[1], point[2] - origin[2]
    u = spin[1] * z - spin[2] * y
    v = spin[2] * x - spin[0] * z
    w = spin[0] * y - spin[1] * x
    out[0] = start[0] + change[1] * z - change[2] * y + spin[1] * w - spin[2] * v
    out[1] = start[1] + change[2] * x - change[0] * z + spin[2] * u - spin[0] * w
    out[2] = start[2] + change[0] * y - change[1] * x + spin[0] * v - spin[1] * u


@inner
@no_type_check
def _load(t, mass, com, gravity, moving, origin, spin, change, start, c, force, total):
    """Add the force that carries a point mass, and its moment about the arm's first frame, to a body's.

    `c` and `force` are workspace.
    """
    for i in range(3):
        force[i] = 0.0
        c[i] = t[i, 3] + t[i, 0] * com[0] + t[i, 1] * com[1] + t[i, 2] * com[2]
    if moving:
        _accelerate(c, origin, spin, change, start, force)
    x, y, z = c[0], c[1], c[2]
    u, v, w = mass * (force[0] - gravity[0]), mass * (force[1] - gravity[1]), mass * (force[2] - gravity[2])
    total[0] += u
    total[1] += v
    total[2] += w
    total[3] += y * w - z * v
    total[4] += z * u - x * w
    total[5] += x * v - y * u


@inner
@no_type_check
def _resist(t, pull, total):
    """Add the reaction to a wrench at the origin of t, taken about the arm's first frame, to the body's."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        total[i] -= pull[i]
        total[3 + i] -= pull[3 + i] + t[j, 3] * pull[k] - t[k, 3] * pull[j]


@inner
@no_type_check
def _join(axis, t, value, speed, change_of_speed, origin, spin, change, start):
    """Propagate the motion (spin and change of the body, start at origin) over one driven element.

    `t` is the frame right before the element. The new origin is right after it.
    """
    z, at, here = np.empty(3), np.empty(3), np.empty(3)
    for i in range(3):
        z[i] = t[i, axis % 3]
        here[i] = t[i, 3] + (z[i] * value if axis >= 3 else 0.0)
    _accelerate(here, origin, spin, change, start, at)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        turned = (spin[j] * z[k] - spin[k] * z[j]) * speed
        if axis >= 3:
            at[i] += 2.0 * turned + z[i] * change_of_speed
        else:
            change[i] += turned + z[i] * change_of_speed
    for i in range(3):
        if axis < 3:
            spin[i] += z[i] * speed
        origin[i] = here[i]
        start[i] = at[i]


@njit(cache=True, nogil=True)
@no_type_check
def _wrenches(
    first, axes, drivers, mount, values, constants, after, separate, mass, com, gravity, q, velocity,
    acceleration, payload, payload_com, pull, shift, out,
):  # fmt: skip
    moving = velocity.shape[0] > 0
    shifted = shift.shape[0] > 0
    n = mount.shape[0]
    mounted = np.full(axes.shape[0], -1)
    for joint in range(n):
        mounted[mount[joint]] = joint
    t = np.empty((3, 4))
    before = np.empty((n, 3, 4))
    totals, bodies = np.empty((out.shape[1], n + 1, 6)), np.full(out.shape[1], n)
    order = np.empty(n, np.int64)
    origin, spin, change, start = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    c, force = np.empty(3), np.empty(3)
    for row in range(q.shape[0]):
        for i in range(3):
            for j in range(4):
                t[i, j] = 1.0 if i == j else 0.0
            origin[i] = spin[i] = change[i] = start[i] = 0.0
        totals[:] = 0.0
        body, link = 0, 0
        for k in range(first, axes.shape[0] + 1):
            while link < after.shape[0] and after[link] < k:
                _load(
                    t, mass[link], com[link], gravity, moving, origin, spin, change, start, c, force,
                    totals[link if separate else 0, body],
                )  # fmt: skip
                if separate:
                    bodies[link] = body
                link += 1
            if k == axes.shape[0]:
                break
            value = values[k]
            joint = drivers[k]
            if joint >= 0:
                value += q[row, joint]
            if shifted:
                value += shift[row, k]
            if mounted[k] >= 0:
                for i in range(3):
                    for j in range(4):
                        before[body, i, j] = t[i, j]
                order[body] = mounted[k]
                body += 1
            if joint >= 0 and moving:
                _join(
                    axes[k], t, value, velocity[row, joint], acceleration[row, joint],
                    origin, spin, change, start,
                )  # fmt: skip
            if value != 0.0 or axes[k] == 6:
                _advance(axes[k], value, constants[k], t)
        if payload.shape[0] > 0:
            _load(
                t, payload[row], payload_com, gravity, moving, origin, spin, change, start, c, force,
                totals[0, body],
            )  # fmt: skip
        if pull.shape[0] > 0:
            _resist(t, pull[row], totals[0, body])
        for k in range(out.shape[1]):
            _project(before, totals[k], order[: bodies[k]], out[row, k])


@inner
@no_type_check
def _project(before, totals, order, out):
    """Sum the bodies from the tool inwards, and rotate each sum into its joint's own axes at its origin."""
    for k in range(order.shape[0] - 1, -1, -1):
        for i in range(6):
            totals[k, i] += totals[k + 1, i]
        f, m, frame = totals[k + 1, :3], totals[k + 1, 3:], before[k]
        x, y, z = frame[0, 3], frame[1, 3], frame[2, 3]
        u = m[0] - (y * f[2] - z * f[1])
        v = m[1] - (z * f[0] - x * f[2])
        w = m[2] - (x * f[1] - y * f[0])
        for i in range(3):
            out[order[k], i] = frame[0, i] * f[0] + frame[1, i] * f[1] + frame[2, i] * f[2]
            out[order[k], 3 + i] = frame[0, i] * u + frame[1, i] * v + frame[2, i] * w
