"""Evidence and cross-validation from inner products, against the explicit tables they stand for."""

from dataclasses import replace

import numpy as np
import pytest
import scipy
from tables import BAND, EFFECTS, FOLDS, GEOMETRY, ROWS, Table

from workbench.arm.effects import Candidate
from workbench.diagnosis.search import evidence
from workbench.diagnosis.search.evidence import Term, left_by, offer, offers

FREE = tuple(Candidate(e) for e in EFFECTS)
SMOOTH = np.exp(-0.5 * (np.subtract.outer(np.arange(16), np.arange(16)) / 2.0) ** 2) + 1e-3 * np.eye(16)
SHRUNK, SEPARATE = Candidate(BAND, SMOOTH), Candidate(BAND, np.eye(16))
TRUE = {"joint1_cos2": 40.0, "joint2_sin1": 25.0, "joint6_cos4": 6.0, "joint6_sin4": -9.0}
MODELS = {
    "nothing": (),
    "free": (Term(FREE[1]), Term(FREE[3])),
    "shrunk": (Term(SHRUNK, 0.3),),
    "both": (Term(FREE[1]), Term(SHRUNK, 0.3)),
}


def fall(table, model, candidate):
    """Sums of squares without and with a free candidate, by least squares."""
    return table.square(model), table.square((*model, Term(candidate)))


@pytest.mark.parametrize("name", ["nothing", "free"])
@pytest.mark.parametrize("seed", range(3))
def test_free_candidates_are_judged_as_by_least_squares(name, seed):
    table, model = Table(seed, **TRUE), MODELS[name]
    others = [c for c in FREE if all(c is not t.candidate for t in model)]
    left = left_by(table.grams, model)
    freedom = ROWS - GEOMETRY - 2 * len(model)
    assert left.freedom == freedom
    found = offers(left, others)
    assert [o.term.candidate for o in found] == others
    for o in found:
        before, after = fall(table, model, o.term.candidate)
        assert left.square == pytest.approx(before, rel=1e-6)
        gain = 0.5 * freedom * np.log(before / after) - np.log(ROWS)
        assert o.gain == pytest.approx(gain, abs=1e-4)


def restricted(table, model, covariance):
    """Log density of what no fixed column can follow (restricted likelihood), at its likeliest variance."""
    free = [t for t in model if not t.candidate.shrunk]
    beside = scipy.linalg.null_space(np.column_stack([table.geometry, table.of(*free)]).T)
    seen, spread = beside.T @ table.left, beside.T @ covariance @ beside
    variance = seen @ np.linalg.solve(spread, seen) / len(seen)
    return scipy.stats.multivariate_normal(cov=variance * spread).logpdf(seen)


def marginal(table, terms):
    """Covariance of the components, up to the noise's variance, with shrunk coefficients integrated out."""
    out = np.eye(ROWS)
    for term in terms:
        scale = table.scale[[table.names.index(n) for n in term.candidate.names]]
        columns = table.of(term) * scale
        out += columns @ term.candidate.covariance @ columns.T / term.precision
    return out


@pytest.mark.parametrize("name", ["nothing", "free"])
@pytest.mark.parametrize("seed", range(3))
def test_the_evidence_of_shrunk_ones_is_the_restricted_likelihood(name, seed):
    table, model = Table(seed, **TRUE), MODELS[name]
    found = offer(left_by(table.grams, model), SHRUNK)
    with_it = restricted(table, model, marginal(table, [found.term]))
    without = restricted(table, model, np.eye(ROWS))
    assert found.gain == pytest.approx(with_it - without - 0.5 * np.log(ROWS), abs=1e-3)


@pytest.mark.parametrize("seed", range(3))
def test_the_precision_is_the_likeliest(seed):
    table = Table(seed, **TRUE)
    found = offer(left_by(table.grams, ()), SHRUNK).term
    here = restricted(table, (), marginal(table, [found]))
    for factor in (0.4, 2.5):
        other = replace(found, precision=factor * found.precision)
        assert restricted(table, (), marginal(table, [other])) < here + 1e-9


def test_the_evidence_of_a_free_one_beside_shrunk_ones_allows_for_their_spread():
    """Generalised least squares with the shrunk ones' covariance."""
    table, model = Table(1, **TRUE), MODELS["shrunk"]
    found = offer(left_by(table.grams, model), FREE[1])
    inverse = np.linalg.inv(marginal(table, model))
    squares = []
    for design in (table.geometry, np.column_stack([table.geometry, table.of(Term(FREE[1]))])):
        solved = np.linalg.solve(design.T @ inverse @ design, design.T @ inverse @ table.left)
        off = table.left - design @ solved
        squares.append(off @ inverse @ off)
    freedom = ROWS - GEOMETRY
    assert found.gain == pytest.approx(
        0.5 * freedom * np.log(squares[0] / squares[1]) - np.log(ROWS), abs=1e-3
    )


