"""What the cubes of the region may be coloured by: fields of a number for every cube."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, final

import numpy as np
from jaxtyping import Float

from workbench.arm.linearisation import Linearisation
from workbench.arm.robot import Robot
from workbench.identification.problem_blocks import Noise
from workbench.plate.cube_map import CubeMap
from workbench.plate.plate import Plate
from workbench.session.comparison import Comparison
from workbench.session.live_score import score
from workbench.session.state import PREDICTED_ERROR, Session
from workbench.session.target_state import TargetState

CROWDED = 95.0
"""Percentile at which the colour scale of errors ends, so that a few bad cubes don't hide the rest."""
SMOOTH = 5.0
"""Percentile at which that of predicted errors begins."""
SPANS = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
"""Changes, as shares, at which the scale of a drag may end."""
MAX_SCALE_RATIO = 2.0
"""Maximum ratio of the end of the first plate's scale to that of the present one for which it is kept."""
ROOM = 0.2
"""Share beyond both ends, by which a plate may become better or worse than the first one."""


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

    @classmethod
    def scaled(cls, numbers: Float[np.ndarray, " cubes"]) -> "CubeValues":
        """With a scale from the smallest to nearly the largest number."""
        finite = numbers[np.isfinite(numbers)]
        if not len(finite):
            return cls(numbers, 0.0, 1.0)
        return cls(numbers, float(finite.min()), float(np.percentile(finite, CROWDED)))

    @property
    def shares(self) -> Float[np.ndarray, " cubes"]:
        """Place on the colour scale, 0 to 1; NaN where there is no number."""
        return np.clip((self.numbers - self.low) / max(self.high - self.low, 1e-300), 0.0, 1.0)


class AbstractCubeField(ABC):
    """A number for every cube of the region.

    Attributes:
        name: In commands and journals.
        choice: In the page's list.
        title: Heading of its colour scale.
        meaning: After its choice and a colon, for the list's hint.
        unit: In which its numbers are shown.
        factor: From SI to that unit.
        larger_is_better: Whether large numbers are good.
        is_mapped: Whether its numbers come from the evaluation of the cubes (`session.region.cubes`).
            Cubes without a number are hidden for other fields.
        is_signed: Whether its scale reaches equally far below and above zero.
    """

    name: ClassVar[str]
    choice: ClassVar[str]
    title: ClassVar[str]
    meaning: ClassVar[str]
    unit: ClassVar[str] = "mm"
    factor: ClassVar[float] = 1e3
    larger_is_better: ClassVar[bool] = False
    is_mapped: ClassVar[bool] = False
    is_signed: ClassVar[bool] = False

    @abstractmethod
    def values(self, session: Session) -> CubeValues | None:
        """The numbers; None where there are none (yet)."""

    def inputs(self, session: Session) -> tuple[object, ...]:
        """Records of the session, beside region and cubes, that the numbers depend on."""
        return ()

    def missing(self, session: Session) -> str:
        """Why it can't be shown, and what to do, as one sentence; empty if it can."""
        return ""


@final
class ReachabilityField(AbstractCubeField):
    """Share of the targets' orientations in which the arm reaches the cube's centre."""

    name, choice, title = "reach", "Reachability", "Reachability"
    meaning = "in how many of the targets' orientations the arm reaches the centre"
    unit, factor = "%", 100.0
    larger_is_better = is_mapped = True

    def values(self, session: Session) -> CubeValues | None:
        cubes = cubes_of(session)
        return None if cubes is None else CubeValues(cubes.reached / cubes.tried, 0.0, 1.0)


@final
class BestIndexField(AbstractCubeField):
    """The highest index O of single poses in the cube."""

    name, choice, title = "index", "Best index O", "Best index O"
    meaning = "the highest of them"
    unit, factor = "", 1.0
    larger_is_better = is_mapped = True

    def values(self, session: Session) -> CubeValues | None:
        cubes = cubes_of(session)
        return None if cubes is None else CubeValues.scaled(cubes.index)


