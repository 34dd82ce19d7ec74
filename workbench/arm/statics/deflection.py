"""The increments that a robot's effects add to its chain, and their derivative.

    s = Σ_e c_e φ_e(state, W(p, s)),      W the wrenches through the joints of the arm as it is deflected

Wrenches depend on the deflected pose, so that s is a fixed point; a joint deflects by milliradians, and each
round brings some three digits. With φ's slope in W, the total derivative of s is

    (1 − ∂s/∂v) ds = ∂s/∂p dp + φ dc

row by row, and the tool's twist is that of the shifted chain along dv = dp + ds. Nothing is differentiated
by hand but each effect's own law. In moving rows, ∂W/∂v is that of the weights alone: the change of inertial
loads with the deflection is neglected in the derivative, not in s.

An arm that is too soft for its load has no such equilibrium. Its rows have no shift (NaN), and the outcome
says so: a search takes no step there, and a prediction is refused.

Pinocchio, which computes loads of rigid links, has no such derivative through the equilibrium; the tests
compare it with central differences.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from workbench.arm import chain as chains
from workbench.arm.chain import NO_SHIFT, WHOLE
from workbench.arm.effects import AbstractEffect, Loads
from workbench.arm.effects.effect import NO_WRENCHES
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.load_derivatives import wrench_derivative
from workbench.arm.statics.wrenches import TrialArm, load_regressor, motion_wrenches, own_axis
from workbench.base.errors import DataError
from workbench.base.types import Outcome

MAX_ITERATIONS = 20
"""Maximum number of fixed-point iterations; a typical arm needs five."""
FIXED_POINT_TOLERANCE = 1e-13
"""Change of a value [rad or m] below which the fixed point is reached."""
MAX_LAST_CHANGE = 1e-9
"""A row has no deflection if its values still change by more in the last iteration [rad or m] …"""
HANGING = 4.0
"""… and by more than so many times its play: where a joint's load changes sign within its play, the joint
hangs between its flanks and may rest anywhere there."""


@dataclass(frozen=True, eq=False)
class Deflection:
    """A deflected arm.

    Args:
        shift: Increment of each element of the chain by effects [rad or m]; NaN in rows without equilibrium.
        wrenches: Through every joint of the deflected arm; empty if no effect needs them.
        outcome: Whether all rows converged.
    """

    shift: Float[np.ndarray, "rows k"]
    wrenches: Float[np.ndarray, "_ _ 6"]
    outcome: Outcome = Outcome.CONVERGED


@dataclass(frozen=True, eq=False)
class Twists:
    """Twists [v; w] of the tool per unknown, at its origin in base axes.

    Those per coefficient are products Z φ: there are many laws, but few elements that they change.

    Args:
        plain: Per constant, then per mass and angle of gravity.
        moved: Z, per element changed by effects, including the resulting change of loads.
        laws: By effect with unknown coefficients: its elements' columns of Z, the coefficients' places among
            the unknown ones, and its law φ.
    """

    plain: Float[np.ndarray, "rows 6 pw"]
    moved: Float[np.ndarray, "rows 6 e"]
    laws: tuple[tuple[np.ndarray, np.ndarray, np.ndarray], ...]

    def add_derivatives(
        self,
        by_twist: Float[np.ndarray, "rows m 6"],
        out: Float[np.ndarray, "rm p"],
        places: Int[np.ndarray, " pw"],
        coefficients: Int[np.ndarray, " c"],
    ) -> None:
        """Add derivatives of the observation to the columns with these indices, and with these of
        coefficients, except negative ones."""
        _add_products(by_twist, self.plain, places, out)
        if coefficients.max(initial=-1) >= 0:
            by_element = by_twist @ self.moved
            for elements, which, law in self.laws:
                _add_products(by_element.take(elements, 2), law, coefficients[which], out)

    def pulled(
        self,
        wrench: Float[np.ndarray, "rows 6"],
        out: Float[np.ndarray, " p"],
        places: Int[np.ndarray, " pw"],
        coefficients: Int[np.ndarray, " c"],
    ) -> None:
        """Accumulate the work of each row's wrench per unknown, over all rows."""
        out[places] += wrench.ravel() @ self.plain.reshape(wrench.size, len(places))
        if self.laws:
            by_element = (wrench[:, None] @ self.moved)[:, 0]
            for elements, which, law in self.laws:
                pull = by_element.take(elements, 1).ravel()
                out[coefficients[which]] += pull @ law.reshape(len(pull), len(which))


