"""Apparent error of a joint, a tilt or a length in every row.

A row's whitened residual r (measured − predicted) is projected on the whitened column J of the increment; the
best size and its standard error are

    a = Jᵀ r / Jᵀ J,      s = σ / |J|

with σ² the residual variance per degree of freedom. With all effects in the model, a is the remaining error;
adding back the effect's own law gives its partial residuals.

Source: Larsen, McCleary, The use of partial residual plots in regression analysis, Technometrics 14(3), 1972.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm import chain as chains
from workbench.arm.effects.plots import DeflectedRows
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import deflect
from workbench.data.dataset import Dataset
from workbench.diagnosis.result import Diagnosis
from workbench.identification.errors.row_errors import instrument_places
from workbench.identification.problem import Problem


@dataclass(frozen=True, eq=False)
class FinalRows:
    """Fitted and held-out rows at the final model.

    Args:
        problems: Nothing free: the fitted rows, then the held-out ones if there are any.
        sigma: Residual standard deviation in stated ones.
    """

    problems: tuple[Problem, ...]
    sigma: float

    @classmethod
    def of(cls, result: Diagnosis) -> "FinalRows":
        fit = result.after_fit
        places = fit.problem.instrument(fit.x)
        held = judged_rows(result)
        parts = [fit.problem.data] + ([held] if len(held) else [])
        problems = tuple(_closed(fit.arm, data, fit.problem, places) for data in parts)
        return cls(problems, float(np.sqrt(fit.variance_factor)))

    @property
    def robot(self) -> Robot:
        """The final model."""
        return self.problems[0].robot

    @cached_property
    def motion(self) -> Motion:
        return Motion.joined([Motion.of(p.data) for p in self.problems])

    @cached_property
    def state(self) -> DeflectedRows:
        """The deflected arm in all rows, for laws of effects."""
        return DeflectedRows(self.robot.chain, self.motion, deflect(self.robot, self.motion).wrenches)

    @cached_property
    def held_out(self) -> Bool[np.ndarray, " rows"]:
        """Rows that took no part in the fit."""
        return np.arange(len(self.motion)) >= len(self.problems[0].data)

    def along(
        self, elements: tuple[str, ...], direction: Float[np.ndarray, "rows e"]
    ) -> tuple[Float[np.ndarray, " rows"], Float[np.ndarray, " rows"]]:
        """Apparent size of an increment in every row, and its standard error; infinite where it is
        unobservable.

        Args:
            elements: Elements of the chain that it changes.
            direction: How much of each per unit of size [rad or m per unit].
        """
        pull, seen = np.zeros(len(self.motion)), np.zeros(len(self.motion))
        start = 0
        for problem in self.problems:
            for block in problem.blocks:
                rows = start + block.rows
                columns, residual = _whitened(block, elements, direction[rows])
                pull[rows], seen[rows] = (columns * residual).sum(1), (columns**2).sum(1)
            start += len(problem.data)
        shows = seen > 0.0
        safe = np.where(shows, seen, 1.0)
        return np.where(shows, pull / safe, 0.0), np.where(shows, self.sigma / np.sqrt(safe), np.inf)


def judged_rows(result: Diagnosis) -> Dataset:
    """Held-out rows of fitted sessions; none from after the events of their session."""
    held, fitted = result.held_out_data, result.after_fit.problem
    if held.is_of_later and result.events:
        return held.take(np.zeros(len(held), bool))
    if held.session is None or not fitted.frames.base_per_session:
        return held
    return held.take(np.isin(held.session, fitted.data.sessions))


def _closed(robot: Robot, data: Dataset, fitted: Problem, places: dict[str, float]) -> Problem:
    """The problem of rows without unknowns."""
    known = instrument_places(robot, data, known=places)
    return Problem.build(robot, data, free=(), noise=fitted.noise, known=known)


def _whitened(block, elements, direction):
    """Whitened column and residual of a block's rows."""
    shift = (
        chains.NO_SHIFT
        if block.deflected is None
        else deflect(block.deflected.robot, block.deflected.motion).shift
    )
    poses, twists = chains.twists(block.chain, block.q, block.chain.indices(elements), shift=shift)
    part = block.observation.linearise(poses, block.known)
    twist = twists @ direction[:, :, None]
    return block.whiten((part.by_twist @ twist)[..., 0]), block.whiten(part.residual)
