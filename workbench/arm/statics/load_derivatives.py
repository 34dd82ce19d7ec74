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

import numpy as np
from jaxtyping import Float, Int

from workbench.arm import chain as chains
from workbench.arm.chain import NO_SHIFT
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.wrenches import TrialArm, mounts
from workbench.base import se3


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
    chain, first, size = arm.chain, arm.robot.base_size, len(arm.chain.elements)
    every = chains.frames(chain, motion.q, np.arange(first - 1, size), first=first, shift=shift)
    at, tool = every[:, :-1], every[:, -1, :3, 3]  # right before each element, and the tool
    directions = np.swapaxes(at[..., :3, :3], 2, 3)
    own, held = np.maximum(columns - first, 0), mounts(arm.robot)[components[:, 0]] - first
    axis, u = directions[:, own, chain.axes[columns] % 3], directions[:, held, components[:, 1] % 3]
    turns, is_moment = chain.axes[columns, None] < 3, components[:, 1, None] >= 3
    is_carried = columns >= mounts(arm.robot)[components[:, 0], None]

    def change(mass: np.ndarray, moment: np.ndarray, gravity: np.ndarray, free: np.ndarray) -> np.ndarray:
        """Due to the mass (rows, k) and first moment (rows, k, 3) that each element carries, in a gravity and
        under a free moment."""
        lever = moment - mass[..., None] * at[..., :3, 3]
        grown = np.where(turns, se3.cross(axis, lever[:, own]), mass[:, own, None] * axis)
        side = se3.cross(u, gravity)
        around = se3.cross(se3.cross(lever[:, held], u), gravity) - se3.cross(u, free)
        turned = np.where(is_moment, around, -mass[:, held, None] * side)
        out = turned @ np.swapaxes(axis * turns, 1, 2)
        np.copyto(out, (side * is_moment) @ np.swapaxes(grown, 1, 2), where=is_carried)
        return out

    weights = arm.masses
    mass, after = np.tile(weights.mass, (len(motion), 1)), weights.after
    centres = se3.apply(every[:, after + 1 - first], weights.com)
    if motion.payload is not None:
        mass, after = np.column_stack([mass, motion.payload]), np.append(after, size - 1)
        centres = np.concatenate([centres, tool[:, None]], axis=1)
    carried = (after >= np.arange(first, size)[:, None]).astype(float)
    moments = carried @ (mass[..., None] * centres)
    out = change(mass @ carried.T, moments, weights.gravity, np.zeros(3))
    if motion.wrench is not None:
        force, moment = np.split(motion.wrench[:, None], 2, axis=2)
        places = np.broadcast_to(tool[:, None], moments.shape)
        out += change(np.ones(at.shape[:2]), places, force, moment)
    out[:, :, columns < first] = 0.0
    return out
