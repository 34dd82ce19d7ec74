"""Rows compressed to inner products, against explicit columns by finite differences of the residual."""

import numpy as np
import pytest
from arms import ARMS, make
from problems import fitted, geometric, slopes

from workbench.arm import effects as kinds
from workbench.arm.effects import Candidate
from workbench.diagnosis.search.evidence import Term
from workbench.diagnosis.search.gram_matrices import compress
from workbench.diagnosis.search.refit import refit

EXACT, APPROXIMATE = 1e-4, 0.01
"""Of a column's length: for an arm that nothing bends, and where the moments would be deflected once more."""
ROWS = np.arange(40)
FOLD = np.arange(40) % 4
BAND = kinds.JointHarmonic((3,), order=(1, 2, 3))
EFFECTS = (
    kinds.JointCompliance((1,)),
    kinds.JointCompliance((2,)),
    kinds.Backlash((1,)),
    kinds.Backlash((0,), by="motion"),
    kinds.ClearanceTilt((1,)),
    kinds.BearingCompliance((0,)),
    kinds.LinkFlexure((1,)),
    kinds.JointHarmonic((4,), order=2),
    BAND,
    kinds.EncoderScale((0,)),
    kinds.JointCoupling((2, 1)),
    kinds.ThermalGrowth(),
    kinds.BaseDrift(),
    kinds.LocalJointError((0,), knots=(-7.0, -3.0, 0.0, 3.0, 7.0)),
)
NAMES = [n for e in EFFECTS for n in e.names]


def table_of(grams, geometry, columns, left):
    """Explicit columns in the order and scaling of the inner products."""
    by_name = dict(zip(NAMES, columns.T, strict=True))
    effects = np.column_stack([by_name[n] for n in grams.names]) / grams.scale
    return np.column_stack([geometry @ grams.basis, effects, left])


def close(found, expected):
    """Cosines of unit columns; those with the residual relative to its length."""
    size = np.sqrt(np.maximum(np.diagonal(expected), 1e-12))
    return np.abs((found - expected) / np.outer(size, size)).max()


@pytest.mark.parametrize("arm", ARMS)
def test_inner_products_are_those_of_explicit_columns(arm):
    fit = fitted(make("none", 3, arm), rows=ROWS)
    problem, x = fit.problem, fit.x
    grams = compress(problem, x, EFFECTS, FOLD)
    at = dict(zip(problem.names, x.tolist(), strict=True))
    rows = slice(problem.size)
    columns = slopes(problem, EFFECTS, at)
    table = table_of(grams, problem.evaluate(x).jacobian[rows], columns, problem.residual(x)[rows])
    assert set(grams.names) == set(NAMES)
    labels = FOLD[problem.component_rows]
    for f in range(4):
        mine = table[labels == f]
        assert close(grams.folds[f], mine.T @ mine) < 2 * EXACT
    lengths = np.diagonal(grams.total)
    assert lengths[: grams.geometry] == pytest.approx(np.ones(grams.geometry), abs=1e-8)
    shown = np.linalg.norm(table[:, grams.geometry : -1], axis=0)
    assert shown == pytest.approx(np.ones(len(NAMES)), abs=EXACT)
    assert grams.count == problem.size == 240


def test_geometric_directions_span_what_the_rows_show():
    """With base and tool free not all unknowns are seen: as many directions as the Jacobian has rank."""
    case = make("none", 1)
    problem = geometric(case, rows=ROWS, free_frames=True)
    grams = compress(problem, problem.start, (kinds.JointCompliance((1,)),), FOLD)
    jacobian = problem.evaluate(problem.start).jacobian
    rank = np.linalg.matrix_rank(jacobian / np.linalg.norm(jacobian, axis=0), tol=1e-7)
    assert grams.geometry == rank < len(problem.names)
    unseen = jacobian @ grams.basis
    assert unseen.T @ unseen == pytest.approx(np.eye(rank), abs=1e-7)


def test_accepted_effects_are_given_back_to_the_residual():
    """At the fit of a soft joint the residual is what is left and what the joint's column explains."""
    case = make("compliance", 0)
    fit = fitted(case, rows=ROWS)
    soft = case.hidden[0].joints
    candidate = Candidate(kinds.JointCompliance(soft))
    first = compress(fit.problem, fit.x, [candidate.effect], FOLD)
    deflected = refit(fit.problem, first, (Term(candidate),))
    problem, x = deflected.problem, deflected.x
    grams = compress(problem, x, [candidate.effect, kinds.EncoderScale((0,))], FOLD)
    (name,) = candidate.names
    i = problem.names.index(name)
    own = problem.evaluate(x).jacobian[: problem.size][:, i]
    left = problem.residual(x)[: problem.size] + x[i] * own
    assert grams.total[-1, -1] == pytest.approx(left @ left, rel=2 * APPROXIMATE)
    along = grams.total[grams.index[name], -1] * grams.scale[grams.names.index(name)]
    assert along == pytest.approx(own @ left, rel=2 * APPROXIMATE)
    stiff = problem.residual(x)[: problem.size]
    assert left @ left > 10.0 * (stiff @ stiff)


def test_effects_of_several_elements_alone_have_their_own_inner_products():
    """No law acts on one element only, so that no column is a product."""
    fit = fitted(make("none", 3), rows=ROWS)
    problem, x = fit.problem, fit.x
    soft = kinds.JointCompliance((1, 2))
    grams = compress(problem, x, [soft], FOLD)
    columns = slopes(problem, [soft], dict(zip(problem.names, x.tolist(), strict=True))) / grams.scale
    residual, jacobian = (part[: problem.size] for part in problem.evaluate(x))
    table = np.column_stack([jacobian @ grams.basis, columns, residual])
    assert close(grams.total, table.T @ table) < 2 * EXACT
