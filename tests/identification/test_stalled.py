"""A search that finds no step downhill: a success at the noise floor, else said on standard error."""

from types import SimpleNamespace

import numpy as np
import pytest

from workbench.base.types import Outcome
from workbench.identification.algorithms.identifier import SearchOutcome
from workbench.identification.algorithms.ols import Ols
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2

NOISE = np.random.default_rng(0).standard_normal(60)


class Kink:
    """One unknown with a kink at the start: the slope promises a descent that no step keeps.

    Args:
        promise: Standard errors by which the answer would move.
    """

    def __init__(self, promise: float):
        self.promise = promise
        self.start, self.units, self.count, self.deviation = np.zeros(1), np.ones(1), 1 + len(NOISE), None

    def residual(self, x):
        return np.array([self.promise + abs(x[0]), *NOISE])

    def evaluate(self, x):
        jacobian = np.zeros((self.count, 1))
        jacobian[0] = 10.0
        return SimpleNamespace(residual=self.residual(x), jacobian=jacobian)


@pytest.mark.parametrize("algorithm", [Ols(), Opt2()])
@pytest.mark.parametrize(("promise", "outcome"), [(0.05, Outcome.CONVERGED), (3.0, Outcome.STALLED)])
def test_a_search_that_stalls_at_the_noise_floor_has_converged(algorithm, promise, outcome):
    assert algorithm.search(Kink(promise)).outcome is outcome


@pytest.mark.parametrize("command", [("identify", "--algorithm", "ols,opt2"), ("diagnose",)])
def test_a_fit_that_did_not_converge_says_so_on_standard_error(command, run, monkeypatch):
    """It ended with status 2 and not a word."""
    assert run("simulate", "--robot", "aria", "--poses", 30, "--out", "d.csv")[0] == 0
    for kind in (Ols, Opt2):
        search = kind.search

        def stalled(self, problem, *, search=search, **options):
            found = search(self, problem, **options)
            return SearchOutcome(found.x, Outcome.STALLED, found.history)

        monkeypatch.setattr(kind, "search", stalled)
    status, out, err = run(command[0], "d.csv", "--robot", "aria", *command[1:])
    assert status == 2
    assert "held out" in out
    (line,) = err.strip().splitlines()
    assert line.startswith("workbench: the fit (")
    assert "did not converge: stalled" in line
