"""The score of the targets as the arm stands at them, and a trial of their plate on virtual arms.

Errors are predicted for poses of the region about the orientations of the plate as it was loaded: of that
plate the same number as `plate score` says, of a changed one a number that compares with it.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.base.errors import DataError
from workbench.base.types import frozen
from workbench.data.accuracy_requirement import Wanted
from workbench.identification.problem_blocks import Noise
from workbench.plate.free_constants import identified_names
from workbench.plate.plate import Plate
from workbench.plate.plate_score import SetScore
from workbench.plate.region_poses import plate_region_poses
from workbench.plate.score import set_score
from workbench.session.part import AbstractPart
from workbench.session.target_postures import TargetState


def score(
    robot: Robot,
    plate: Plate,
    states: tuple[TargetState, ...],
    *,
    noise: Noise,
    region_q: Float[np.ndarray, "poses n"],
) -> SetScore:
    """The score of the measurable targets; its error stays unknown without poses of the region."""
    used = [i for i, state in enumerate(states) if state.measurable]
    return set_score(
        robot,
        plate,
        np.array([states[i].q for i in used]).reshape(-1, robot.dof),
        [states[i].branch for i in used],
        np.array(used, int),
        q_region=region_q,
        names=identified_names(robot),
        sigma=(noise.position, noise.rotation),
    )


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
