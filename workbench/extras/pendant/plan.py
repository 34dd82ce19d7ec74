"""Poses at which to read a pendant: few, within limits, clear of the arm itself, at whole degrees.

Joint positions that were commanded in whole degrees are known exactly, whatever the display rounds.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

import workbench as wb
from workbench.arm.calibration_record import Expected
from workbench.arm.frame import Frame
from workbench.arm.joint_units import shown_joints, sliding
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.base.files import write_text
from workbench.base.progress import part_of
from workbench.base.types import Freedom
from workbench.data.simulation.instruments import Instrument, Observes
from workbench.data.simulation.simulate import simulate, virtual_arm
from workbench.extras.pendant.convention import UNIFORM
from workbench.extras.pendant.extract import WANTED
from workbench.identification.identify import identify
from workbench.plate.optimiser.meshes import arm_shape
from workbench.plate.optimiser.shapes import ON_THE_TABLE

MARGIN = float(np.deg2rad(3.0))
"""Distance of the joints from their limits [rad]."""
CLEARANCE, FLOOR = 0.01, 0.02
"""Distance of the arm from itself and the floor, which is so high above its base's plane [m]."""
POSTURES = 200
"""Postures that show how low links hang."""
DISPLAY = Instrument(
    name="display",
    observes=Observes.POSE,
    sigma_position=1e-4 * UNIFORM,
    sigma_rotation=float(np.deg2rad(0.01)) * UNIFORM,
)
"""A usual one: rounding to 0.1 mm and 0.01°."""
MIN_POSES = 8


@dataclass(frozen=True, eq=False)
class Plan:
    """Poses to read.

    Args:
        q: Joint positions [rad or m].
        expected: Error of the model that they give at a usual display, over all postures.
    """

    robot: Robot
    q: Float[np.ndarray, "poses n"]
    expected: Expected

    @property
    def sentence(self) -> str:
        size = 1e3 * self.expected.position
        more = "" if self.expected.position <= WANTED else "; more poses make it smaller"
        return (
            f"{len(self.q)} poses: expected error of the extracted model {size:.3f} mm (root mean square "
            f"over all postures) with a display of 0.1 mm and 0.01°{more}"
        )

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
    with part_of(0.0, 0.5):
        found = wb.choose_poses(bare, number, limits=limits, base=True, tool=True, seed=seed)
    shown = shown_joints(robot, found.q).round()
    q = np.where(sliding(robot), 1e-3 * shown, np.deg2rad(shown))
    rng = np.random.default_rng(seed)  # of a virtual arm, since the nominal one would be found too well
    data = simulate(virtual_arm(bare, rng=rng), Motion(q), instrument=DISPLAY, rng=rng)
    with part_of(0.5, 0.5):
        return Plan(robot, q, identify(bare, data, held_out=0.0).transfer.anywhere)


def _floor(robot: Robot) -> float:
    """Height that the arm keeps above [m]: its base's plane, or lower where links hang below that anyway."""
    shape = arm_shape(robot, CLEARANCE)
    low, high = robot.search_limits.T
    q = np.random.default_rng(0).uniform(low, high, (POSTURES, robot.dof))
    lowest = shape.lowest(shape.placements(q))[:, shape.bodies > ON_THE_TABLE]
    return min(FLOOR, float(np.quantile(lowest, 0.75, axis=0).min()) - CLEARANCE)
