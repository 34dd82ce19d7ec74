"""Clearance of an arm from plate, blocks, table and itself.

An arm from a URDF with meshes is represented by these (`mesh_arm`), any other one by capsules along its links
(`capsule_arm`). Distances are negative, or 0, where bodies overlap. Everything is in the robot's base.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.plate.optimiser.capsules import capsule_arm
from workbench.plate.optimiser.meshes import mesh_arm
from workbench.plate.optimiser.shapes import (
    MAX_MEASURED_DISTANCE,
    ON_THE_TABLE,
    ArmShape,
    Collider,
    Placements,
    below,
)


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


def clearances(
    arm: ArmShape,
    frames: Placements,
    *,
    solids: Sequence[Collider] = (),
    floor: float | None = None,
    far: float = MAX_MEASURED_DISTANCE,
    minimum: float | None = None,
) -> Float[np.ndarray, "rows 3"]:
    """Minimum distance of an arm from itself, the table and solids in every row, at most `far` [m].

    Args:
        solids: The plate's, if it has one, and the posts of a ball-bar's anchors.
        floor: Height of the table in the robot's base [m]; None if there is none.
        far: Maximum distance of interest [m].
        minimum: Rows with a smaller distance than this may be given as 0 [m].
    """
    result = np.full((len(frames), 3), far)
    result[:, 0] = arm.own_distances(frames, far=far, minimum=minimum)
    table = [] if floor is None else [(1, below(floor), arm.bodies > ON_THE_TABLE)]
    for column, solid, checked in (*table, *((2, solid, arm.bodies >= 0) for solid in solids)):
        gaps = arm.hull_distances(frames, [solid], checked=checked, far=far, minimum=minimum)
        result[:, column] = np.minimum(result[:, column], gaps)
    return result
