"""Joint nonlinear fit of geometry and accepted effects."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy import linalg

from workbench.arm.robot import Robot
from workbench.base.progress import cancelled
from workbench.base.types import Outcome
from workbench.data.dataset import Dataset
from workbench.diagnosis.search.backlash_flanks import search_flanks
from workbench.diagnosis.search.evidence import Model, coefficients, precision_of, solve, solver_of
from workbench.diagnosis.search.gram_matrices import Grams
from workbench.identification import noise as noises
from workbench.identification.algorithms.identifier import SearchOutcome, ended
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.column_products import inner_products
from workbench.identification.errors.expected_deviation import expected_deviation
from workbench.identification.fit import Fit
from workbench.identification.joint_reading_noise import with_joint_readings
from workbench.identification.problem import Problem
from workbench.identification.undetermined_combinations import factorise

MAX_STEPS = 60
"""Maximum number of steps of a fit …"""
MAX_LAST_STEPS = 600
"""… and of the final one: with balls in sockets, rotations of the base are weakly observable."""
STEP_LENGTHS = (1.0, 0.3, 0.1)
"""Step lengths that are tried."""
MAX_CHORD_STEPS = 6
"""Maximum number of steps with the same Hessian."""
CONSTANT_SIGMA = 0.05
"""Prior standard deviation [rad, m] of a constant about nominal: nearly confounded constants, such as offsets
of neighbouring parallel axes, would otherwise drift together and be compensated by effects."""
NULL_SPACE_SIGMA = 1e-3
"""Prior standard deviation [rad, m] along null-space directions of the geometry when loads act: otherwise
unobservable frames would drift with the masses to fit inaccuracies of an effect's law."""
MIN_CONSTANTS_SHARE = 1e-3
"""Minimum share of the arm's constants in such a direction."""
FLAT = 1e-4
"""Share of a law's prior precision that is kept to estimate its size: it would be pulled towards zero, and
masses would make up for it."""
DAMPING = 1e-14
"""First damping of a fit: it begins where the linear solution expects its end, and more would hold weakly
observable directions back."""
STEP_TOLERANCE = 1e-3
"""Fits but the final one end when the predicted step is below this many standard errors of an unknown."""


def refit(
    problem: Problem,
    grams: Grams | None,
    model: Model,
    *,
    data: Dataset | None = None,
    starts: Sequence[Mapping[str, float]] = ({},),
    holds: bool = False,
    is_final: bool = False,
) -> Fit:
    """Fit geometry and a model's effects, with the noise estimated from the residuals.

    Args:
        problem: The geometric problem, whose noise weighs positions against rotations.
        grams: Inner products to which the model's precisions refer; None for no effects.
        model: Accepted effects.
        data: Rows instead of the problem's.
        starts: Initial values from an earlier fit [SI], the nearest are taken: a large deflection may have no
            equilibrium where it was expected, last; other unknowns start at nominal.
        holds: Whether constants that are unobservable for a rigid arm are held near nominal if masses are
            unknown.
        is_final: Whether it may take more steps, constants are expected as near nominal as the rows with
            these effects show, and sizes of laws are estimated without the prior about zero by which they
            were selected.
    """
    own = problem.robot.effects
    robot = problem.robot.with_effects(*own, *(t.candidate.effect for t in model))
    names = [n for t in model for n in t.candidate.names]
    built = problem.again(robot=robot, data=data, effects=names, inertia=needs_inertia(robot))
    if grams is not None and model:
        built = _expected(built, grams, model, FLAT if is_final else 1.0)
    built = built.with_deviation(CONSTANT_SIGMA)
    if is_final and built.geometry.any():
        found, spread = expected_deviation(built, built.at(starts[-1]))
        built = built.with_deviation(min(found / spread, CONSTANT_SIGMA))
    here, free = built.at(starts[-1]), built
    if len(starts) > 1:
        here = min(map(built.at, starts), key=lambda x: np.square(free.residual(x)).sum())
    if holds and any(p.unit == "kg" for p in built.parameters):
        rigid = problem.again(robot=problem.robot.with_effects()) if own else problem
        built = _held(built, rigid, starts[-1])
    algorithm, held = Opt2(limit=MAX_LAST_STEPS, damping=DAMPING), built
    if not is_final:
        algorithm = replace(algorithm, limit=MAX_STEPS, tolerance=STEP_TOLERANCE * len(built.names) ** 0.5)
    if grams is not None and large(built):
        search = _chord(built, here, grams)
    else:
        built, search = search_flanks(algorithm, built, here)
    if built is held:  # unobservable combinations are reported without that prior
        built = free
    return Fit(algorithm=algorithm, problem=built, search=search)


def needs_inertia(robot: Robot) -> bool:
    """Whether an arm's effects depend on the accuracy of its masses."""
    return robot.has_masses and any(e.loads for e in robot.effects)


