"""The score of a set of targets: how well measurements at them would determine the robot's parameters.

Errors are predicted for poses of the region about the orientations of the plate as it was loaded: of that
plate the same number as `plate score` says, of a changed one that of `plate compare` with it.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from workbench.arm.linearisation import Linearisation
from workbench.arm.robot import Robot
from workbench.base.errors import DataError
from workbench.base.types import frozen
from workbench.data.accuracy_requirement import Wanted
from workbench.identification.problem_blocks import Noise
from workbench.plate.free_constants import identified_names, visible, visible_basis, visible_weight
from workbench.plate.observability import INDICES, O, evaluate
from workbench.plate.plate import Plate
from workbench.plate.predicted_error import position_weight, predicted_error, rise_without_each
from workbench.plate.region_poses import plate_region_poses
from workbench.plate.target_readings import linearise_targets
from workbench.session.part import AbstractPart
from workbench.session.target_state import Score, TargetState

WORST = 3
"""How many of the worst-determined parameters are named."""
UNDETERMINED = 1e-6
"""Share of a parameter in the unidentifiable combinations above which it counts as open."""


def score(
    robot: Robot,
    plate: Plate,
    states: tuple[TargetState, ...],
    *,
    noise: Noise,
    region_q: Float[np.ndarray, "poses n"],
) -> Score:
    """Indices and predicted error of the measurable targets, each measured once.

    Args:
        robot: Nominal geometry.
        plate: Whose targets they are.
        states: How the arm stands at every target.
        noise: The instrument; the production of the plate comes on top.
        region_q: Poses for which the error is predicted [rad or m]; without any it stays unknown.
    """
    names = identified_names(robot)
    used = [i for i, state in enumerate(states) if state.measurable]
    per_target, rises = np.full(len(states), np.nan), np.full(len(states), np.nan)
    if not used:
        nothing = dict.fromkeys(INDICES, 0.0)
        return Score(frozen(per_target), nothing, 0, 0, len(names), np.inf, np.inf, np.inf, frozen(rises))
    linearisation = linearise_targets(
        robot,
        plate,
        np.stack([states[i].q for i in used]),
        slots=np.array(used),
        names=names,
        sigma=(noise.position, noise.rotation),
    )
    per_target[used] = O().per_pose(linearisation)
    basis = _visible_basis(robot, names)
    seen = visible(linearisation, basis)
    expected = predicted_error(linearisation, robot, region_q) if len(region_q) else None
    if expected is not None:
        scale = None if basis is None else linearisation.weights
        weight = visible_weight(position_weight(robot, region_q, names, scale), basis)
        rises[used] = rise_without_each(seen, weight)
    return Score(
        per_target=frozen(per_target),
        indices=evaluate(seen) | {"O": evaluate(linearisation)["O"]},
        measurable=len(used),
        rank=seen.rank(),
        parameters=len(seen.names),
        condition=seen.condition,
        position=np.nan if expected is None else expected.position_rms,
        rotation=np.nan if expected is None else expected.rotation_rms,
        rises=frozen(rises),
        worst=worst_determined(linearisation),
        linearisation=linearisation,
    )


@lru_cache(maxsize=4)
def _visible_basis(robot: Robot, names: tuple[str, ...]) -> Float[np.ndarray, "p r"] | None:
    """As `visible_basis`; kept, since a drag asks for it again and again."""
    return visible_basis(robot, names)


def worst_determined(linearisation: Linearisation) -> tuple[tuple[str, float, str], ...]:
    """Parameters with the largest standard error, angles as arcs at the arm's reach; open ones first."""
    errors = np.sqrt(np.diag(linearisation.covariance))
    open_ = (linearisation.unidentifiable**2).sum(1) > UNDETERMINED
    errors = np.where(open_, np.inf, errors)
    worst = np.argsort(-errors / linearisation.weights, kind="stable")[:WORST]
    return tuple((linearisation.names[i], float(errors[i]), linearisation.units[i]) for i in worst)


def draw_region(robot: Robot, plate: Plate) -> Float[np.ndarray, "poses n"]:
    """Poses that matter, those of `plate score`; none if the region is out of reach."""
    try:
        return plate_region_poses(robot, plate)
    except DataError:
        return frozen(np.zeros((0, robot.dof)))


@dataclass(frozen=True, eq=False)
class PlateTrial(AbstractPart):
    """A plate tried on a production of virtual arms.

    Args:
        plate: The plate as it was then.
        noise: The instrument of that time.
        wanted: What every arm had to keep.
        arms: How many were tried.
        share: Of them kept it everywhere.
        unreached: Arms that could not reach every target.
        used: What 95 % of the arms keep everywhere, as a share of what they had to.
        position: Root mean square position error of all arms [m].
        text: All that in one sentence.
        blame: The source of most of the error; empty if nothing goes wrong.
    """

    plate: Plate
    noise: Noise
    wanted: Wanted | None
    arms: int
    share: float
    unreached: int
    used: float
    position: float
    text: str
    blame: str = ""
