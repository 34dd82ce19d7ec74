"""OPT2: Levenberg–Marquardt, the counterpart of the paper's `lsqnonlin` (ARIA 4.1.3).

Minimises ½|r(x)|² with the step (JᵀJ + λ I)⁻¹ Jᵀr, in natural units; λ follows the ratio of the actual to the
predicted decrease. One factorisation serves all λ of an iteration.

Source: Nielsen, Damping parameter in Marquardt's method, IMM-REP-1999-05 (the update of λ).
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.identification.algorithms.identifier import (
    STEP_TOLERANCE,
    AbstractIdentifier,
    SearchOutcome,
    descend,
    gauge_step,
)
from workbench.identification.problem import Problem


@final
@dataclass(frozen=True)
class Opt2(AbstractIdentifier):
    """Levenberg–Marquardt.

    Args:
        limit: Maximum number of accepted steps.
        rejections: Maximum number of rejected steps in a row.
        damping: First λ, relative to the largest squared singular value of the whitened Jacobian.
        tolerance: Predicted step at which it ends [standard errors].
    """

    limit: int = 200
    rejections: int = 30
    damping: float = 1e-8
    tolerance: float = STEP_TOLERANCE
    name = "opt2"
    title = "OPT2"
    summary = "Levenberg–Marquardt least squares: converges from farther away."

    def search(self, problem: Problem, *, begin: Float[np.ndarray, " p"] | None = None) -> SearchOutcome:
        damping: float | None = None

        def damped(x, at, factor, cost):
            nonlocal damping
            damping, growth = damping or self.damping * np.linalg.svd(factor.r, compute_uv=False)[0] ** 2, 2.0
            for rejected in range(self.rejections):
                step = factor.step(damping)
                promised = factor.predicted_decrease(step)
                step = gauge_step(factor, step, x - problem.start)
                # the first trial is usually accepted, so its Jacobian is computed at once
                trial = None if rejected else problem.evaluate(x + step)
                residual = problem.residual(x + step) if trial is None else trial.residual
                less = 0.5 * float(residual @ residual)
                gain = 2.0 * (cost - less) / promised if promised > 0 else -1.0
                if np.isfinite(less) and gain > 0:
                    damping *= max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3) if gain < 0.9 else 0.1
                    return x + step, less, trial or problem.evaluate(x + step)
                damping, growth = damping * growth, growth * 2.0
            return None

        return descend(problem, damped, limit=self.limit, begin=begin, tolerance=self.tolerance)
