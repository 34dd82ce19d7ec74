"""Derivative of the wrenches through the joints in the values of the chain, for rows at rest.

With S, C the mass and first moment of all that element k (axis a through p_k) carries, C grows by
a × (C − S p_k) per unit of v_k if it turns, and by S a if it slides. A component of a joint's wrench along
the unit vector u, which stands on the link before the joint, is

    u·τ_j = u·(g × L_j),      L_j = C_j − S_j p_j,            u·f_j = −S_j u·g

p_j and the axes u are those of the joint's mount (see `wrenches`). Elements after it change L_j; those
before it rotate joint and masses together, which is a rotation of gravity by −a.

    k after j:    Δ(u·τ_j) = (u × g)·ΔC,             Δ(u·f_j) = 0
    k before j:   Δ(u·τ_j) = ((L_j × u) × g)·a,      Δ(u·f_j) = −S_j (u × g)·a      (0 if k slides)

Elements of the base have no influence, as gravity is given after them (see `wrenches`). An external wrench
[F; M] at the tool's origin p_e is one more weight, S = 1, C = p_e, in a gravity of F; its moment M only
rotates, (M × u)·a for k before j.

Pinocchio's derivatives of `rnea` are in joint positions only: here the wrenches are differentiated in every
free constant of the chain, base and tool included, and in every element deflected by effects.
"""

from typing import no_type_check

import numpy as np
from jaxtyping import Float, Int
from numba import njit

from workbench.arm.chain import NO_SHIFT, _advance, inner
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.wrenches import NO_PULL, TrialArm, mounts
from workbench.base.types import frozen


def wrench_derivative(
    arm: Robot | TrialArm,
    motion: Motion,
    columns: Int[np.ndarray, " p"],
    components: Int[np.ndarray, "m 2"],
    *,
    shift: Float[np.ndarray, "_ _"] = NO_SHIFT,
) -> Float[np.ndarray, "rows m p"]:
    """Derivative of some components of `motion_wrenches`, at rest, in the values of some elements.

    Args:
        arm: With masses.
        motion: Rows with payload and wrench at the tool if known.
        columns: Elements of the full chain, each once.
        components: Joint (column of q), and component of [f; τ] in the joint's own axes.
        shift: Increments by effects, per element.
    """
    arm = TrialArm.of(arm)
    chain, weights = arm.chain, arm.masses
    out = np.empty((len(motion), len(components), len(columns)))
    _derivatives(
        arm.robot.base_size,
        chain.axes,
        chain.drivers,
        mounts(arm.robot),
        frozen(chain.values),
        chain.constants,
        weights.after,
        weights.mass,
        weights.com,
        weights.gravity,
        frozen(chain.positions(motion.q)),
        frozen(np.zeros(0) if motion.payload is None else motion.payload),
        frozen(NO_PULL if motion.wrench is None else np.asarray(motion.wrench, float)),
        frozen(shift),
        np.ascontiguousarray(columns),
        np.ascontiguousarray(components),
        out,
    )
    return out


@inner
@no_type_check
def _cross(a, b, out):
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@inner
@no_type_check
def _carry(t, mass, com, total):
    """Add a point mass and its first moment about the arm's first frame."""
    total[0] += mass
    for i in range(3):
        total[1 + i] += mass * (t[i, 3] + t[i, 0] * com[0] + t[i, 1] * com[1] + t[i, 2] * com[2])


@inner
@no_type_check
def _sweep(first, axes, drivers, values, constants, after, mass, com, q, payload, shift, t, frames, carried):
    """Frames right before every element, and mass and first moment after each."""
    size = axes.shape[0]
    for i in range(3):
        for j in range(4):
            t[i, j] = 1.0 if i == j else 0.0
    carried[:] = 0.0
    link = 0
    for k in range(first, size):
        while link < after.shape[0] and after[link] < k:
            _carry(t, mass[link], com[link], carried[after[link]])
            link += 1
        for i in range(3):
            for j in range(4):
                frames[k, i, j] = t[i, j]
        value = values[k]
        if drivers[k] >= 0:
            value += q[drivers[k]]
        if shift.shape[0] > 0:
            value += shift[0, k]
        if value != 0.0 or axes[k] == 6:
            _advance(axes[k], value, constants[k], t)
    while link < after.shape[0]:
        _carry(t, mass[link], com[link], carried[after[link]])
        link += 1
    if payload.shape[0] > 0:
        carried[size - 1, 0] += payload[0]
        for i in range(3):
            carried[size - 1, 1 + i] += payload[0] * t[i, 3]
    for k in range(size - 1, first, -1):
        for i in range(4):
            carried[k - 1, i] += carried[k, i]