def deflect(arm: Robot | TrialArm, motion: Motion) -> Deflection:
    """The fixed point of an arm's effects; K elements in its full chain."""
    arm = TrialArm.of(arm)
    return _fixed_point(arm, motion, _laws(arm, motion, loaded=False))


def shift_of(arm: Robot | TrialArm, motion: Motion) -> Float[np.ndarray, "_ _"]:
    """Increments of the chain's elements by effects; empty for an arm without any.

    Raises:
        DataError: the arm has no equilibrium in a row.
    """
    if not arm.effects:
        return NO_SHIFT
    deflected = deflect(arm := TrialArm.of(arm), motion)
    if not deflected.outcome.ok:
        raise no_equilibrium(arm.robot, deflected.shift)
    return deflected.shift


def no_equilibrium(robot: Robot, found: Float[np.ndarray, "rows ..."]) -> DataError:
    """The refusal of a prediction that is NaN in rows without equilibrium."""
    row = int(np.flatnonzero(np.isnan(found.reshape(len(found), -1)).any(1))[0])
    names = " and ".join(dict.fromkeys(e.name for e in robot.effects if e.loads))
    return DataError(
        f"robot '{robot.name}' can't hold its load in row {row} of {len(found)}: the deflection by {names} "
        f"does not converge in {MAX_ITERATIONS} iterations; the coefficients are too large",
        row=row,
    )


def effect_columns(
    arm: Robot | TrialArm,
    motion: Motion,
    columns: Int[np.ndarray, " p"],
    coefficients: Sequence[str],
    *,
    varying: Int[np.ndarray, " w"] | None = None,
    part: slice = WHOLE,
) -> tuple[Float[np.ndarray, "rows 4 4"], Twists]:
    """Poses of the deflected arm, and the tool's twist per constant, coefficient, mass: the total derivative.

    Args:
        arm: With effects.
        columns: Elements of the full chain whose constants vary, P of them.
        coefficients: Names of the coefficients that vary, C of them.
        varying: Which masses and angles of gravity vary: indices in `Robot.inertia`, followed by the two
            angles; all of a trial's own of the former if None.
        part: Elements between the first frame and the one observed instead of the tool, if not all.
    """
    arm = TrialArm.of(arm)
    chain, effects = arm.chain, arm.effects
    laws = _laws(arm, motion, loaded=False)
    deflected = _fixed_point(arm, motion, laws)
    laws |= _laws(arm, motion, loaded=True, wrenches=deflected.wrenches)
    places = [chain.indices(e.elements(chain)) for e in effects]
    moved = np.unique(np.concatenate(places))
    union, where = np.unique(np.concatenate([columns, moved]), return_inverse=True)
    poses, twists = chains.twists(chain, motion.q, union, shift=deflected.shift, part=part)
    rows = [np.searchsorted(moved, p) for p in places]
    components = np.concatenate([e.components(chain) for e in effects])
    if not arm.robot.has_masses:
        components = components[:0]
    jacobian, z = twists[:, :, where[: len(columns)]], twists[:, :, where[len(columns) :]]
    grown = _growth(arm, motion, deflected, columns, rows, len(moved))
    if varying is None:
        varying = np.arange(0 if arm.weights is None else 4 * len(arm.weights.mass))
    by_mass = np.zeros((len(motion), len(moved), len(varying)))
    if len(components):
        gain = _gain(arm, motion, deflected, rows, len(moved))
        by_union = gain @ wrench_derivative(arm, motion, union, components, shift=deflected.shift)
        by_column, by_moved = (by_union[:, :, part] for part in np.split(where, [len(columns)]))
        back = np.eye(len(moved)) - by_moved  # Z = J_moved (1 − ∂s/∂v)⁻¹
        z = np.swapaxes(np.linalg.solve(np.swapaxes(back, 1, 2), np.swapaxes(z, 1, 2)), 1, 2)
        grown = by_column if grown is None else grown + by_column
        if len(varying):
            known = load_regressor(arm, motion, varying, shift=deflected.shift)
            by_mass = gain @ known[:, components[:, 0], components[:, 1]]
    jacobian = jacobian if grown is None else jacobian + z @ grown
    plain = np.concatenate([jacobian, z @ by_mass], axis=2)
    return poses, Twists(plain, z, tuple(_chosen(effects, laws, rows, coefficients)))


