"""What an instrument on a link watches: that link's frame, from one that stands level under the arm.

Between the two lie the elements of the arm up to the link, without base and tool: gravity is given in the
frame after the base, so that the base turns both alike.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from workbench.arm import chain as chains
from workbench.arm.chain import WHOLE
from workbench.arm.gravity import level_axes
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import shift_of
from workbench.base import se3
from workbench.base.errors import DataError


@dataclass(frozen=True, eq=False)
class Watched:
    """Elements between two frames, and how the first of them stands.

    Args:
        part: Elements of the full chain.
        level: Turns coordinates of the arm's first frame to those whose z axis points upwards; None if they
            are to be left as they are.
    """

    part: slice = field(default_factory=lambda: WHOLE)
    level: Float[np.ndarray, "3 3"] | None = None

    def turned(self, poses: np.ndarray, twists: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Poses (rows, 4, 4) and twists (rows, 6, p) in the level axes."""
        if self.level is None:
            return poses, twists
        both = np.kron(np.eye(2), self.level)
        turn = se3.pose(self.level, np.zeros(3))
        return turn @ poses, both @ twists


TOOL = Watched()
"""The tool in the measuring frame, by the whole chain."""


def watched(robot: Robot, link: int | None) -> Watched:
    """What is watched on a moving link, counted from 1; on the base for 0, the tool for None."""
    if link is None:
        return TOOL
    moving = [i for i, joint in enumerate(robot.joints) if joint.kind != "fixed"]
    if not 0 <= link <= len(moving):
        raise DataError(
            f"the data have tilts of link {link}, and robot '{robot.name}' has links 1 to {len(moving)}, and "
            "0 for its base; correct the number in the columns tilt_x, tilt_y"
        )
    end = robot.chain_ends[moving[link - 1]] if link else robot.base_size - 1
    return Watched(slice(robot.base_size, end + 1), level_axes(robot.gravity))


def watched_poses(robot: Robot, motion: Motion, link: int | None) -> Float[np.ndarray, "rows 4 4"]:
    """Poses of what is watched on a link of the deflected arm; the tool's in the measuring frame for None."""
    robot.check_joints(motion.q)
    view = watched(robot, link)
    poses = chains.poses(robot.chain, motion.q, shift=shift_of(robot, motion), part=view.part)
    return view.turned(poses, np.zeros((len(poses), 6, 0)))[0]
