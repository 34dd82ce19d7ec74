"""Small problems of virtual arms for the parts of the diagnosis."""

import numpy as np

from workbench.arm.frame import FRAME_PARTS
from workbench.diagnosis.search.refit import refit
from workbench.identification.fit import Fit
from workbench.identification.problem import Problem
from workbench.identification.problem_blocks import FrameFreedom, Noise

STEP = 1e-5
"""Of central differences [rad, m]; so short that no moment changes its sign on the way."""


def geometric(case, *, rows=None, free_frames=False):
    """The geometric problem of a case."""
    data = case.data if rows is None else case.data.take(rows)
    frames = FrameFreedom(base=FRAME_PARTS, tool=FRAME_PARTS) if free_frames else None
    return Problem.build(case.robot, data, noise=Noise(*case.sigma), frames=frames)


def fitted(case, *, rows=None) -> Fit:
    """Its geometry fitted."""
    return refit(geometric(case, rows=rows), None, ())


def with_effects(problem, *effects):
    """The problem with further effects, all of whose coefficients are unknown."""
    robot = problem.robot.with_effects(*problem.robot.effects, *effects)
    return Problem.build(
        robot,
        problem.data,
        free=[p.name for p in problem.parameters if p.is_geometry],
        frames=problem.frames,
        noise=problem.noise,
        effects=[n for e in effects for n in e.names],
    )


def slopes(problem, effects, at=None):
    """Derivative of what is predicted in the coefficients of effects, by central differences."""
    wide = with_effects(problem, *effects)
    x = np.array([(at or {}).get(p.name, p.nominal) for p in wide.parameters])
    columns = []
    for name in (n for e in effects for n in e.names):
        i = wide.names.index(name)
        step = STEP * wide.units[i]
        ahead, behind = x.copy(), x.copy()
        ahead[i], behind[i] = x[i] + step, x[i] - step
        columns.append((wide.residual(behind) - wide.residual(ahead)) / (2.0 * step))
    return np.column_stack(columns)
