"""Rows that are off are found, and those that are not are left alone."""

import numpy as np
import pytest
from arms import ARMS, MISSEATED, make
from problems import fitted, geometric

import workbench as wb
from workbench.diagnosis.search.rounds import geometry_first
from workbench.identification.rows.outlying_rows import robust_fit, row_sizes, standing_out


def moved(data, rows, by, rng):
    """The data with some positions displaced [m]."""
    away = rng.standard_normal((len(rows), 3))
    data.position.setflags(write=True)
    data.position[rows] += by * away / np.linalg.norm(away, axis=1, keepdims=True)


@pytest.mark.parametrize("arm", ARMS)
def test_misplaced_rows_are_set_apart(arm):
    case = make("misseated", 5, arm)
    stage = geometry_first(geometric(case))
    out = np.flatnonzero(~stage.keep)
    assert set(case.misseated) <= set(out)
    assert len(out) <= len(case.misseated) + 1


def test_a_robust_fit_is_near_that_of_the_good_rows_alone():
    """A twelfth of the rows is off by 20 mm: least squares follow them, the robust fit does not."""
    case, rng = make("none", 8), np.random.default_rng(0)
    clean = fitted(case)
    off = rng.choice(120, 10, replace=False)
    data = case.data.take(np.arange(120))
    moved(data, off, 10 * MISSEATED, rng)
    problem = type(clean.problem).build(case.robot, data, noise=clean.problem.noise)
    pulled = fitted(type(case)(**{**vars(case), "data": data})).x
    robust, sizes = robust_fit(problem, pulled)
    bad, good = (np.abs((x - clean.x) / clean.std).max() for x in (pulled, robust))
    assert good < 4.0
    assert bad > 10 * good
    assert set(off) == set(np.flatnonzero(standing_out(problem, sizes)))


def test_clean_rows_are_called_wrong_no_more_often_than_stated():
    """One row in a hundred arms, at most: in twenty arms of 60 rows none or one."""
    accused = 0
    for seed in range(20):
        fit = fitted(make("none", 100 + seed, "three-parallel", poses=60))
        sizes = row_sizes(fit.problem, fit.x, np.ones(60, bool), fit.factor.root)
        accused += standing_out(fit.problem, sizes).sum()
    assert accused <= 1


def test_stray_rows_that_are_held_out_make_no_arm_doubtful():
    """They multiplied the held-out rms, and a good geometry was said to explain little."""
    case, rng = make("none", 8), np.random.default_rng(1)
    data = case.data.take(np.arange(120))
    clean = wb.diagnose(case.robot, data)
    off = rng.choice(clean.held_out_rows, 3, replace=False)
    moved(data, off, 5 * MISSEATED, rng)
    found = wb.diagnose(case.robot, data)
    assert found.verdict is clean.verdict
    others = found.message.partition("No arm explains held-out rows")[2].partition("the others is ")[2]
    assert float(others.split(" mm")[0]) == pytest.approx(clean.after.held_out.position_mm.mean, rel=0.1)


@pytest.mark.parametrize("count", [20, 40])
def test_a_third_of_the_rows_is_set_apart(count):
    """More than a tenth, then more than a quarter were taken for the tail of real errors, and kept."""
    case, rng = make("none", 8), np.random.default_rng(2)
    data, off = case.data.take(np.arange(120)), rng.choice(120, count, replace=False)
    moved(data, off, 2 * MISSEATED, rng)
    fitted_alone = wb.identify(case.robot, data)
    assert set(fitted_alone.outlying) == set(off) - set(fitted_alone.held_out_rows)
    found = wb.diagnose(case.robot, data) if count == 20 else None
    assert found is None or set(found.outliers) == set(off) & set(found.train_rows)