@final
class PredictedErrorField(AbstractCubeField):
    """The error after a calibration with the present targets."""

    name, choice = PREDICTED_ERROR, "Predicted error"
    title = "Predicted error after calibration"
    meaning = "after a calibration with these targets"
    is_mapped = True

    def values(self, session: Session) -> CubeValues | None:
        cubes, found = cubes_of(session), session.score.linearisation
        if cubes is None:
            return None
        if found is None:
            return CubeValues(np.where(cubes.reached > 0, np.inf, np.nan), 0.0, 1.0)
        return _predicted(cubes, found, session.history.first_score.linearisation)

    def inputs(self, session: Session) -> tuple[object, ...]:
        return (session.score,)


@final
class PredictedChangeField(AbstractCubeField):
    """How a drag has changed the predicted error: shown during it, and nobody's choice.

    A move of one target changes all errors by some per cent, which a scale for their own spread would hide.
    """

    name, choice, meaning = "change", "", ""
    title = "Change in predicted error during this drag"
    unit, factor = "%", 100.0
    is_mapped = is_signed = True

    def values(self, session: Session) -> CubeValues | None:
        cubes, now = cubes_of(session), PREDICTED.values(session)
        if cubes is None or now is None:
            return None
        begun = session.history.done[-1]
        before = _errors_at(cubes, session.robot, begun.plate, begun.states, session.noise)
        with np.errstate(invalid="ignore"):
            shares = now.numbers / before - 1.0
        finite = np.abs(shares[np.isfinite(shares)])
        wanted = float(np.percentile(finite, CROWDED)) if len(finite) else 0.0
        span = next((s for s in SPANS if s >= wanted), SPANS[-1])
        return CubeValues(shares, -span, span)


@final
class MeasuredErrorField(AbstractCubeField):
    """The mean error of the rows in the cube."""

    name, choice, title = "measured", "Measured error", "Measured error"
    meaning = "mean of the measured poses, of the calibrated arm if there is one"

    def values(self, session: Session) -> CubeValues | None:
        found = session.results.comparison
        return None if found is None else CubeValues.scaled(measured_errors(session, found))

    def inputs(self, session: Session) -> tuple[object, ...]:
        return (session.results.comparison,)

    def missing(self, session: Session) -> str:
        if session.measurements.loaded is None:
            return "there are no measurements yet; load a file or measure a virtual arm first"
        return ""


PREDICTED, MEASURED, CHANGE = PredictedErrorField(), MeasuredErrorField(), PredictedChangeField()
CUBE_FIELDS: dict[str, AbstractCubeField] = {
    field.name: field for field in (ReachabilityField(), BestIndexField(), PREDICTED, MEASURED)
}
"""What cubes can be coloured by."""


def cubes_of(session: Session) -> CubeMap | None:
    """The cubes' evaluation; None until that of the present region is there."""
    cubes = session.region.cubes
    return None if cubes is None or cubes.region is not session.plate.region else cubes


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


@lru_cache(maxsize=1)
def _errors_at(
    cubes: CubeMap, robot: Robot, plate: Plate, states: tuple[TargetState, ...], noise: Noise
) -> Float[np.ndarray, " cubes"]:
    """Predicted errors where the targets stood [m]."""
    found = score(robot, plate, states, noise=noise, region_q=np.zeros((0, robot.dof))).linearisation
    return np.where(cubes.reached > 0, np.inf, np.nan) if found is None else cubes.errors(found)


@lru_cache(maxsize=2)
def _predicted(cubes: CubeMap, now: Linearisation, first: Linearisation | None) -> CubeValues:
    """On the scale of the first plate, so that one sees what a target's move makes better or worse.

    On its own where that one was far worse: all would have one colour.
    """
    errors = cubes.errors(now)
    scale, own = None if first is None else _scale_of(cubes, first), _ends(errors)
    if scale is None or (own is not None and scale[1] > MAX_SCALE_RATIO * own[1]):
        scale = own
    return CubeValues(errors, *(scale or (0.0, 1.0)))


@lru_cache(maxsize=2)
def _scale_of(cubes: CubeMap, first: Linearisation) -> tuple[float, float] | None:
    return _ends(cubes.errors(first))


def _ends(errors: Float[np.ndarray, " cubes"]) -> tuple[float, float] | None:
    """Ends of a scale about a plate's errors, of two digits [m]; None where nothing bounds any of them."""
    finite = errors[np.isfinite(errors)]
    if not finite.any():
        return None
    low, high = np.percentile(finite, (SMOOTH, CROWDED)) * (1.0 - ROOM, 1.0 + ROOM)
    return float(f"{low:.2g}"), float(f"{high:.2g}")
