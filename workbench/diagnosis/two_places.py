"""Whether positions lie in two places: a reflector in one of two seats, or a frame that was knocked between
rows whose order is lost. No driver explains such errors.

Residuals, in the measuring frame's axes or in the tool's, are a mixture of two normal distributions with one
covariance, found by expectation maximisation, if that is more likely than one by the Bayesian information
criterion.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base.advice import beside
from workbench.identification.fit import Fit

MIN_ROWS, MIN_SHARE = 30, 0.15
"""Minimum number of rows, and their minimum share in either place: fewer are outliers."""
MIN_GAIN = float(np.log(1000.0))
"""Minimum log odds of two places."""
MIN_APART = 2.5
"""Minimum distance of both, in standard deviations of the residuals about them."""
STEPS = 50
"""Number of steps of expectation maximisation."""


@dataclass(frozen=True)
class TwoPlaces:
    """Two places of the measured point.

    Args:
        apart_mm: Their distance [mm].
        axes: Whose axes they keep: `the tool` or `the measuring frame`.
        shares: Shares of the rows in them.
    """

    apart_mm: float
    axes: str
    shares: tuple[float, float]

    @property
    def text(self) -> str:
        """Clause that continues `it`."""
        first, second = (f"{100 * share:.0f} %" for share in self.shares)
        seat = "as of a reflector in one of two seats" if self.axes == "the tool" else "as after a knock"
        return (
            f"lies in two places {self.apart_mm:.2g} mm apart in the axes of {self.axes}, "
            f"{first} and {second} of the rows, {seat}"
        )


@beside("whether there are two places", None)
def two_places(fit: Fit) -> TwoPlaces | None:
    """Two places of what a fit leaves; None if one is as likely."""
    data = fit.problem.data
    if len(data) < MIN_ROWS or len(data.sessions) > 1 or data.position is None:
        return None
    seen = tool_poses(fit.arm.in_session(""), Motion.of(data))
    left = data.position - seen[:, :3, 3]
    if not np.isfinite(left).all():
        return None
    views = {"the tool": np.einsum("rba,rb->ra", seen[:, :3, :3], left), "the measuring frame": left}
    found = {axes: _mixture(table) for axes, table in views.items()}
    axes = max(found, key=lambda a: found[a][0])
    gain, apart, sigmas, share = found[axes]
    if gain < MIN_GAIN or sigmas < MIN_APART or not MIN_SHARE < share < 1.0 - MIN_SHARE:
        return None
    return TwoPlaces(1e3 * apart, axes, (share, 1.0 - share))


def _mixture(table: Float[np.ndarray, "rows 3"]) -> tuple[float, float, float, float]:
    """Log odds of two places, their distance [m] and in standard deviations, and the share of one: the best
    of three starts, along the principal axes."""
    rows, centred = len(table), table - table.mean(0)
    covariance = centred.T @ centred / rows
    single, best = float(np.linalg.slogdet(covariance)[1]), (-np.inf, 0.0, 0.0, 0.0)
    for axis in np.linalg.eigh(covariance)[1].T:
        mine = (centred @ axis > 0.0).astype(float)
        for _ in range(STEPS):
            share = float(np.clip(mine.mean(), 1.0 / rows, 1.0 - 1.0 / rows))
            apart = mine @ centred / (share * rows) - (1.0 - mine) @ centred / ((1.0 - share) * rows)
            within = covariance - share * (1.0 - share) * np.outer(apart, apart) + 1e-18 * np.eye(3)
            along = np.linalg.solve(within, apart)
            lean = centred @ along - (0.5 - share) * float(along @ apart) + np.log(share / (1.0 - share))
            mine = 1.0 / (1.0 + np.exp(-np.clip(lean, -500.0, 500.0)))
        density = np.logaddexp(lean, 0.0) + np.log1p(-share)
        first = centred + share * apart  # about the other place
        square = (first * np.linalg.solve(within, first.T).T).sum(1)
        gain = float((density - 0.5 * square).sum()) - 0.5 * rows * float(np.linalg.slogdet(within)[1])
        gain += 0.5 * rows * (single + 3.0) - 2.0 * np.log(rows)
        best = max(best, (gain, float(np.linalg.norm(apart)), float(np.sqrt(along @ apart)), share))
    return best