def law_sizes(robot: Robot, motion: Motion, coefficients: Sequence[str]) -> dict[str, float]:
    """Maximum change of any element over the rows per unit of some coefficients [rad or m per unit]."""
    arm = TrialArm.of(robot)
    laws = _laws(arm, motion, loaded=False)
    if any(e.loads for e in arm.effects):
        laws |= _laws(arm, motion, loaded=True, wrenches=deflect(arm, motion).wrenches)
    sizes: dict[str, float] = {}
    for i, effect in enumerate(arm.effects):
        maximum = np.maximum(laws[i].max((0, 1), initial=0.0), -laws[i].min((0, 1), initial=0.0))
        sizes |= dict(zip(effect.names, maximum.tolist(), strict=True))
    return {name: sizes[name] for name in coefficients}


def _laws(
    arm: TrialArm, motion: Motion, *, loaded: bool, wrenches: np.ndarray = NO_WRENCHES
) -> dict[int, np.ndarray]:
    """Laws of the effects that need wrenches, or of those that do not, by their index."""
    mine = ((i, e) for i, e in enumerate(arm.effects) if bool(e.loads) is loaded)
    return {i: e.law(arm.chain, motion, wrenches) for i, e in mine}


def _fixed_point(arm: TrialArm, motion: Motion, laws: dict[int, np.ndarray]) -> Deflection:
    """The deflected arm, starting from the effects that need no wrenches."""
    robot, chain = arm.robot, arm.chain
    robot.check_joints(motion.q)
    fixed = np.zeros((len(motion), len(chain.elements)))
    for i, law in laws.items():
        _add(fixed, chain.indices(arm.effects[i].elements(chain)), arm.effects[i], law)
    deflected = [e for e in arm.effects if e.loads]
    if not deflected or not len(motion):
        return Deflection(fixed, np.zeros((0, robot.dof, 6)) if deflected else NO_WRENCHES)
    _check_loads(robot, motion, deflected)
    if robot.has_masses:
        return _deflected(arm, motion, deflected, fixed)
    measured = np.full((*motion.q.shape, 6), np.nan)
    measured[:, np.arange(robot.dof), own_axis(robot)] = motion.torque
    for effect in deflected:
        places = chain.indices(effect.elements(chain))
        _add(fixed, places, effect, effect.law(chain, motion, measured))
    return Deflection(fixed, measured)


def _deflected(
    arm: TrialArm, motion: Motion, deflected: Sequence[AbstractEffect], fixed: np.ndarray
) -> Deflection:
    """Fixed-point iterations, each over the rows that have not converged."""
    chain = arm.chain
    elements = [chain.indices(e.elements(chain)) for e in deflected]
    moved = np.unique(np.concatenate(elements))
    places = [np.searchsorted(moved, mine) for mine in elements]
    shift, wrenches = fixed.copy(), np.empty((*motion.q.shape, 6))
    rows, now, start = np.arange(len(motion)), shift, fixed[:, moved]
    for _ in range(MAX_ITERATIONS):
        loads = motion_wrenches(arm, motion, shift=now)
        new = start.copy()
        for effect, mine in zip(deflected, places, strict=True):
            _add(new, mine, effect, effect.law(chain, motion, loads))
        change = np.abs(new - now[:, moved]).max(1)
        open_rows = change >= FIXED_POINT_TOLERANCE
        now[:, moved] = new
        if now is not shift:
            shift[rows] = now
        wrenches[rows] = loads
        if not open_rows.any():
            return Deflection(shift, wrenches)
        if not open_rows.all():
            rows, motion = rows[open_rows], motion.take(open_rows)
            now, start = now[open_rows], start[open_rows]
    play = [e.increments(chain, motion, wrenches[rows]) for e in deflected if e.has_play]
    hanging = sum((np.abs(increments).sum(1) for increments in play), np.zeros(len(rows)))
    lost = rows[change[open_rows] > MAX_LAST_CHANGE + HANGING * hanging]
    shift[lost] = wrenches[lost] = np.nan
    return Deflection(shift, wrenches, Outcome.ITERATION_LIMIT if len(lost) else Outcome.CONVERGED)


