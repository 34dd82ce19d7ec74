"""Values shown by the cubes of the region: the chosen field, with unit and colour scale."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.identification_jacobian import Linearisation
from workbench.plate.cubes import CubeMap
from workbench.session.comparison import Comparison
from workbench.session.state import CubeView, Field, Session, Trial

TITLES = {
    Field.REACH: "Reachability",
    Field.INDEX: "Best index O",
    Field.PREDICTED: "Predicted error",
    Field.MEASURED: "Measured error",
    Field.YIELD: "Error of virtual arms",
}
IN_MILLIMETRES = (Field.PREDICTED, Field.MEASURED, Field.YIELD)
UNITS = {Field.REACH: "%", Field.INDEX: ""} | dict.fromkeys(IN_MILLIMETRES, "mm")
FACTORS = {Field.REACH: 100.0, Field.INDEX: 1.0} | dict.fromkeys(IN_MILLIMETRES, 1e3)
LARGER_IS_BETTER = {Field.REACH, Field.INDEX}
CROWDED = 95.0
"""Percentile at which the colour scale of errors ends, so that a few bad cubes don't hide the rest."""


@dataclass(frozen=True, eq=False)
class CubeValues:
    """A number for every cube.

    Args:
        numbers: In SI; NaN where there is none, infinite where nothing bounds it.
        low: Where the colour scale begins.
        high: Where it ends.
    """

    numbers: Float[np.ndarray, " cubes"]
    low: float
    high: float

    @property
    def shares(self) -> Float[np.ndarray, " cubes"]:
        """Place on the colour scale, 0 to 1; NaN where there is no number."""
        return np.clip((self.numbers - self.low) / max(self.high - self.low, 1e-300), 0.0, 1.0)


def values(session: Session) -> CubeValues | None:
    """Numbers of the chosen field; None where there are none (yet)."""
    field, cubes = session.cube_view.field, session.cubes
    region = session.plate.region
    if field is Field.MEASURED:
        if session.comparison is None:
            return None
        return _scaled(measured_errors(session, session.comparison))
    if field is Field.YIELD:
        trial = session.trial
        return None if trial is None or trial.plate.region is not region else _scaled(trial_errors(trial))
    if field is Field.NONE or cubes is None or cubes.region is not region:
        return None
    if field is Field.REACH:
        return CubeValues(cubes.reached / cubes.tried, 0.0, 1.0)
    if field is Field.INDEX:
        return _scaled(cubes.index)
    linearisation = session.score.linearisation
    if linearisation is None:
        return CubeValues(np.where(cubes.reached > 0, np.inf, np.nan), 0.0, 1.0)
    return _predicted(cubes, linearisation)


@lru_cache(maxsize=2)
def _predicted(cubes: CubeMap, linearisation: Linearisation) -> CubeValues:
    """Asked for by the scene and by the panel alike."""
    return _scaled(cubes.errors(linearisation))


def measured_errors(session: Session, comparison: Comparison) -> Float[np.ndarray, " cubes"]:
    """Mean position error of the rows in each cube, of the calibrated arm once there is one [m]."""
    region = session.plate.region
    poses = comparison.nominal if comparison.calibrated is None else comparison.calibrated
    errors = np.linalg.norm(comparison.measured - poses[:, :3, 3], axis=1)
    cell = region.cells(np.nan_to_num(comparison.measured, nan=np.inf))
    use = (cell >= 0) & np.isfinite(errors)
    count = np.bincount(cell[use], minlength=region.cubes)
    total = np.bincount(cell[use], weights=errors[use], minlength=region.cubes)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def trial_errors(trial: Trial) -> Float[np.ndarray, " cubes"]:
    """Root mean square position error of the virtual arms of a trial in each cube [m]."""
    errors = np.full(trial.plate.region.cubes, np.nan)
    errors[trial.found.cells] = trial.found.observed[:, 0]
    return errors


def shown_cubes(session: Session, view: CubeView, numbers: CubeValues) -> Bool[np.ndarray, " cubes"]:
    """Which cubes are shown: in the kept layer, and within the kept part of the scale."""
    shape = session.plate.region.shape
    shares = numbers.shares
    keep = np.isnan(shares) | ((shares >= view.least) & (shares <= view.greatest))
    if view.field in (Field.MEASURED, Field.YIELD) or view.least > 0.0 or view.greatest < 1.0:
        keep &= ~np.isnan(shares)
    if view.cut is not None:
        layer = np.indices(shape)[view.cut].ravel()
        keep &= layer == min(view.layer, shape[view.cut] - 1)
    return keep


def _scaled(numbers: np.ndarray) -> CubeValues:
    finite = numbers[np.isfinite(numbers)]
    if not len(finite):
        return CubeValues(numbers, 0.0, 1.0)
    return CubeValues(numbers, float(finite.min()), float(np.percentile(finite, CROWDED)))
