"""Clearance of an arm from plate, blocks, table and itself.

An arm from a URDF with meshes is represented by these (`mesh_arm`), any other one by capsules along its links
(`capsule_arm`). Distances are negative, or 0, where bodies overlap. Everything is in the robot's base.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.plate.optimiser.capsules import capsule_arm
from workbench.plate.optimiser.meshes import mesh_arm
from workbench.plate.optimiser.shapes import MAX_MEASURED_DISTANCE, ON_THE_TABLE, ArmShape, Hull, Placements


def arm_shape(robot: Robot, clearance: float) -> ArmShape:
    """The collision shape of an arm.

    Args:
        clearance: Required distance [m].
    """
    found, capsules = mesh_arm(robot, clearance), capsule_arm(robot)
    if found is not None or robot.urdf is None:
        return found or capsules
    why = f"{robot.urdf.path.name} has no meshes that can be found and read"
    return replace(capsules, source=f"{capsules.source}: {why}")


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Static obstacles independent of the blocks: the plate, the table, the arm itself.

    Args:
        arm: The arm's shape.
        plate: The plate's solid, if it has one, and the posts of a ball-bar's anchors.
        floor: Height of the table in the robot's base [m]; None if there is none.
    """

    arm: ArmShape
    plate: tuple[Hull, ...]
    floor: float | None

    def distances(
        self, frames: Placements, *, far: float = MAX_MEASURED_DISTANCE, minimum: float | None = None
    ) -> Float[np.ndarray, "rows 3"]:
        """Minimum distance from itself, the table and the plate in every row, at most `far` [m].

        Args:
            far: Maximum distance of interest [m].
            minimum: Rows with a smaller distance than this may be given as 0 [m].
        """
        arm = self.arm
        result = np.full((len(frames), 3), far)
        result[:, 0] = arm.own_distances(frames, far=far, minimum=minimum)
        free = arm.bodies > ON_THE_TABLE
        if self.floor is not None and free.any():
            result[:, 1] = np.minimum(arm.lowest(frames)[:, free].min(1) - self.floor, far)
        every = np.ones(len(arm.bodies), bool)
        for hull in self.plate:
            gaps = arm.hull_distances(frames, [hull], checked=every, far=far, minimum=minimum)
            result[:, 2] = np.minimum(result[:, 2], gaps)
        return result
