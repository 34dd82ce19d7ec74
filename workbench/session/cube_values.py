"""Values shown by the cubes of the region: the chosen field, with unit and colour scale."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.linearisation import Linearisation
from workbench.arm.robot import Robot
from workbench.identification.problem_blocks import Noise
from workbench.plate.cube_map import CubeMap
from workbench.plate.plate import Plate
from workbench.session.comparison import Comparison
from workbench.session.live_score import PlateTrial, score
from workbench.session.state import CubeView, Field, Focus, Session
from workbench.session.target_state import TargetState

TITLES = {
    Field.REACH: "Reachability",
    Field.INDEX: "Best index O",
    Field.PREDICTED: "Predicted error after calibration",
    Field.MEASURED: "Measured error",
    Field.YIELD: "Error of virtual arms",
    Field.CHANGE: "Change in predicted error during this drag",
}
IN_MILLIMETRES = (Field.PREDICTED, Field.MEASURED, Field.YIELD)
UNITS = {Field.REACH: "%", Field.INDEX: "", Field.CHANGE: "%"} | dict.fromkeys(IN_MILLIMETRES, "mm")
FACTORS = {Field.REACH: 100.0, Field.INDEX: 1.0, Field.CHANGE: 100.0} | dict.fromkeys(IN_MILLIMETRES, 1e3)
LARGER_IS_BETTER = {Field.REACH, Field.INDEX}
CROWDED = 95.0
"""Percentile at which the colour scale of errors ends, so that a few bad cubes don't hide the rest."""
SMOOTH = 5.0
"""Percentile at which that of predicted errors begins."""
BELOW = 0.03
"""How far below a target without a plate the cubes are shown [m]."""
SPANS = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
"""Changes, as shares, that the scale of a drag may end at."""
FAR = 2.0
"""How many times greater the end of the first plate's scale is of which the present one makes no use."""
ROOM = 0.2
"""Share beyond both, in which a plate may get better or worse than the first one was."""


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
    field, cubes = session.region.view.field, session.region.cubes
    region = session.plate.region
    if field is Field.MEASURED:
        if session.results.comparison is None:
            return None
        return _scaled(measured_errors(session, session.results.comparison))
    if field is Field.YIELD:
        trial = session.part(PlateTrial)
        return None if trial is None or trial.plate.region is not region else _scaled(trial.errors)
    if field is Field.NONE or cubes is None or cubes.region is not region:
        return None
    if field is Field.REACH:
        return CubeValues(cubes.reached / cubes.tried, 0.0, 1.0)
    if field is Field.INDEX:
        return _scaled(cubes.index)
    linearisation = session.score.linearisation
    if linearisation is None:
        return CubeValues(np.where(cubes.reached > 0, np.inf, np.nan), 0.0, 1.0)
    return _predicted(cubes, linearisation, session.history.first_score.linearisation)


def drawn(session: Session) -> tuple[Field, CubeValues | None]:
    """What the cubes are coloured by: while a target is dragged, how its move changes the predicted error.

    A move of one target changes all errors by some per cent, which a scale for their own spread would hide.
    """
    field, numbers, cubes = session.region.view.field, values(session), session.region.cubes
    if field is not Field.PREDICTED or session.drag is None or numbers is None or cubes is None:
        return field, numbers
    begun = session.history.done[-1]
    before = _errors_at(cubes, session.robot, begun.plate, begun.states, session.noise)
    with np.errstate(invalid="ignore"):
        shares = numbers.numbers / before - 1.0
    finite = np.abs(shares[np.isfinite(shares)])
    wanted = float(np.percentile(finite, CROWDED)) if len(finite) else 0.0
    span = next((s for s in SPANS if s >= wanted), SPANS[-1])
    return Field.CHANGE, CubeValues(shares, -span, span)


@lru_cache(maxsize=1)
def _errors_at(
    cubes: CubeMap, robot: Robot, plate: Plate, states: tuple[TargetState, ...], noise: Noise
) -> Float[np.ndarray, " cubes"]:
    """Predicted errors where the targets stood [m]."""
    found = score(robot, plate, states, noise=noise, region_q=np.zeros((0, robot.dof))).linearisation
    return np.where(cubes.reached > 0, np.inf, np.nan) if found is None else cubes.errors(found)


def are_shown(session: Session) -> bool:
    """Whether the scene has cubes; nobody asked for those that are there at first."""
    view = session.region.view
    return view.field is not Field.NONE and (view.is_chosen or session.playback.focus is Focus.TARGET)


@lru_cache(maxsize=2)
def _predicted(cubes: CubeMap, now: Linearisation, first: Linearisation | None) -> CubeValues:
    """On the scale of the first plate, so that one sees what a target's move makes better or worse.

    On its own where that one was far worse: all would have one colour.
    """
    errors = cubes.errors(now)
    scale, own = None if first is None else _scale_of(cubes, first), _ends(errors)
    if scale is None or (own is not None and scale[1] > FAR * own[1]):
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


def shown_cubes(session: Session, view: CubeView, numbers: CubeValues) -> Bool[np.ndarray, " cubes"]:
    """Which cubes are shown: in the kept layer, and within the kept part of the scale."""
    shape = session.plate.region.shape
    shares = numbers.shares
    keep = np.isnan(shares) | ((shares >= view.low) & (shares <= view.high))
    if view.field in (Field.MEASURED, Field.YIELD) or view.low > 0.0 or view.high < 1.0:
        keep &= ~np.isnan(shares)
    if view.cut is not None:
        keep &= np.indices(shape)[view.cut].ravel() == shown_layer(session)
    return keep


def shown_layer(session: Session) -> int:
    """Which layer across the cut is shown: the chosen one, or that of the plate's surface."""
    view, region = session.region.view, session.plate.region
    axis = 2 if view.cut is None else view.cut
    layer = view.layer
    if not view.is_chosen:
        layer = int((plate_surface(session.plate) - region.min[2]) // (region.size[2] / region.shape[2]))
    return int(np.clip(layer, 0, region.shape[axis] - 1))


def plate_surface(plate: Plate) -> float:
    """Height of what blocks stand on [m]; without a plate, a little below the lowest target."""
    lowest = min(float(target.xyz[2]) for target in plate.targets) - BELOW
    return lowest if plate.size is None else float(plate.pose[2, 3])


def _scaled(numbers: np.ndarray) -> CubeValues:
    finite = numbers[np.isfinite(numbers)]
    if not len(finite):
        return CubeValues(numbers, 0.0, 1.0)
    return CubeValues(numbers, float(finite.min()), float(np.percentile(finite, CROWDED)))
