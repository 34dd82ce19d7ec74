"""The score of a set of targets: how well measurements there would determine the robot's parameters."""

import numpy as np
from jaxtyping import Float

from workbench.design.accuracy import predicted_error
from workbench.design.freedom import identified_names
from workbench.design.indices import INDICES, O, evaluate
from workbench.design.plate import Kind, Plate
from workbench.model.linearisation import linearise
from workbench.robots.robot import Robot
from workbench.session.state import Noise, Score, TargetState
from workbench.types import frozen


def score(
    robot: Robot,
    plate: Plate,
    states: tuple[TargetState, ...],
    *,
    noise: Noise,
    region_q: Float[np.ndarray, "poses n"],
) -> Score:
    """Indices and predicted error of the reached targets, each measured once.

    Args:
        robot: Nominal geometry.
        plate: Whose targets they are.
        states: How the arm stands at every target.
        noise: The instrument.
        region_q: Poses for which the error is predicted [rad or m].
    """
    names = identified_names(robot)
    used = [i for i, state in enumerate(states) if state.reached]
    per_target = np.full(len(states), np.nan)
    if not used:
        nothing = dict.fromkeys(INDICES, 0.0)
        return Score(frozen(per_target), nothing, 0, 0, len(names), np.inf, np.inf, np.inf)
    points_only = all(plate.targets[i].kind is not Kind.SEAT for i in used)
    linearisation = linearise(
        robot,
        np.stack([states[i].q for i in used]),
        names=names,
        sigma_position=noise.position,
        sigma_rotation=None if points_only else noise.rotation,
    )
    per_target[used] = O().per_pose(linearisation)
    expected = predicted_error(linearisation, robot, region_q) if len(region_q) else None
    return Score(
        per_target=frozen(per_target),
        indices=evaluate(linearisation),
        reached=len(used),
        rank=linearisation.rank(),
        parameters=len(names),
        condition=linearisation.condition,
        position=np.nan if expected is None else expected.position_mean,
        rotation=np.nan if expected is None else expected.rotation_mean,
    )
