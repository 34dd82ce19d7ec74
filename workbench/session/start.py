"""The beginning of a session: a robot, a plate, and what follows from the two."""

import numpy as np
from jaxtyping import Float

from workbench.design.plate import Plate
from workbench.design.region_poses import region_poses
from workbench.design.sampling import random_poses
from workbench.errors import DataError, OptionError
from workbench.model.newton import Task
from workbench.robots.robot import Robot
from workbench.session.reach import place_all
from workbench.session.score import score
from workbench.session.state import Noise, Session
from workbench.types import frozen

REGION_POSES = 24
"""Places in the region, in all branches of each, for which the error is predicted."""
RANDOM_POSES = 150
"""Random postures with the tool in the region instead, for arms that few random poses suit."""


def start(robot: Robot, plate: Plate, *, noise: Noise | None = None, seed: int = 0) -> Session:
    """A session in which nothing has happened yet.

    Args:
        robot: Nominal robot.
        plate: Fixture with at least one target.
        noise: The instrument; 0.1 mm and 0.02° if None.
        seed: For the poses at which the error is predicted, and the first mix of branches.

    Raises:
        OptionError: the plate has no targets.
    """
    if not len(plate):
        raise OptionError(f"plate '{plate.name}' has no targets; give at least one [[target]]")
    noise = noise or Noise()
    rng = np.random.default_rng(seed)
    region_q = _region(robot, plate, rng)
    states = place_all(robot, plate, region_q=region_q, rng=rng)
    first = score(robot, plate, states, noise=noise, region_q=region_q)
    return Session(
        robot=robot,
        plate=plate,
        first_plate=plate,
        first_states=states,
        states=states,
        score=first,
        first_score=first,
        region_q=region_q,
        noise=noise,
    )


def _region(robot: Robot, plate: Plate, rng: np.random.Generator) -> Float[np.ndarray, "poses n"]:
    """Poses that matter: any place in the region, any orientation, any branch; none if out of reach."""
    try:
        if robot.dof < int(Task.POSE):
            return frozen(random_poses(robot, RANDOM_POSES, rng=rng, region=plate.region))
        return frozen(region_poses(robot, plate.region, REGION_POSES, rng=rng))
    except DataError:
        return frozen(np.zeros((0, robot.dof)))