def _check_loads(robot: Robot, motion: Motion, deflected: Sequence[AbstractEffect]) -> None:
    """Refuse an arm whose moments are unknown."""
    if robot.has_masses:
        if motion.payload is not None:
            motion.need("payload", deflected[0].name)
        return
    unknown = next(j.name for j in robot.moving if j.mass is None)
    remedy = f"{unknown} of robot '{robot.name}' has no mass; add 'mass' [kg] and 'com' [m] to its [[joint]]"
    if all(e.loads is Loads.OWN for e in deflected):
        if motion.torque is not None:
            motion.need("torque", deflected[0].name)
            return
        remedy += ", or the columns torque1[N*m], torque2[N*m] … to the data"
    worst = max(deflected, key=lambda e: e.loads)
    raise DataError(f"effect '{worst.name}' needs the moments of the joints, but {remedy}", found=worst.name)


def _add(out: np.ndarray, places: np.ndarray, effect: AbstractEffect, law: np.ndarray) -> None:
    """Add an effect's increments to its elements' columns."""
    sizes = np.array(effect.coefficients)
    out[:, places] += (law.reshape(-1, len(sizes)) @ sizes).reshape(law.shape[:2])


def _chosen(effects, laws, rows, coefficients) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Laws in the chosen coefficients, as in `Twists`."""
    column = {name: i for i, name in enumerate(coefficients)}
    for i, effect in enumerate(effects):
        mine = [k for k, name in enumerate(effect.names) if name in column]
        if mine:
            law = laws[i] if len(mine) == len(effect.names) else laws[i][:, :, mine]
            yield rows[i], np.array([column[effect.names[k]] for k in mine]), np.ascontiguousarray(law)


def _growth(arm, motion, deflected, columns, rows, size) -> np.ndarray | None:
    """Derivative of changed elements' increments in P constants at fixed wrenches; None if all are 0."""
    parts = [e.growth(arm.chain, motion, deflected.wrenches, columns) for e in arm.effects]
    if all(part is None for part in parts):
        return None
    out = np.zeros((len(motion), size, len(columns)))
    for part, mine in zip(parts, rows, strict=True):
        if part is not None:
            out[:, mine] += part
    return out


def _gain(arm, motion, deflected, rows, size) -> np.ndarray:
    """Derivative of the changed elements' increments in M wrench components."""
    counts = [len(e.components(arm.chain)) for e in arm.effects]
    gain, start = np.zeros((len(motion), size, sum(counts))), 0
    for effect, mine, count in zip(arm.effects, rows, counts, strict=True):
        if count:
            gain[:, mine, start : start + count] = effect.slope(arm.chain, motion, deflected.wrenches)
            start += count
    return gain


def _add_products(left: np.ndarray, right: np.ndarray, places: np.ndarray, out: np.ndarray) -> None:
    """Add left · right, row by row, to the columns of a table with these indices, except negative ones."""
    if places.min(initial=0) < 0:
        places, right = places[places >= 0], right[:, :, places >= 0]
    follow = len(places) and (places[1:] - places[:-1] == 1).all()  # a slice is ten times as fast
    columns = slice(places[0], places[-1] + 1) if follow else places
    out[:, columns] += (left @ right).reshape(len(out), len(places))
