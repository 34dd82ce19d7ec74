"""What a robot's effects add to its chain, and the derivative of that.

    s = Σ_e c_e φ_e(state, W(p, s)),      W the wrenches through the joints of the arm as it is bent

Wrenches depend on the bent pose, so that s is a fixed point; a joint gives way by milliradians, and each
round brings some three digits. With φ's slope in W, the total derivative of s is

    (1 − ∂s/∂v) ds = ∂s/∂p dp + φ dc

row by row, and the tool's twist is that of the shifted chain along dv = dp + ds. Nothing is differentiated
by hand but each effect's own law.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from workbench import chain as chains
from workbench.chain import NO_SHIFT, Chain
from workbench.effects import AbstractEffect, Loads
from workbench.errors import DataError
from workbench.model.loads import wrench_derivative
from workbench.model.statics import joint_wrenches, own_axis
from workbench.motion import Motion
from workbench.robots.robot import Robot

ROUNDS = 20
"""Rounds of the fixed point; an arm that is stiff enough to be called one needs five."""
SETTLED = 1e-13
"""Change of a value [rad or m] below which the fixed point is reached."""
NO_WRENCHES = np.zeros((0, 0, 6))


@dataclass(frozen=True, eq=False)
class Deflection:
    """A bent arm.

    Args:
        shift: What the effects add to each element of the chain [rad or m].
        wrenches: Through every joint of the bent arm; empty where no effect asks for them.
    """

    shift: Float[np.ndarray, "rows k"]
    wrenches: Float[np.ndarray, "_ _ 6"]


def deflect(robot: Robot, motion: Motion, *, values: Float[np.ndarray, " k"] | None = None) -> Deflection:
    """The fixed point of a robot's effects.

    Args:
        robot: Arm with its effects; K elements in the full chain.
        motion: State of every row.
        values: Constants of the chain to use instead of the robot's own.

    Raises:
        DataError: an effect misses its driver, or masses and torques are both unknown.
    """
    robot.check_joints(motion.q)
    chain = robot.chain if values is None else robot.chain.with_values(values)
    still, bent = _by_loads(robot.effects)
    fixed = _add(chain, motion, still, NO_WRENCHES)
    if not bent or not len(motion):
        return Deflection(fixed, NO_WRENCHES)
    payload = _check_loads(robot, motion, bent)
    if not robot.has_masses:
        measured = np.full((*motion.q.shape, 6), np.nan)
        measured[:, np.arange(robot.dof), own_axis(robot)] = motion.torque
        return Deflection(fixed + _add(chain, motion, bent, measured), measured)
    shift = fixed
    for _ in range(ROUNDS):
        wrenches = joint_wrenches(robot, motion.q, payload=payload, values=values, shift=shift)
        new = fixed + _add(chain, motion, bent, wrenches)
        change = float(np.abs(new - shift).max())
        shift = new
        if change < SETTLED:
            break
    return Deflection(shift, wrenches)


def shift_of(
    robot: Robot, motion: Motion, *, values: Float[np.ndarray, " k"] | None = None
) -> Float[np.ndarray, "_ _"]:
    """What the effects add to each element of the chain; empty for a robot without any."""
    return deflect(robot, motion, values=values).shift if robot.effects else NO_SHIFT


def effect_columns(
    robot: Robot,
    motion: Motion,
    columns: Int[np.ndarray, " p"],
    coefficients: Sequence[str],
    *,
    values: Float[np.ndarray, " k"] | None = None,
) -> tuple[Float[np.ndarray, "rows 4 4"], Float[np.ndarray, "rows 6 pc"]]:
    """Poses of the bent arm, and the tool's twist per constant and per coefficient: the total derivative.

    Args:
        robot: Arm with its effects.
        motion: State of every row.
        columns: Elements of the full chain whose constants vary, P of them.
        coefficients: Names of the coefficients that vary, C of them.
        values: Constants of the chain to use instead of the robot's own.

    Returns:
        Poses, and twists [v; w] at the tool's origin in base axes, P + C columns.
    """
    bent = deflect(robot, motion, values=values)
    chain = robot.chain if values is None else robot.chain.with_values(values)
    moved = chain.indices(dict.fromkeys(n for e in robot.effects for n in e.elements(chain)))
    union, where = np.unique(np.concatenate([columns, moved]), return_inverse=True)
    poses, twists = chains.twists(chain, motion.q, union, shift=bent.shift)
    p = len(columns)
    own, others = twists[:, :, where[:p]], twists[:, :, where[p:]]
    slopes = _slopes(robot, chain, motion, bent, moved, union, where, p)
    laws = _laws(robot, chain, motion, bent, moved, coefficients)
    right = np.concatenate([slopes[:, :, :p], laws], 2)
    change = np.linalg.solve(np.eye(len(moved)) - slopes[:, :, p:], right)
    out = others @ change
    out[:, :, :p] += own
    return poses, out


def _by_loads(effects: Sequence[AbstractEffect]) -> tuple[list[AbstractEffect], list[AbstractEffect]]:
    """Effects that need no wrenches, and those that do."""
    return [e for e in effects if not e.loads], [e for e in effects if e.loads]


def _check_loads(robot: Robot, motion: Motion, bent: list[AbstractEffect]) -> np.ndarray | None:
    """The payloads; refuse an arm whose moments can't be known."""
    if robot.has_masses:
        return None if motion.payload is None else motion.need("payload", bent[0].name)
    unknown = next(j.name for j in robot.moving if j.mass is None)
    remedy = f"{unknown} of robot '{robot.name}' has no mass; add 'mass' [kg] and 'com' [m] to its [[joint]]"
    if all(e.loads is Loads.OWN for e in bent):
        if motion.torque is not None:
            motion.need("torque", bent[0].name)
            return None
        remedy += ", or the columns torque1[N*m], torque2[N*m] … to the data"
    worst = max(bent, key=lambda e: e.loads)
    raise DataError(f"effect '{worst.name}' needs the moments of the joints, but {remedy}")