@pytest.mark.parametrize("loose", [1e-7, 1e-2])
@pytest.mark.parametrize("name", MODELS)
def test_folds_are_predicted_as_by_explicit_fits_to_the_others(name, loose):
    table, model = Table(3, loose=loose, **TRUE), MODELS[name]
    squares = [table.square(model, table.fold != f, table.fold == f) for f in range(FOLDS)]
    assert evidence.validated(table.grams, model) == pytest.approx(np.array(squares), rel=1e-5)


@pytest.mark.parametrize("loose", [1e-7, 1e-2])
@pytest.mark.parametrize("name", [m for m in MODELS if m != "nothing"])
def test_coefficients_are_those_of_least_squares_in_their_own_units(name, loose):
    table, model = Table(5, loose=loose, **TRUE), MODELS[name]
    found = evidence.coefficients(table.grams, model)
    for (coefficient, value), scaled in zip(found.items(), table.fitted(model)[GEOMETRY:], strict=True):
        scale = table.scale[table.names.index(coefficient)]
        assert value == pytest.approx(scaled / scale, rel=1e-4, abs=1e-7)


def test_what_no_row_shows_is_not_offered():
    table = Table(7)
    table.columns[:, :2] = table.geometry[:, :2]
    assert [o.term.candidate for o in offers(left_by(table.grams, ()), FREE)] == list(FREE[1:])


def test_what_is_larger_than_credible_is_not_offered():
    """Column units are arbitrary here: 40 of them are found where 30, then 60, are the most."""
    table = Table(4, joint1_cos2=40.0)
    for largest, is_offered in ((60.0, True), (30.0, False)):
        grams = replace(table.grams, maximum=np.where(np.arange(len(table.names)) == 2, largest, np.inf))
        found = {o.term.candidate for o in offers(left_by(grams, ()), FREE)}
        assert (FREE[1] in found) is is_offered


def test_free_coefficients_are_expected_within_what_is_credible():
    """A prior as wide as half the bound: rows of its own in explicit least squares."""
    table, model = Table(5, **TRUE), MODELS["free"]
    largest = np.full(len(table.names), 50.0)
    design = np.column_stack([table.geometry, table.of(*model)])
    prior = np.column_stack([np.zeros((4, GEOMETRY)), np.eye(4) / 25.0])
    target = np.concatenate([table.left, np.zeros(4)])
    by_hand = np.linalg.lstsq(np.vstack([design, prior]), target, rcond=None)[0][GEOMETRY:]
    found = evidence.coefficients(replace(table.grams, maximum=largest), model)
    scales = [table.scale[table.names.index(n)] for n in found]
    assert np.array(list(found.values())) * scales == pytest.approx(by_hand, rel=1e-4)


def test_shrunk_coefficients_scatter_by_no_more_than_is_credible():
    table = Table(0, **TRUE)
    grams = replace(table.grams, maximum=np.full(len(table.names), 0.5))
    names = [table.names.index(n) for n in SHRUNK.names]
    wide, narrow = (offer(left_by(g, ()), SHRUNK).term.precision for g in (table.grams, grams))
    widest = (table.scale[names] ** 2 * np.diag(SMOOTH)).max() / 0.5**2
    assert wide < 0.9 * widest
    assert narrow >= widest * (1.0 - 1e-9)


def test_the_jackknife_of_a_mean_is_its_standard_error():
    values = np.random.default_rng(0).standard_normal(12)
    means = [np.delete(values, k).mean() for k in range(12)]
    assert evidence.jackknifed(means) == pytest.approx(values.std(ddof=1) / np.sqrt(12))


@pytest.mark.parametrize("precision", [1e-6, 0.3, 1e6])
def test_a_term_less_is_as_the_rest_fitted_anew(precision):
    grams = Table(1, joint1_cos2=40.0, joint2_sin1=25.0, joint6_cos4=6.0).grams
    model = (Term(FREE[1]), Term(SEPARATE, precision), Term(FREE[3]))
    for term, own in zip(model, evidence.own_offers(grams, model), strict=True):
        anew = offer(left_by(grams, evidence.drop(model, [term])), term.candidate)
        assert own.gain == pytest.approx(anew.gain, abs=1e-5)
        assert own.term.candidate is term.candidate


def test_what_is_left_is_updated_as_terms_come_and_go():
    grams = Table(1, joint1_cos2=40.0, joint2_sin1=25.0, joint6_cos4=6.0).grams
    model = (Term(FREE[1]), Term(SEPARATE, 0.3), Term(FREE[3]))
    every = np.arange(len(grams.total))
    for k in range(len(model) + 1):
        anew = left_by(grams, model[:k]).inner(every)
        assert evidence.left_of(grams, model[:k]).inner(every) == pytest.approx(anew, abs=1e-6)
    for group in (model[1:2], model[:1], model[:2]):
        rest, found = left_by(grams, evidence.drop(model, group)), evidence.left_without(grams, model, group)
        assert (found.model, found.freedom) == (rest.model, rest.freedom)
        assert found.inner(every) == pytest.approx(rest.inner(every), abs=1e-6)
