"""Diagnosis from end to end: geometry, outliers, effects one after the other, verdict, what to measure next."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from workbench.diagnose.catalogue import Catalogue, catalogue
from workbench.diagnose.evidence import Model
from workbench.diagnose.grams import Grams, compress
from workbench.diagnose.outliers import robust_fit, standing_out
from workbench.diagnose.refit import Fitted, refit, with_own_noise
from workbench.diagnose.search import Found, search
from workbench.identify.problem import Noise, Problem
from workbench.measure.dataset import Dataset
from workbench.motion import Motion
from workbench.pipeline.preparation import Cancel, Progress, on_step, prepare
from workbench.robots.robot import Robot

FOLDS = 5
PASSES = 5


def folds_of(data: Dataset, count: int, rng: np.random.Generator) -> np.ndarray:
    """Fold of every row; whole groups."""
    groups = np.arange(len(data)) if data.group is None else np.unique(data.group, return_inverse=True)[1]
    order = rng.permutation(int(groups.max()) + 1)
    return (np.argsort(order) % count)[groups]


def diagnose_raw(robot, data, *, held_out=0.2, seed=0, verbose=False, **kw):
    began = perf_counter()
    ready = prepare(robot, data, held_out=held_out, seed=seed, **kw)
    t1 = perf_counter()
    rng = np.random.default_rng(seed)
    problem = ready.problem
    all_rows = problem.data
    keep = np.ones(len(all_rows), bool)
    fitted = refit(problem, None, ())
    keep = ~standing_out(fitted.problem, robust_fit(fitted.problem, fitted.fit.x), keep)
    fitted = refit(problem, None, (), data=all_rows.take(keep))
    keep, fitted, problem = _settle(problem, None, (), all_rows, keep, fitted)
    before = fitted
    fold = folds_of(all_rows, FOLDS, rng)
    model: Model = ()
    for k in range(PASSES):
        offered = catalogue(robot, Motion.of(fitted.problem.data))
        effects = [c.effect for c in offered.candidates]
        grams = compress(fitted.problem, fitted.fit.x, effects, fold[keep])
        model = _same(model, offered.candidates)
        found = search(grams, offered.candidates, model)
        if verbose:
            print(
                "pass",
                k,
                round(perf_counter() - began, 2),
                [
                    (
                        t.candidate.effect.name,
                        [j + 1 for j in t.candidate.effect.joints],
                        getattr(t.candidate.effect, "order", ""),
                        round(o.gain, 1),
                        round(o.log_p, 1),
                    )
                    for t, o in zip(found.model, found.offers)
                ],
                "distrusted",
                len(found.distrusted),
            )
        changed = _labels(found.model) != _labels(model)
        model = found.model
        if not changed and k > 0:
            break
        fitted = refit(problem, grams, model, data=all_rows.take(keep))
        old = keep
        keep, fitted, problem = _settle(problem, grams, model, all_rows, keep, fitted)
        if not changed and (old == keep).all():
            break
    if verbose:
        print(
            "prepare",
            round(t1 - began, 2),
            "total",
            round(perf_counter() - began, 2),
            "outliers",
            np.flatnonzero(~keep),
        )
    return ready, before, fitted, found, grams, keep, perf_counter() - began


def _labels(model):
    return sorted(
        (
            t.candidate.effect.name,
            t.candidate.effect.joints,
            str(getattr(t.candidate.effect, "order", "")),
            t.candidate.shrunk,
        )
        for t in model
    )


def _same(model, candidates):
    """The model's terms among the candidates of a new pass."""
    out = []
    for t in model:
        for c in candidates:
            if (
                c.effect.name == t.candidate.effect.name
                and c.names == t.candidate.names
                and c.shrunk == t.candidate.shrunk
                and (not c.shrunk or np.array_equal(c.covariance, t.candidate.covariance))
            ):
                out.append(replace(t, candidate=c))
                break
    return tuple(out)


def _settle(problem, grams, model, all_rows, keep, fitted):
    for _ in range(4):
        problem = with_own_noise(fitted, problem)
        whole = refit_problem_on_all(fitted, all_rows, problem)
        out = standing_out(whole, fitted.fit.x, keep, fitted.fit.factor)
        new = ~out
        if (new == keep).all():
            break
        keep = new
        fitted = refit(problem, grams, model, data=all_rows.take(keep))
    fitted = refit(problem, grams, model, data=all_rows.take(keep))
    return keep, fitted, problem


def refit_problem_on_all(fitted, all_rows, problem):
    p = fitted.problem
    return Problem.build(
        p.robot,
        all_rows,
        free=[q.name for q in p.parameters if q.is_geometry],
        frames=p.frames,
        noise=problem.noise,
        effects=[q.name for q in p.parameters if q.is_coefficient],
    )