def large(problem: Problem) -> bool:
    """Whether fits of a problem are slow, so that few are made."""
    return problem.size * len(problem.names) ** 2 > noises.MAX_QUICK_PRODUCTS


def linear_answer(fit: Fit, grams: Grams, model: Model) -> dict[str, float]:
    """Unknowns of another model from the linear solution at a fit, by name [SI]."""
    problem, x = fit.problem, fit.x
    step = grams.basis @ solve(grams, model)[: grams.geometry]
    plain = [p.name for p in problem.parameters if p.is_plain]
    known = {p.name: v for p, v in zip(problem.parameters, x.tolist(), strict=True) if not p.is_coefficient}
    moved = {name: known[name] + change for name, change in zip(plain, step.tolist(), strict=True)}
    return known | moved | coefficients(grams, model)


def with_own_noise(fit: Fit, problem: Problem) -> Problem:
    """The geometric problem, weighted by a fit's residuals in addition to the stated noise."""
    left = with_joint_readings(fit.problem, fit.x, fit.factor)
    return problem if left is None else problem.with_noise(left)


def robot_with(fit: Fit, grams: Grams, model: Model) -> Robot:
    """The arm with another model instead of a fit's own, from the linear solution at that fit."""
    answer, problem = linear_answer(fit, grams, model), fit.problem
    arm = problem.robot_at(np.array([answer.get(name, 0.0) for name in problem.names]))
    gone = {p.name for p in problem.parameters if p.is_coefficient}
    own = [e for e in arm.effects if not gone & set(e.names)]
    return arm.with_effects(*own, *(t.candidate.effect.sized(answer) for t in model))


def _chord(problem: Problem, x: Float[np.ndarray, " p"], grams: Grams) -> SearchOutcome:
    """Gauss–Newton with a fixed Hessian, that of the geometry as in the inner products: only the gradient is
    recomputed."""
    curvature = inner_products(problem, x)[:-1, :-1]
    plain = np.flatnonzero([p.is_plain for p in problem.parameters])
    curvature[plain, plain] += np.broadcast_to(grams.reach, len(plain)) ** -2.0
    solve_for = solver_of(curvature)
    cost, gradient = problem.cost_and_gradient(x)
    history = [cost]
    if not np.isfinite(cost):
        return SearchOutcome(x, Outcome.DIVERGED, tuple(history))
    for _ in range(MAX_CHORD_STEPS):
        step = -solve_for(gradient)
        if np.sqrt(step @ curvature @ step / len(step)) < STEP_TOLERANCE:
            return SearchOutcome(x, Outcome.CONVERGED, tuple(history))
        if cancelled():
            return SearchOutcome(x, Outcome.CANCELLED, tuple(history))
        trials = (x + shorter * step for shorter in STEP_LENGTHS)
        if (new := next((y for y in trials if 0.5 * (problem.residual(y) ** 2).sum() < cost), None)) is None:
            promised = -float(step @ gradient)
            return SearchOutcome(x, ended(promised, history, problem.count), tuple(history))
        x, (cost, gradient) = new, problem.cost_and_gradient(new)
        history.append(cost)
    return SearchOutcome(x, Outcome.CONVERGED, tuple(history))


def _held(problem: Problem, rigid: Problem, begin: Mapping[str, float]) -> Problem:
    """The problem with a prior about nominal along directions that don't change the poses of a rigid arm:
    base and tool compensate them."""
    plain = np.array([p.is_plain for p in rigid.parameters], bool)
    parts = [piece for _, piece in rigid.pieces(rigid.at(begin), only=plain)]
    residual, jacobian = (np.concatenate(part) for part in zip(*parts, strict=True))
    seen = factorise([(residual, jacobian)], np.ones(jacobian.shape[1])).root
    unseen = np.linalg.qr(seen, mode="complete")[0][:, seen.shape[1] :]
    constants = np.array([p.is_geometry for p in rigid.parameters if p.is_plain], bool)
    _, size, directions = np.linalg.svd(unseen[constants].T, full_matrices=False)
    held = directions[size > MIN_CONSTANTS_SHARE]
    if not len(held):
        return problem
    names = [p.name for p in rigid.parameters if p.is_geometry]
    centre = problem.prior_centre
    at = dict(zip(problem.names, centre.tolist(), strict=True))
    return problem.with_prior(names, np.array([at[n] for n in names]), held / NULL_SPACE_SIGMA)


def _expected(problem: Problem, grams: Grams, model: Model, share: float) -> Problem:
    """The problem with the coefficients' prior variances about zero; laws with a share of that precision."""
    names = [n for t in model for n in t.candidate.names]
    blocks = []
    for term in model:
        scale = grams.scales(term.candidate.names)
        is_law = not term.candidate.shrunk or term.candidate.alike
        precision = (share if is_law else 1.0) * precision_of(grams, term) * np.outer(scale, scale)
        blocks.append(np.linalg.cholesky(precision).T)
    return problem.with_prior(names, np.zeros(len(names)), linalg.block_diag(*blocks))