@inner
@no_type_check
def _grow(columns, axes, frames, carried, turn, grown):
    """Each column's axis (0 for a translation), and its derivative of the first moment after it."""
    for p in range(columns.shape[0]):
        k = columns[p]
        size, axis = carried[k, 0], axes[k] % 3
        ax, ay, az = frames[k, 0, axis], frames[k, 1, axis], frames[k, 2, axis]
        if axes[k] < 3:
            x = carried[k, 1] - size * frames[k, 0, 3]
            y = carried[k, 2] - size * frames[k, 1, 3]
            z = carried[k, 3] - size * frames[k, 2, 3]
            turn[0, p], turn[1, p], turn[2, p] = ax, ay, az
            grown[0, p], grown[1, p], grown[2, p] = ay * z - az * y, az * x - ax * z, ax * y - ay * x
        else:
            turn[0, p], turn[1, p], turn[2, p] = 0.0, 0.0, 0.0
            grown[0, p], grown[1, p], grown[2, p] = size * ax, size * ay, size * az


@inner
@no_type_check
def _fall(axes, frames, carried, element, gravity, moment, columns, components, out):
    """Add the change of some components due to the carried mass in a given gravity and to a free moment."""
    turn, grown = np.empty((3, columns.shape[0])), np.empty((3, columns.shape[0]))
    u, lever, around, side, turned = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    _grow(columns, axes, frames, carried, turn, grown)
    for m in range(components.shape[0]):
        joint, component = element[components[m, 0]], components[m, 1]
        size = carried[joint, 0]
        for i in range(3):
            u[i] = frames[joint, i, component % 3]
            lever[i] = carried[joint, 1 + i] - size * frames[joint, i, 3]
        _cross(u, gravity, side)
        if component < 3:
            for i in range(3):
                turned[i] = -size * side[i]
                side[i] = 0.0
        else:
            _cross(lever, u, around)
            _cross(around, gravity, turned)
            _cross(moment, u, lever)
            for i in range(3):
                turned[i] += lever[i]
        for p in range(columns.shape[0]):
            for i in range(3):
                if columns[p] >= joint:
                    out[m, p] += side[i] * grown[i, p]
                else:
                    out[m, p] += turned[i] * turn[i, p]


@njit(cache=True, nogil=True)
@no_type_check
def _derivatives(
    first, axes, drivers, element, values, constants, after, mass, com, gravity, q, payload, pull, shift,
    columns, components, out,
):  # fmt: skip
    t, frames, carried = np.empty((3, 4)), np.zeros((axes.shape[0], 3, 4)), np.empty((axes.shape[0], 4))
    free, force, moment, tool = np.zeros(3), np.empty(3), np.empty(3), np.empty((axes.shape[0], 4))
    gravity = gravity.copy()  # read-only, it would compile everything again
    out[:] = 0.0
    for row in range(q.shape[0]):
        _sweep(
            first, axes, drivers, values, constants, after, mass, com, q[row], payload[row : row + 1],
            shift[row : row + 1], t, frames, carried,
        )  # fmt: skip
        _fall(axes, frames, carried, element, gravity, free, columns, components, out[row])
        if pull.shape[0] > 0:
            for i in range(3):
                force[i], moment[i] = pull[row, i], pull[row, 3 + i]
                for k in range(axes.shape[0]):
                    tool[k, 0], tool[k, 1 + i] = 1.0, t[i, 3]
            _fall(axes, frames, tool, element, force, moment, columns, components, out[row])
    for p in range(columns.shape[0]):
        if columns[p] < first:
            out[:, :, p] = 0.0
