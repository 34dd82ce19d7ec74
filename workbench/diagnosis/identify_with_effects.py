"""Identification with a final search for effects, for readings that limit what can be identified."""

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec

import numpy as np
from jaxtyping import Float

from workbench.arm.effects import AbstractEffect
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.diagnosis.search.candidates import catalogue
from workbench.diagnosis.search.gram_matrices import compress
from workbench.diagnosis.search.rounds import folds_of
from workbench.diagnosis.search.stepwise_search import search
from workbench.identification import identify as identification
from workbench.identification.problem import Problem
from workbench.identification.result import Identification

P = ParamSpec("P")


def seek(robot: Robot, problem: Problem, x: Float[np.ndarray, " p"]) -> tuple[AbstractEffect, ...]:
    """Effects that a problem's solution leaves unexplained, without maps over many joints.

    Args:
        robot: The arm without them.
        problem: Geometry, and effects found before.
        x: Its solution.
    """
    data = problem.data
    offered = catalogue(robot, Motion.of(data)).candidates
    free = [c for c in offered if not c.shrunk]
    grams = compress(problem, x, [c.effect for c in free], folds_of(data, np.random.default_rng(0)))
    return tuple(t.candidate.effect for t in search(grams, free).model)


def _seeking(verb: Callable[P, Identification]) -> Callable[P, Identification]:
    """The same, for the effects that are observable in such readings."""

    @wraps(verb)
    def call(*args: P.args, **options: P.kwargs) -> Identification:
        options.setdefault("seek", seek)
        return verb(*args, **options)

    return call


identify = _seeking(identification.identify)
"""`identification.identify`, with effects of the arm that are observable in such readings."""
