"""The score of a set of targets: how well measurements at them would determine the robot's parameters.

Errors are predicted for poses of the region about the orientations of the plate as it was loaded: of that
plate the same number as `plate score` says, of a changed one that of `plate compare` with it.
"""

import numpy as np
from jaxtyping import Float

from workbench.arm.identification_jacobian import Linearisation
from workbench.arm.robot import Robot
from workbench.base.errors import DataError
from workbench.base.types import frozen
from workbench.identification.problem_blocks import Noise
from workbench.plate.free_constants import identified_names
from workbench.plate.observability import INDICES, O, evaluate
from workbench.plate.plate import Plate
from workbench.plate.predicted_error import position_weight, predicted_error, rise_without_each
from workbench.plate.readings import linearise_targets
from workbench.plate.region_poses import plate_region_poses
from workbench.session.state import Score, TargetState

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
        noise: The instrument; the making of the plate comes on top.
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
    expected = predicted_error(linearisation, robot, region_q) if len(region_q) else None
    if expected is not None:
        rises[used] = rise_without_each(linearisation, position_weight(robot, region_q, names))
    return Score(
        per_target=frozen(per_target),
        indices=evaluate(linearisation),
        measurable=len(used),
        rank=linearisation.rank(),
        parameters=len(names),
        condition=linearisation.condition,
        position=np.nan if expected is None else expected.position_rms,
        rotation=np.nan if expected is None else expected.rotation_rms,
        rises=frozen(rises),
        worst=worst_determined(linearisation),
        linearisation=linearisation,
    )


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
