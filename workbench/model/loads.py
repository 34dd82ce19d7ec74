"""How the wrenches through the joints change with the values of the chain, rows at rest.

With S, C the mass and first moment of all that element k (twist [v; a] at the tool p_e) carries, the lever of
the weight grows by a × (C − S p_e) + S v per unit of v_k. Elements behind a joint change its moment by the
cross product of that with −g; those before it turn joint and masses alike, which is a turn of gravity by −a.

    k behind j:   Δτ_j = g × (a × (C_k − S_k p_e) + S_k v)
    k before j:   Δτ_j = g × (a × L_j) − a × τ_j,   Δf_j = −a × f_j,      L_j = C_j − S_j p_j

in the axes of the joint (see `statics`). Elements of the base change nothing, as gravity is given after them.
"""

import numpy as np
from jaxtyping import Float, Int

from workbench import chain as chains
from workbench.chain import NO_SHIFT
from workbench.model.statics import masses
from workbench.robots.robot import Robot
from workbench.types import JointRows


def wrench_derivative(
    robot: Robot,
    q: JointRows,
    columns: Int[np.ndarray, " p"],
    *,
    payload: Float[np.ndarray, " _"] | None = None,
    values: Float[np.ndarray, " k"] | None = None,
    shift: Float[np.ndarray, "_ _"] = NO_SHIFT,
) -> Float[np.ndarray, "rows n 6 p"]:
    """Derivative of `statics.joint_wrenches` in the values of some elements.

    Args:
        robot: Geometry with masses; n joints.
        q: Joint positions [rad or m].
        columns: Elements of the full chain, each once.
        payload: Mass at the tool, one number a row [kg].
        values: Constants of the chain to use instead of the robot's own.
        shift: What effects add to each element's value.
    """
    chain, weights, first = robot.chain, masses(robot), robot.base_size
    joints = np.array([int(np.argmax(chain.drivers == j)) for j in range(robot.dof)])
    last = len(chain.elements) - 1
    wanted = np.unique([first - 1, *(joints - 1), *weights.after, last])
    found = chains.frames(chain, q, wanted, values=values, shift=shift)
    frames = {int(k): found[:, i] for i, k in enumerate(wanted)}
    _, twists = chains.twists(chain, q, columns, values=values, shift=shift)
    v, a = np.moveaxis(twists[:, :3], 1, 2), np.moveaxis(twists[:, 3:], 1, 2)
    gravity = frames[first - 1][:, :3, :3] @ robot.gravity
    tool = frames[last][:, :3, 3]
    after = np.append(weights.after, last)
    mass = np.broadcast_to(np.append(weights.mass, 0.0), (len(q), len(after))).copy()
    if payload is not None:
        mass[:, -1] = payload
    com = np.vstack([weights.com, np.zeros((1, 3))])
    places = [
        frames[int(k)][:, :3, :3] @ c + frames[int(k)][:, :3, 3] for k, c in zip(after, com, strict=True)
    ]
    moment = mass[..., None] * np.stack(places, 1)
    carried = (after >= columns[:, None]).astype(float)
    total, firsts = mass @ carried.T, np.einsum("pi,rix->rpx", carried, moment)
    lever = np.cross(a, firsts - total[..., None] * tool[:, None]) + total[..., None] * v
    behind = np.cross(gravity[:, None], lever)
    out = np.zeros((len(q), robot.dof, 6, len(columns)))
    for j, element in enumerate(joints):
        before = frames[int(element) - 1]
        mine = (after >= element).astype(float)
        size = mass @ mine
        arm = np.einsum("i,rix->rx", mine, moment) - size[:, None] * before[:, :3, 3]
        force, torque = -size[:, None] * gravity, np.cross(gravity, arm)
        turned = np.cross(gravity[:, None], np.cross(a, arm[:, None])) - np.cross(a, torque[:, None])
        pushed = -np.cross(a, force[:, None])
        later = (columns >= element)[None, :, None]
        changed = np.where(later, behind, turned)
        out[:, j, 3:] = np.einsum("rxi,rpx->rip", before[:, :3, :3], changed)
        out[:, j, :3] = np.einsum("rxi,rpx->rip", before[:, :3, :3], np.where(later, 0.0, pushed))
    out[..., columns < first] = 0.0
    return out
