"""The beginning of a session: a robot, a plate, and what follows from the two."""

import numpy as np

from workbench.arm.inverse.damped_newton import Task
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.base.types import frozen
from workbench.plate.plate import Plate
from workbench.session.reach import place_all
from workbench.session.region import draw_region
from workbench.session.score import score
from workbench.session.state import Noise, Session
from workbench.session.target_steps import commit_step


def start(robot: Robot, plate: Plate, *, noise: Noise | None = None, seed: int = 0) -> Session:
    """A session in which nothing has happened yet.

    Arms of fewer than six joints take seconds to be brought to random poses: their predicted error is left
    to a chore (`SampleRegion`).

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
    is_quick = robot.dof >= int(Task.POSE)
    region_q = draw_region(robot, plate.region, rng) if is_quick else frozen(np.zeros((0, robot.dof)))
    states = place_all(robot, plate, region_q=region_q, rng=rng)
    first = score(robot, plate, states, noise=noise, region_q=region_q)
    return commit_step(
        Session(
            robot=robot,
            plate=plate,
            first_plate=plate,
            first_states=states,
            states=states,
            score=first,
            first_score=first,
            region_q=region_q,
            sampled=plate.region if is_quick else None,
            noise=noise,
        )
    )
