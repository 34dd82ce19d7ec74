"""Poses at which to read a pendant: few, within limits, clear of the arm itself, at whole degrees.

Joint positions that were commanded in whole degrees are known exactly, whatever the display rounds.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

import workbench as wb
from workbench.arm.frame import Frame
from workbench.arm.joint_units import shown_joints, sliding
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.base.files import write_text
from workbench.base.types import Freedom
from workbench.plate.optimiser.meshes import arm_shape
from workbench.plate.optimiser.shapes import ON_THE_TABLE

MARGIN = float(np.deg2rad(3.0))
"""Distance of the joints from their limits [rad]."""
CLEARANCE, FLOOR = 0.01, 0.02
"""Distance of the arm from itself and the floor, which is so high above its base's plane [m]."""
POSTURES = 200
"""Postures that show how low links hang."""
MIN_POSES = 8


@dataclass(frozen=True, eq=False)
class Plan:
    """Poses to read.

    Args:
        q: Joint positions [rad or m].
    """

    robot: Robot
    q: Float[np.ndarray, "poses n"]

    def save(self, path: Path | str) -> Path:
        slides = sliding(self.robot)
        heads = [f"q{k + 1}[{'mm' if slide else 'deg'}]" for k, slide in enumerate(slides)]
        head = ",".join((*heads, "x[mm]", "y[mm]", "z[mm]", "a", "b", "c"))
        rows = [",".join(f"{v:g}" for v in row) + 6 * "," for row in shown_joints(self.robot, self.q).round()]
        return write_text(path, "\n".join((*(f"# {text}" for text in HELP), head, *rows)) + "\n")


HELP = (
    "Move the joints to each line's positions, slowly; watch for obstacles around the arm.",
    "Type x, y, z and the orientation as the pendant shows them, with all digits.",
    "Three angles or a rotation vector: a, b, c. A quaternion: add a column d.",
)


def plan_readings(robot: Robot, number: int, *, seed: int = 0) -> Plan:
    if number < MIN_POSES:
        raise OptionError(f"--plan must be at least {MIN_POSES} poses, got {number}; 30 suit most arms")
    bare = robot.bare.with_frames(base=Frame(free=Freedom.AUTO), tool=Frame(free=Freedom.AUTO))
    if not hasattr(wb, "choose_poses"):
        raise OptionError("--plan needs workbench's extra poses, which is not installed")
    limits = wb.PoseLimits(margin=MARGIN, clearance=CLEARANCE, floor=_floor(bare))
    found = wb.choose_poses(bare, number, limits=limits, base=True, tool=True, seed=seed)
    shown = shown_joints(robot, found.q).round()
    return Plan(robot, np.where(sliding(robot), 1e-3 * shown, np.deg2rad(shown)))


def _floor(robot: Robot) -> float:
    """Height that the arm keeps above [m]: its base's plane, or lower where links hang below that anyway."""
    shape = arm_shape(robot, CLEARANCE)
    low, high = robot.search_limits.T
    q = np.random.default_rng(0).uniform(low, high, (POSTURES, robot.dof))
    lowest = shape.lowest(shape.placements(q))[:, shape.bodies > ON_THE_TABLE]
    return min(FLOOR, float(np.quantile(lowest, 0.75, axis=0).min()) - CLEARANCE)