def _add(chain: Chain, motion: Motion, effects: Sequence[AbstractEffect], wrenches: np.ndarray) -> np.ndarray:
    """Sum of the effects' increments, (rows, K)."""
    out = np.zeros((len(motion), len(chain.elements)))
    for effect in effects:
        law = effect.law(chain, motion, wrenches)
        out[:, chain.indices(effect.elements(chain))] += law @ np.array(effect.coefficients)
    return out


def _laws(robot, chain, motion, bent, moved, coefficients) -> np.ndarray:
    """Increment of every moved element per unit of the chosen coefficients, (rows, E, C)."""
    out = np.zeros((len(motion), len(moved), len(coefficients)))
    place = {int(k): i for i, k in enumerate(moved)}
    column = {name: i for i, name in enumerate(coefficients)}
    for effect in robot.effects:
        mine = [i for i, name in enumerate(effect.names) if name in column]
        if mine:
            rows = [place[int(k)] for k in chain.indices(effect.elements(chain))]
            law = effect.law(chain, motion, bent.wrenches)[:, :, mine]
            out[:, np.array(rows)[:, None], [column[effect.names[i]] for i in mine]] += law
    return out


def _slopes(robot, chain, motion, bent, moved, union, where, p: int) -> np.ndarray:
    """Derivative of every moved element's increment in p constants, then in the moved values."""
    out = np.zeros((len(motion), len(moved), len(where)))
    if robot.has_masses and any(e.loads for e in robot.effects):
        payload, shift = motion.payload, bent.shift
        by_union = wrench_derivative(
            robot, motion.q, union, payload=payload, values=chain.values, shift=shift
        )
        change = by_union[..., where]
    else:
        change = np.zeros((*motion.q.shape, 6, len(where)))
    constants = np.concatenate([union[where[:p]], np.full(len(moved), -1)])
    place = {int(k): i for i, k in enumerate(moved)}
    for effect in robot.effects:
        slope = effect.slope(chain, motion, bent.wrenches, change, constants)
        if slope is not None:
            out[:, [place[int(k)] for k in chain.indices(effect.elements(chain))]] += slope
    return out
